"""``python -m rollcli``: the same program as ``rollcli``."""

from rollcli.cli.main import main

if __name__ == "__main__":
    main()

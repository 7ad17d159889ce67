"""``python -m rollcli``: the same program as ``rollcli``."""


def main() -> None:
    """Run the program."""
    from rollcli.cli.main import main as program  # here: each worker process imports this module anew

    program(prog_name="rollcli")


if __name__ == "__main__":
    main()

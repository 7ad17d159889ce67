"""Write the tables of commands and options in rollcli/cli/README.md: python -m tests.readme_tables"""

import re
from collections.abc import Iterator
from pathlib import Path

import click

from rollcli.cli.command import OTHER
from rollcli.cli.main import COMMANDS, main
from rollcli.files.atomic import write_atomic

OPTIONS_PAGE = Path(__file__).resolve().parent.parent / "rollcli" / "cli" / "README.md"
BEGIN, END = "<!-- made by make readme -->\n", "<!-- end of what make readme makes -->"
_DEFAULT = re.compile(r"\s*\[(?:default: )?([^\]]*(?:\[[^\]]*\])?[^\]]*)\]$")


def with_tables(page: str) -> str:
    """Return the page with its tables as the commands have them."""
    before, _, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    return f"{before}{BEGIN}\n{tables()}\n{end}{after}"


def tables() -> str:
    """Commands, then their options by section: what several commands share is listed once."""
    users: dict[tuple[str, str], list[str]] = {}
    called = list(commands())
    for name, ctx in called:
        for title, row in options(ctx):
            users.setdefault((title, row), []).append(name)
    groups: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for (title, row), names in users.items():
        groups.setdefault((title, tuple(names)), []).append(row)
    parts = ["| command | does |", "|---|---|"]
    parts += [f"| `{_usage(ctx)}` | {_first_sentence(ctx.command)} |" for _, ctx in called]
    for (title, names), rows in groups.items():
        shared = "every command" if len(names) == len(called) else ", ".join(f"`{name}`" for name in names)
        parts += ["", f"**{title}** ({shared})", "", "| option | meaning | default |", "|---|---|---|", *rows]
    return "\n".join(parts) + "\n"


def commands() -> Iterator[tuple[str, click.Context]]:
    """Every command that does something, and how it would be called."""
    root = click.Context(main, info_name="rollcli", **main.context_settings)
    for name in COMMANDS:
        command = main.get_command(root, name)
        ctx = click.Context(command, info_name=name, parent=root)
        if isinstance(command, click.Group):
            yield from (
                (f"{name} {each}", click.Context(command.commands[each], info_name=each, parent=ctx))
                for each in command.list_commands(ctx)
            )
        else:
            yield name, ctx


def options(ctx: click.Context) -> Iterator[tuple[str, str]]:
    """Each option's section, and its row of a table; --help aside."""
    for param in ctx.command.params:
        record = param.get_help_record(ctx)
        if record is not None and isinstance(param, click.Option):
            yield getattr(param, "section", OTHER), _row(*record)


def _row(names: str, text: str) -> str:
    default = _DEFAULT.search(text)
    meaning = text[: default.start()] if default else text
    flags = ", ".join(f"`{each}`" for each in names.split(", "))
    cells = (flags, meaning, default[1] if default else "")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _usage(ctx: click.Context) -> str:
    pieces = [each for each in ctx.command.collect_usage_pieces(ctx) if each != "[OPTIONS]"]
    return " ".join([ctx.command_path, *pieces])


def _first_sentence(command: click.Command) -> str:
    text = " ".join((command.help or "").split("\n\n")[0].split())
    return re.split(r"[.:] ", text)[0].rstrip(".")


if __name__ == "__main__":
    write_atomic(OPTIONS_PAGE, with_tables(OPTIONS_PAGE.read_text("utf-8")).encode())

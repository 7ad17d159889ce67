"""Variables of the environment that set nothing, for their names are mistaken."""

import os

import click

from rollcli.messages import say

_PROGRAM = "ROLLCLI_"
_SETTINGS = ("ROLLCLI_STORE_TIMEOUT",)  # of no command


def tell_mistaken_variables(ctx: click.Context) -> None:
    """Say which variables name no option of this command, no other command and no setting."""
    of_command = f"{ctx.auto_envvar_prefix}_"
    known = [f"{of_command}{str(param.name).upper()}" for param in ctx.command.params]
    root = ctx.find_root()
    assert isinstance(root.command, click.Group)
    commands = tuple(f"{_PROGRAM}{name.upper()}_" for name in root.command.list_commands(root))
    for name in sorted(os.environ):
        if not name.startswith(_PROGRAM) or name in (*known, *_SETTINGS):
            continue
        if name.startswith(of_command):
            _tell(name, f"there is no such option of {ctx.command_path}", known, of_command)
        elif not name.startswith(commands):
            _tell(name, "there is no such command or setting", [*known, *_SETTINGS], _PROGRAM)


def _tell(name: str, what: str, known: list[str], same: str) -> None:
    import difflib  # only here: it takes a while to load

    rest = {each.removeprefix(same): each for each in known}
    close = difflib.get_close_matches(name.removeprefix(same), rest, n=1)
    say(f"{name}: {what}" + (f"; did you mean {rest[close[0]]}?" if close else ""))

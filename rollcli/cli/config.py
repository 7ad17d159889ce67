"""`--config FILE`: a TOML file of option values, below flags and the environment.

Keys at the top are for every command that has such an option. Keys in a table, such as ``[estimate]`` or
``[evaluate.accuracy]``, are for that command alone.
"""

import sys
from collections.abc import Iterator
from typing import Any

import click

from rollcli.cli.command import option
from rollcli.cli.types import FILE
from rollcli.errors import InputError
from rollcli.files.bounded import MOST_SETTINGS, as_utf8, read_given


def _use(ctx: click.Context, param: click.Parameter, path: str | None) -> None:
    """Make the file's values the defaults of this command."""
    if path is None:
        return
    commands = _commands(ctx)
    options = _options(ctx.command)
    defaults = {}
    for words, values in _tables(_load(path)):
        if words and values and " ".join(words) not in commands:
            raise click.UsageError(f"{path}: there is no command for the table [{'.'.join(words)}]", ctx)
        if words not in ((), tuple(ctx.command_path.split(" ")[1:])):
            continue
        for key, value in values.items():
            name = key.replace("-", "_")
            if name in options:
                defaults[name] = _checked(ctx, options[name], value, path)
            elif words or not any(name in _options(each) for each in commands.values()):
                raise click.UsageError(f"{path}: there is no option {key!r}{_nearest(name, options)}", ctx)
    ctx.default_map = {**(ctx.default_map or {}), **defaults}


def _tables(values: dict[str, Any], words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the words of each table, from the top down, and its keys; no command has more than two words."""
    inner = {key: value for key, value in values.items() if isinstance(value, dict)} if len(words) < 2 else {}
    yield words, {key: value for key, value in values.items() if key not in inner}
    for key, value in inner.items():
        yield from _tables(value, (*words, key))


def _options(command: click.Command) -> dict[str, click.Option]:
    """Return what a file may set, by the names of parameters."""
    found = {str(each.name): each for each in command.params if isinstance(each, click.Option)}
    found.pop("config", None)
    return found


def _commands(ctx: click.Context) -> dict[str, click.Command]:
    """Return every command of the program by its words; loads their modules."""
    root = ctx.find_root()
    assert isinstance(root.command, click.Group)
    found: dict[str, click.Command] = {}
    for name in root.command.list_commands(root):
        command = root.command.get_command(root, name)
        if isinstance(command, click.Group):
            found.update({f"{name} {each}": inner for each, inner in command.commands.items()})
        elif command is not None:
            found[name] = command
    return found


def _load(path: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):  # here: every --help imports this module
        import tomllib
    else:
        import tomli as tomllib

    try:
        return tomllib.loads(as_utf8(read_given(path, MOST_SETTINGS), path).decode())
    except OSError as error:
        raise click.UsageError(f"{path}: cannot be read: {error.strerror}") from error
    except InputError as error:
        raise click.UsageError(str(error)) from error
    except (ValueError, RecursionError) as error:  # TOML, UTF-8, numbers of thousands of digits
        raise click.UsageError(f"{path}: is not TOML: {error}") from error


def _nearest(name: str, options: dict[str, click.Option]) -> str:
    import difflib

    close = difflib.get_close_matches(name, options, n=1, cutoff=0)
    return f"; the nearest is {close[0].replace('_', '-')!r}" if close else ""


def _checked(ctx: click.Context, declared: click.Option, value: Any, path: str) -> Any:
    """Convert the value as this option does; an error names the file and the key."""
    if declared.multiple and not isinstance(value, list):
        value = [value]
    if declared.is_flag and not isinstance(value, bool):
        raise click.UsageError(f"{path}: {_key(declared)} is true or false, not {value!r}", ctx)
    if isinstance(declared.type, click.types.StringParamType | click.Path | click.Choice):
        for text in value if declared.multiple else [value]:
            if not isinstance(text, str) or "\0" in text:
                raise click.UsageError(f"{path}: {_key(declared)} is a text in quotes, not {text!r}", ctx)
    try:
        declared.type_cast_value(ctx, value)
    except click.BadParameter as error:
        raise click.UsageError(f"{path}: {_key(declared)}: {error.message}", ctx) from error
    return value


def _key(declared: click.Option) -> str:
    return repr(str(declared.name).replace("_", "-"))


config_option = option(
    "--config",
    FILE,
    "TOML file with option names as keys; flags and the environment win over it.",
    is_eager=True,
    expose_value=False,
    callback=_use,
)

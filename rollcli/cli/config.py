"""`--config FILE`: a TOML file of option values, below flags and the environment."""

import sys
from pathlib import Path
from typing import Any

import click

from rollcli.cli.command import option
from rollcli.cli.types import FilePath


def _use(ctx: click.Context, param: click.Parameter, path: str | None) -> None:
    """Make the file's values the defaults of this command."""
    if path is None:
        return
    options = {
        str(p.name): p for p in ctx.command.params if isinstance(p, click.Option) and p.name != param.name
    }
    defaults = {}
    for key, value in _load(path).items():
        name = key.replace("-", "_")
        if name not in options:
            raise click.UsageError(f"{path}: there is no option {key!r}{_nearest(name, options)}", ctx)
        defaults[name] = _checked(ctx, options[name], value, path)
    ctx.default_map = {**(ctx.default_map or {}), **defaults}


def _load(path: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):  # here: every --help imports this module
        import tomllib
    else:
        import tomli as tomllib

    try:
        return tomllib.loads(Path(path).read_text("utf-8"))
    except OSError as error:
        raise click.UsageError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise click.UsageError(f"{path}: is not TOML: {error}") from error


def _nearest(name: str, options: dict[str, click.Option]) -> str:
    import difflib

    close = difflib.get_close_matches(name, options, n=1, cutoff=0)
    return f"; the nearest is {close[0].replace('_', '-')!r}" if close else ""


def _checked(ctx: click.Context, declared: click.Option, value: Any, path: str) -> Any:
    """The value as this option takes it, or an error that names file and key."""
    if declared.multiple and not isinstance(value, list):
        value = [value]
    if declared.is_flag and not isinstance(value, bool):
        raise click.UsageError(f"{path}: {_key(declared)} is true or false, not {value!r}", ctx)
    if isinstance(declared.type, click.types.StringParamType | click.Path | click.Choice):
        for text in value if declared.multiple else [value]:
            if not isinstance(text, str):
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
    type=FilePath(),
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_use,
    help="TOML file with option names as keys; flags and the environment win over it.",
)

"""Make the command that continues an interrupted run, and choose between --resume and --overwrite."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import click
from click.core import ParameterSource

from rollcli.messages import without_secrets

_STARTS = ("--overwrite", "--resume")
_NEAREST_FIRST = [ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT, ParameterSource.DEFAULT_MAP]


def one_start(ctx: click.Context, *, resume: bool, overwrite: bool) -> tuple[bool, bool]:
    """Decide between --resume and --overwrite: flags win over the environment, and that over --config.

    Returns
    -------
    tuple of bool
        (resume, overwrite); both where both are given in the same place, which is an error later.
    """
    if not (resume and overwrite):
        return resume, overwrite
    to_resume, to_overwrite = (_distance(ctx, name) for name in ("resume", "overwrite"))
    return to_resume <= to_overwrite, to_overwrite <= to_resume


def _distance(ctx: click.Context, name: str) -> int:
    source = ctx.get_parameter_source(name)
    return _NEAREST_FIRST.index(source) if source in _NEAREST_FIRST else len(_NEAREST_FIRST)


def resume_command(ctx: click.Context) -> str:
    """Make a command that can be pasted into any shell: settings from the environment become options."""
    import shlex  # here: every --help imports this module

    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    options = [word for word in words[:end] if word not in _STARTS]
    line = [_program(), *options, *_from_environment(ctx), "--resume", *words[end:]]
    shown = [without_secrets(word) for word in line]
    hints = ["with the same list on stdin"] if _reads_stdin(ctx) else []
    hints += ["with the signed addresses"] if shown != line else []
    return shlex.join(shown) + ("  # " + " and ".join(hints) if hints else "")


def _program() -> str:
    """Name the program, or its path when the shell would not find it."""
    called = sys.argv[0]
    return called if Path(called).name == "rollcli" and not shutil.which("rollcli") else "rollcli"


def _reads_stdin(ctx: click.Context) -> bool:
    given = ctx.params.get("inputs") or ()
    return "-" in given or ctx.params.get("files_from") == "-"


def _from_environment(ctx: click.Context) -> Iterator[str]:
    for param in ctx.command.params:
        flag = param.opts[-1]
        if ctx.get_parameter_source(str(param.name)) is not ParameterSource.ENVIRONMENT or flag in _STARTS:
            continue
        value = param.value_from_envvar(ctx)
        if isinstance(param, click.Option) and param.is_flag:
            yield from [flag] if param.type_cast_value(ctx, value) else []
        else:
            for text in value if isinstance(value, list | tuple) else [value]:
                yield from (flag, str(text))

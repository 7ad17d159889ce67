"""The `rollcli` group: it imports a command when it is called, and ends every error as one line."""

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import click

from rollcli import __version__
from rollcli.errors import ExitStatus, InputError, RollcliError, UsageError, output_error
from rollcli.messages import one_line, say

# name -> (module of this package, one-line help): `rollcli --help` needs no command's module
COMMANDS = {
    "estimate": ("estimate", "The roll of each disparity map or stereo pair, as CSV, JSON Lines or Parquet."),
    "disparity": ("images", "Stereo pairs to disparity maps with OpenCV SGBM."),
    "derotate": ("images", "Rotate maps by one angle, or by the angles of a result."),
    "vdisparity": ("images", "v-disparity images of maps."),
    "heights": ("images", "Heights over the road, of maps and their result."),
    "simulate": ("simulate", "Render road stereo pairs and true disparity with known roll."),
    "evaluate": ("evaluate", "The paper's experiments; accuracy against known angles."),
    "rig": ("rig", "What a result says about the rig: mounting, drift, jumps; a gate for CI."),
    "report": ("report", "An HTML report of a result."),
}


class LazyGroup(click.Group):
    """A group that imports a command's module when the command is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = getattr(import_module(f"rollcli.cli.{COMMANDS[cmd_name][0]}"), cmd_name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in COMMANDS and not ctx.resilient_parsing:
            from rollcli.cli.command import nearest  # nothing else needs it at each start

            close = nearest(args[0].lower(), COMMANDS)
            hint = f"; did you mean {close!r}?" if close else f"; commands: {', '.join(COMMANDS)}"
            raise click.UsageError(f"there is no command {args[0]!r}{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

    def make_context(self, *args: Any, **extra: Any) -> click.Context:
        """Parse, which answers --help."""
        with _system_faults_told():
            return super().make_context(*args, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command."""
        try:
            with _system_faults_told():
                return super().invoke(ctx)
        except KeyboardInterrupt:  # click would write a line of its own
            say("interrupted")
            return ctx.exit(ExitStatus.INTERRUPTED)
        except EOFError as error:  # click would take it for Ctrl-D at a prompt, and say "interrupted"
            raise RuntimeError(f"EOFError: {error}").with_traceback(error.__traceback__) from None

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> Any:
        """Run the program, and always exit with the documented status; an error is one line on stderr."""
        program: Any = super().main
        try:
            status = program(*args, standalone_mode=False, **extra) or ExitStatus.DONE
        except click.ClickException as error:
            say(one_line(_with_hint(error)))
            status = error.exit_code
        except (click.Abort, KeyboardInterrupt):
            say("interrupted")
            status = ExitStatus.INTERRUPTED
        except RollcliError as error:
            say(one_line(str(error)))
            status = ExitStatus.USAGE if isinstance(error, UsageError | InputError) else ExitStatus.FAILED
        except MemoryError:
            say("out of memory")
            status = ExitStatus.FAILED
        sys.exit(status)


def _with_hint(error: click.ClickException) -> str:
    """Return what is wrong, and where to look; of the value of an environment variable its name."""
    ctx, message = getattr(error, "ctx", None), error.format_message()
    if isinstance(error, click.BadParameter) and ctx is not None and error.param is not None:
        name = str(error.param.name)
        if ctx.get_parameter_source(name) is click.core.ParameterSource.ENVIRONMENT:
            message = f"{ctx.auto_envvar_prefix}_{name.upper()}: {error.message}"
    return f"{message} (see '{ctx.command_path} --help')" if ctx is not None else message


@contextlib.contextmanager
def _system_faults_told() -> Iterator[None]:
    """End quietly where the reader of stdout has left; say a full disk, a folder gone, a locale too small."""
    try:
        yield
    except BrokenPipeError:  # which click would call a failure
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)  # the interpreter flushes the rest
        os.close(nowhere)
        raise click.exceptions.Exit(ExitStatus.DONE) from None
    except OSError as error:
        if isinstance(error, FileNotFoundError) and error.filename is None:  # of os.getcwd alone
            raise InputError("the current folder is gone") from error
        if error.errno != errno.ENOSPC:
            raise
        raise output_error(error.filename or "standard output", error) from None
    except UnicodeEncodeError as error:
        if sys.getfilesystemencoding() == "utf-8":  # it is another text's than a file's name
            raise
        reason = f"no file can have this name in the encoding of the locale, {error.encoding}"
        raise InputError(f"{error.object}: {reason}; set PYTHONUTF8=1") from None


_OPENCV = tuple(f"opencv-{name}python{kind}" for name in ("", "contrib-") for kind in ("-headless", ""))


def _print_versions(ctx: click.Context, param: click.Parameter, asked: bool) -> None:
    """Print the versions of rollcli, Python and each package it uses; of extras, of those installed."""
    if not asked or ctx.resilient_parsing:
        return
    import platform  # nothing else needs these at each start
    import re
    from importlib import metadata

    python = f"{platform.python_version()} ({platform.python_implementation()}, {platform.platform()})"
    requirements, found = list[str](), {"rollcli": f"rollcli {__version__}", "Python": f"Python {python}"}
    with contextlib.suppress(metadata.PackageNotFoundError):  # it may run from its folder, not installed
        requirements = metadata.requires("rollcli") or []
    for requirement in requirements:
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        for package in _OPENCV if name in _OPENCV else (name,):  # several that hold the same module
            with contextlib.suppress(metadata.PackageNotFoundError):
                found.setdefault(name, f"{package} {metadata.version(package)}")
        if ";" not in requirement:
            found.setdefault(name, f"{name} not installed")
    click.echo("\n".join(found.values()))
    ctx.exit()


@click.group(
    cls=LazyGroup,
    name="rollcli",
    invoke_without_command=True,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "auto_envvar_prefix": "ROLLCLI",
        "show_default": True,
        "max_content_width": 100,
    },
)
@click.version_option(__version__, prog_name="rollcli", message="%(prog)s %(version)s")
@click.option(
    "--versions",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_versions,
    help="Show the versions of Python and of each dependency.",
)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Estimate the roll angle of a stereo rig from disparity maps or stereo pairs.

    \b
    To start with:
      rollcli estimate maps/ -o rolls.csv
      rollcli estimate --help
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())

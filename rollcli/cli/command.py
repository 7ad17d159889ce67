"""Commands whose help is in sections, how their options are declared, and `--config FILE`.

That is a TOML file of option values, below flags and the environment. Keys at the top are for every
command that has such an option. Keys in a table, such as ``[estimate]`` or ``[evaluate.accuracy]``, are for
that command alone.
"""

import inspect
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import click
from click.core import ParameterSource

from rollcli.cli.types import FILE, FLAG, ParamType, Parsed
from rollcli.errors import ExitStatus, UsageError, reading
from rollcli.files.bounded import MOST_SETTINGS, as_utf8, read_given
from rollcli.messages import say, show_tracebacks

OTHER = "Other options"
Function = Callable[..., Any]
Declaration = Callable[[Function], Function]
_ALWAYS = {each: each.meaning for each in (ExitStatus.FAILED, ExitStatus.USAGE, ExitStatus.INTERRUPTED)}
_OF_FRAMES = {each: each.meaning for each in (ExitStatus.DONE, ExitStatus.FRAMES_FAILED)}


class Needs(NamedTuple):
    """What an option needs of a command and of its other options, to have an effect.

    Attributes
    ----------
    holds : callable
        Tells whether a run has it.
    reason : str
        Why the option has no effect otherwise; may name values of options in braces.
    """

    holds: Callable[[click.Context], bool]
    reason: str


class Option(click.Option):
    """An option that is listed under a heading; the last heading by default.

    Parameters
    ----------
    section : str
        The heading.
    without_word : str or None
        Its value where none of its words follows: click would take an input for its value.
    only_with : sequence of Needs
        Where one of them does not hold, a line says that the option has no effect.
    """

    def __init__(
        self,
        *args: Any,
        section: str = OTHER,
        without_word: str | None = None,
        only_with: Sequence[Needs] = (),
        **attributes: Any,
    ) -> None:
        super().__init__(*args, **attributes)
        self.section, self.without_word, self.only_with = section, without_word, only_with
        self.has_own_default = "default" in attributes

    def completed(self, args: list[str]) -> list[str]:
        """Add the value to those words of the command line that name the option alone."""
        if self.without_word is None or not isinstance(self.type, click.Choice):
            return args
        words = [str(each) for each in self.type.choices]
        end = args.index("--") if "--" in args else len(args)
        return [
            f"{each}={self.without_word}"
            if each in self.opts and at < end and "".join(args[at + 1 : at + 2]).lower() not in words
            else each
            for at, each in enumerate(args)
        ]


class Command(click.Command):
    """A command whose help reads like a manual page: options by section, examples, exit status.

    Attributes
    ----------
    examples : sequence of (str, str)
        A purpose, and the command line for it; several lines are steps.
    statuses : mapping of ExitStatus to str
        How it ends.
    """

    examples: Sequence[tuple[str, str]] = ()
    statuses: Mapping[ExitStatus, str]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words, with the values that options have by themselves."""
        for param in self.get_params(ctx):
            args = param.completed(args) if isinstance(param, Option) else args
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one thread of linear algebra, once it is told what has no effect.

        Its matrices are small: threads spend ten times as long waiting for each other as working. What the
        environment sets for other programs that use the same libraries is left out.
        """
        from rollcli.run.workers.pool import forget_settings, limit_blas_threads

        limit_blas_threads()
        forget_settings()
        if ctx.params.get("verbose"):
            show_tracebacks()
        if not ctx.params.get("quiet"):
            _tell_mistaken_variables(ctx)
            _tell_idle(ctx)
        return super().invoke(ctx)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, by section."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if isinstance(param, click.Option) and record is not None:
                sections.setdefault(getattr(param, "section", OTHER), []).append(record)
        for title in sorted(sections, key=lambda title: title == OTHER):
            with formatter.section(title):
                formatter.write_dl(sections[title])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples, the environment variables and the exit statuses."""
        if self.examples:
            with formatter.section("Examples"):
                for purpose, steps in self.examples:
                    for line in (f"# {purpose}", *steps.splitlines()):
                        formatter.write(f"{'':>{formatter.current_indent}}{line}\n")
        with formatter.section("Environment"):
            formatter.write_text(
                f"Each option is also read from {ctx.auto_envvar_prefix}_<OPTION>, such as "
                f"{ctx.auto_envvar_prefix}_QUIET=1; flags win over it."
            )
        with formatter.section("Exit status"):
            formatter.write_dl([(str(int(status)), meaning) for status, meaning in self.statuses.items()])


def option(names: str, kind: ParamType, *needs: Needs, text: str = "", **attributes: Any) -> Declaration:
    """Declare an option.

    Parameters
    ----------
    names : str
        Such as "-q, --quiet".
    kind : ParamType
        What it takes; `FLAG`: nothing. Its `metavar`, if it has one, stands for it in the help.
    *needs : Needs
        What it needs to have an effect.
    text : str, optional
        Its help; by default what the docstring of a record says of its field: see `Section` and `command`.
    **attributes
        What else `click.option` and `Option` take.
    """
    given: dict[str, Any] = {"is_flag": True} if kind is FLAG else {"type": kind}
    given["metavar"] = getattr(kind, "metavar", None)  # click would turn a type's name into capitals
    attributes = {**given, **attributes}
    return click.option(*names.split(", "), cls=Option, help=text, only_with=needs, **attributes)


class Section(NamedTuple):
    """A section of options that the command receives as one record.

    Attributes
    ----------
    name : str
        What the command's own record, or its function, calls the record.
    title : str
        The heading in the help.
    make : callable
        Makes the record of the values; its fields have defaults and help.
    only_with : sequence of Needs
        What all of its options need to have an effect; see `Option`.
    """

    name: str
    title: str
    make: Callable[..., Any]
    only_with: Sequence[Needs] = ()

    def of(self, *declarations: Declaration) -> Declaration:
        """Declare its options: what `option` and `click.argument` return.

        An option that declares no default or no help has those of the record's field: see `_fill`.
        """

        def declare(function: Function) -> Function:
            count = len(getattr(function, "__click_params__", ()))
            for each in reversed(declarations):
                each(function)
            params = getattr(function, "__click_params__", [])[count:]
            for param in params:
                if isinstance(param, Option):
                    param.section, param.only_with = self.title, (*self.only_with, *param.only_with)
            records = vars(function).setdefault("__records__", {})
            records[self.name] = self.make, _fill(params, self.make)
            return function

        return declare


# of a docstring's sections Attributes and Examples
_FIELD = re.compile(r"^(\w+) : .+\n((?: {4}.+\n?)+)", re.MULTILINE)
_FIELDS = {"from": "result", "sgbm_mode": "mode"}  # of options that have another name
_EXAMPLE = re.compile(r"^(\S.*)\n((?: {4}.+\n?)+)", re.MULTILINE)


def _fill(params: Sequence[click.Parameter], record: Any) -> dict[str, str]:
    """Give options that declare no default or no help those of their fields in a record; return the fields.

    The name of a field may add the unit, `_deg`; those of `_FIELDS` differ.
    """
    known = inspect.signature(record).parameters
    texts: dict[str, str] = {}
    for each in reversed(inspect.getmro(record)):
        texts |= dict(_FIELD.findall(inspect.cleandoc(each.__doc__ or "")))
    field_of: dict[str, str] = {}
    for param in params:
        name = _FIELDS.get(str(param.name), str(param.name))
        field = field_of[str(param.name)] = f"{name}_deg" if f"{name}_deg" in known else name
        if not isinstance(param, Option):
            continue
        # the space that click puts before the defaults that it adds
        text = " ".join(texts.get(field, "").split()).replace(" [default:", "  [default:")
        param.help = param.help or text
        default = known[field].default if field in known else None
        unsaid = default is None or default is False or default in ((), inspect.Parameter.empty)
        if not (param.has_own_default or unsaid):
            if isinstance(param.type, Parsed) and param.type.between:
                default = param.type.shown(default)
            param.default = default
    return field_of


def command(
    make: Callable[..., Any] | None = None, statuses: Mapping[ExitStatus, str] = _OF_FRAMES, **attributes: Any
) -> Callable[[Function], Command]:
    """Make a command of a function, named after it, which returns the exit status.

    The function receives what `make` makes of the records and of the options and arguments that are part of
    none; those have their defaults and help from its fields, as in `Section`. Without `make` it receives them
    by their names. Every command has --config. `statuses` says how it ends, where that is not how frames are
    worked through; wrong usage and so on are added.

    Its docstring is the help; the section Examples has purposes, and indented below each its command, or
    several steps.
    """

    def declare(function: Function) -> Command:
        params = [*getattr(function, "__click_params__", [])[::-1], _CONFIG]
        records = getattr(function, "__records__", {})
        gathered = {each for _, field_of in records.values() for each in field_of}
        own = {} if make is None else _fill([each for each in params if each.name not in gathered], make)

        def run(**values: Any) -> None:
            for name, (of, field_of) in records.items():
                values[name] = of(**{field: values.pop(each) for each, field in field_of.items()})
            named = {own.get(name, name): value for name, value in values.items()}
            click.get_current_context().exit(function(**named) if make is None else function(make(**named)))

        text, _, examples = inspect.cleandoc(function.__doc__ or "").partition("\n\nExamples\n--------\n")
        made = Command(function.__name__, callback=run, params=params, help=text, **attributes)
        made.examples = [(purpose, inspect.cleandoc(steps)) for purpose, steps in _EXAMPLE.findall(examples)]
        made.statuses = dict(sorted({**_ALWAYS, **statuses}.items()))
        return made

    return declare


def _tell_idle(ctx: click.Context) -> None:
    """Say which options of the command line have no effect on this run.

    Those of the environment and of --config are not told: they are there for many commands and runs.
    """
    idle: dict[str, list[str]] = {}
    for param in ctx.command.params:
        given = ctx.get_parameter_source(str(param.name)) is ParameterSource.COMMANDLINE
        needs = param.only_with if given and isinstance(param, Option) else ()
        if missing := next((each for each in needs if not each.holds(ctx)), None):
            idle.setdefault(missing.reason.format(**ctx.params), []).append(max(param.opts, key=len))
    for reason, flags in idle.items():
        say(f"{', '.join(flags)}: no effect here: {reason}")


_PROGRAM = "ROLLCLI_"
_SETTINGS = ("ROLLCLI_STORE_TIMEOUT",)  # of no command


def _tell_mistaken_variables(ctx: click.Context) -> None:
    """Say which variables name no option of this command, no other command and no setting."""
    here = f"{ctx.auto_envvar_prefix}_"
    known = [*_SETTINGS, *(f"{here}{str(param.name).upper()}" for param in ctx.command.params)]
    root = ctx.find_root()
    assert isinstance(root.command, click.Group)
    commands = tuple(f"{_PROGRAM}{name.upper()}_" for name in root.command.list_commands(root))
    for name in sorted({each for each in os.environ if each.startswith(_PROGRAM)}.difference(known)):
        if name.startswith(here) or not name.startswith(commands):
            same = here if name.startswith(here) else _PROGRAM
            rest = {each.removeprefix(same): each for each in known}
            close = rest.get(nearest(name.removeprefix(same), rest))
            hint = f"; did you mean {close}?" if close else ""
            say(f"{name}: there is no such option of {ctx.command_path}{hint}")


def nearest(word: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return which known word is the most like a mistaken one; empty where none is."""
    import difflib  # only here: it takes a while to load

    return next(iter(difflib.get_close_matches(word, known, n=1, cutoff=cutoff)), "")


def _use(ctx: click.Context, param: click.Parameter, path: str | None) -> None:
    """Make the file's values the defaults of this command."""
    if path is None:
        return
    commands, options, defaults = _commands(ctx), _options(ctx.command), {}
    for words, values in _tables(_load(path)):
        table = " ".join(words)
        group = not values and any(each.startswith(f"{table} ") for each in commands)
        if words and table not in commands and not group:
            raise click.UsageError(f"{path}: there is no command for the table [{'.'.join(words)}]", ctx)
        of_table = [commands[table]] if table in commands else commands.values()
        for key, value in values.items():
            name = key.replace("-", "_")
            if name in options and words in ((), tuple(ctx.command_path.split(" ")[1:])):
                defaults[name] = _checked(ctx, options[name], value, path)
            elif not any(name in _options(each) for each in of_table):
                close = nearest(name, _options(commands[table]) if words else options, cutoff=0)
                close = close.replace("_", "-")
                hint = f"; the nearest is {close!r}" if close else ""
                raise click.UsageError(f"{path}: there is no option {key!r}{hint}", ctx)
    ctx.default_map = {**(ctx.default_map or {}), **defaults}


def _tables(values: dict[str, Any], words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the words of each table, from the top down, and its keys; no command has more than two words."""
    inner = {key: value for key, value in values.items() if isinstance(value, dict)} if len(words) < 2 else {}
    yield words, {key: value for key, value in values.items() if key not in inner}
    for key, value in inner.items():
        yield from _tables(value, (*words, key))


def _options(command: click.Command) -> dict[str, click.Option]:
    """Return what a file may set, by the names of parameters."""
    options = (each for each in command.params if isinstance(each, click.Option) and each.expose_value)
    return {str(each.name): each for each in options}


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


_PARTS = 8  # of a dotted key; no command has more than two words, and no option more than one
_MANY_PARTS = re.compile(
    rf"""(?:^|[\[{{,])[ \t]*(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{_PARTS}}}""", re.MULTILINE
)


def _load(path: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):  # here: every --help imports this module
        import tomllib
    else:
        import tomli as tomllib

    with reading(path):
        data = as_utf8(read_given(path, MOST_SETTINGS), path)
    try:
        text = data.decode()
        if _MANY_PARTS.search(text):  # which takes time and memory that grow with the square of their number
            raise UsageError(f"{path}: is no file of options: it has a key of more than {_PARTS} parts")
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # TOML, UTF-8, numbers of thousands of digits
        raise UsageError(f"{path}: is not TOML: {error}") from error


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


_CONFIG = Option(
    ["--config"],
    type=FILE,
    metavar=FILE.metavar,
    help="TOML file with option names as keys; flags and the environment win over it.",
    is_eager=True,
    expose_value=False,
    callback=_use,
)

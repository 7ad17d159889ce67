"""Commands whose help is in sections, and how their options are declared."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from rollcli.cli.environment import tell_mistaken_variables
from rollcli.errors import ExitStatus
from rollcli.messages import say, show_tracebacks

OTHER = "Other options"
Values = dict[str, Any]
_ALWAYS = (ExitStatus.FAILED, ExitStatus.USAGE, ExitStatus.INTERRUPTED)
_OF_FRAMES = {each: each.meaning for each in (ExitStatus.DONE, ExitStatus.FRAMES_FAILED)}


class Option(click.Option):
    """An option that is listed under a heading; the last heading by default.

    `without_word` is its value where none of its words follows: click would take an input for its value.
    """

    def __init__(
        self, *args: Any, section: str = OTHER, without_word: str | None = None, **attributes: Any
    ) -> None:
        super().__init__(*args, **attributes)
        self.section, self.without_word = section, without_word

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

    Parameters
    ----------
    examples : sequence of (str, str)
        A purpose, and the command line for it; several lines are steps.
    statuses : mapping of ExitStatus to str
        How it ends, where this is not how frames are worked through; wrong usage and so on are added.
    """

    def __init__(
        self,
        *args: Any,
        examples: Sequence[tuple[str, str]] = (),
        statuses: Mapping[ExitStatus, str] | None = None,
        **attributes: Any,
    ) -> None:
        super().__init__(*args, **attributes)
        self.examples = tuple(examples)
        own = _OF_FRAMES if statuses is None else statuses
        meant = {**{each: each.meaning for each in _ALWAYS}, **own}
        self.statuses = {each: meant[each] for each in sorted(meant)}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words, with the values that options have by themselves."""
        for param in self.get_params(ctx):
            args = param.completed(args) if isinstance(param, Option) else args
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one thread of linear algebra, once mistaken variables have been told.

        Its matrices are small: threads spend ten times as long waiting for each other as working.
        """
        from rollcli.run.workers.pool import limit_blas_threads

        limit_blas_threads()
        if ctx.params.get("verbose"):
            show_tracebacks()
        if not ctx.params.get("quiet"):
            tell_mistaken_variables(ctx)
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


class Declared:
    """A function on its way to be a command: its parameters, and how their values are gathered for it."""

    def __init__(
        self,
        function: Callable[..., Any],
        params: tuple[click.Parameter, ...] = (),
        gather: tuple[Callable[[Values], None], ...] = (),
    ) -> None:
        self.function, self.params, self.gather = function, params, gather

    def __call__(self, **values: Any) -> Any:
        """Call the function with the values that click has parsed."""
        for gather in self.gather:
            gather(values)
        return self.function(**values)


class Declaration:
    """A decorator that declares parameters of a command.

    Parameters
    ----------
    make : callable
        Makes the parameters: each command has its own.
    gather : callable or None
        Replaces their values by one record.
    """

    def __init__(
        self, make: Callable[[], list[click.Parameter]], gather: Callable[[Values], None] | None = None
    ) -> None:
        self.make, self.gather = make, gather

    def __call__(self, function: Callable[..., Any]) -> Declared:
        """Declare the parameters before those that are declared below."""
        inner = function if isinstance(function, Declared) else Declared(function)
        gather = (self.gather,) if self.gather is not None else ()
        return Declared(inner.function, (*self.make(), *inner.params), (*gather, *inner.gather))


def option(*names: str, **attributes: Any) -> Declaration:
    """Declare an option; takes what `click.Option` takes, and the `section` of the help."""
    return Declaration(lambda: [Option(names, **attributes)])


def argument(*names: str, **attributes: Any) -> Declaration:
    """Declare an argument; takes what `click.Argument` takes."""
    return Declaration(lambda: [click.Argument(names, **attributes)])


def record(name: str, title: str, make: Callable[..., Any], *declarations: Declaration) -> Declaration:
    """Declare options that the command receives as one record.

    Parameters
    ----------
    name : str
        The command's parameter that receives the record.
    title : str
        The heading in the help.
    make : callable
        Makes the record of the values, which it takes by the options' names.
    *declarations
        What `option` and `argument` return.
    """

    def params() -> list[click.Parameter]:
        made = [param for declaration in declarations for param in declaration.make()]
        for param in made:
            if isinstance(param, Option):
                param.section = title
        return made

    def gather(values: Values) -> None:
        names = [str(param.name) for param in params()]  # here: --help needs none
        values[name] = make(**{each: values.pop(each) for each in names})

    return Declaration(params, gather)


def command(
    examples: Sequence[tuple[str, str]] = (),
    short_help: str | None = None,
    statuses: Mapping[ExitStatus, str] | None = None,
) -> Callable[[Declared], Command]:
    """Make a command of a function, named after it; its docstring is the help."""

    def make(declared: Declared) -> Command:
        function = declared.function
        return Command(
            function.__name__,
            callback=declared,
            params=list(declared.params),
            help=function.__doc__,
            short_help=short_help,
            examples=examples,
            statuses=statuses,
        )

    return make


def tell_idle(
    ctx: click.Context,
    idle: Iterable[tuple[Sequence[str], str]],
    repeated: Sequence[str] = (),
    *,
    quiet: bool,
) -> None:
    """Say which options of the command line have no effect on this run.

    Those of the environment and of --config are not told: they are there for many commands and runs.

    Parameters
    ----------
    ctx : click.Context
    idle : iterable of (names, reason)
        Parameters that have no effect, and why.
    repeated : sequence of str
        Inputs that are named more than once.
    quiet : bool
        Whether nothing is said.
    """
    if quiet:
        return
    for name in repeated:
        say(f"{name}: is named more than once; each of its files is taken once")
    for names, reason in idle:
        typed = [name for name in names if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE]
        if typed:
            flags = ", ".join(f"--{name.replace('_', '-')}" for name in typed)
            say(f"{flags}: no effect here: {reason}")

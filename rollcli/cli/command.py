"""Commands whose help is in sections, and options that know theirs."""

from collections.abc import Callable, Sequence
from functools import partial, wraps
from typing import Any, TypeVar

import click

OTHER = "Other options"
EXIT_STATUS = (
    ("0", "every frame is done, suspect ones included"),
    ("1", "the program could not do its job: an output cannot be written, the disk is full"),
    ("2", "wrong usage, or no input found"),
    ("3", "finished, and at least one frame failed; each says why"),
    ("130", "interrupted"),
)

Function = TypeVar("Function", bound=Callable[..., Any])


class Option(click.Option):
    """An option that is listed under a heading; the last heading by default."""

    def __init__(self, *args: Any, section: str = OTHER, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.section = section


class Command(click.Command):
    """A command whose help reads like a manual page: options by section, examples, exit status.

    Parameters
    ----------
    examples : sequence of (str, str)
        What for, and the command line; several lines are steps.
    """

    def __init__(self, *args: Any, examples: Sequence[tuple[str, str]] = (), **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.examples = tuple(examples)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if isinstance(param, click.Option) and record is not None:
                sections.setdefault(getattr(param, "section", OTHER), []).append(record)
        for title in sorted(sections, key=lambda title: title == OTHER):
            with formatter.section(title):
                formatter.write_dl(sections[title])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if self.examples:
            with formatter.section("Examples"):
                for purpose, steps in self.examples:
                    for line in (f"# {purpose}", *steps.splitlines()):
                        formatter.write(f"{'':>{formatter.current_indent}}{line}\n")
        with formatter.section("Environment"):
            formatter.write_text(
                f"Each option also reads {ctx.auto_envvar_prefix}_<OPTION>; flags win over it."
            )
        with formatter.section("Exit status"):
            formatter.write_dl(EXIT_STATUS)


command = partial(click.command, cls=Command)
option = partial(click.option, cls=Option)


def record(
    name: str, title: str, make: Callable[..., Any], *declarations: Callable[[Function], Function]
) -> Callable[[Function], Function]:
    """A decorator that declares options and hands the command one record of them.

    Parameters
    ----------
    name : str
        The command's parameter that receives the record.
    title : str
        The heading in the help.
    make : callable
        Takes the values by the options' names, gives the record.
    *declarations
        What `option` and `click.argument` return.
    """

    def decorate(function: Function) -> Function:
        def blank() -> None: ...

        for declare in reversed(declarations):
            declare(blank)
        declared: list[click.Parameter] = blank.__click_params__  # type: ignore[attr-defined]
        for param in declared:
            param.section = title  # type: ignore[attr-defined]

        @wraps(function)
        def collecting(*args: Any, **values: Any) -> Any:
            values[name] = make(**{str(p.name): values.pop(str(p.name)) for p in declared})
            return function(*args, **values)

        # click lists the last decorator first and turns the list round
        collecting.__click_params__ = [*getattr(function, "__click_params__", []), *declared]  # type: ignore[attr-defined]
        return collecting  # type: ignore[return-value]

    return decorate

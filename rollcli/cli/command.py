"""Commands whose help is in sections, and options that know theirs."""

from collections.abc import Callable
from functools import partial, wraps
from typing import Any, TypeVar

import click

Function = TypeVar("Function", bound=Callable[..., Any])


class Option(click.Option):
    """An option that is listed under a heading of its own."""

    section = "Other options"


class Command(click.Command):
    """A command that lists its options by section, in the order in which they were declared."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if isinstance(param, click.Option) and record is not None:
                sections.setdefault(getattr(param, "section", Option.section), []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records)


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

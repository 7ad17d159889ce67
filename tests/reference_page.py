"""Write rollcli/REFERENCE.md from the docstrings of every public name: python -m tests.reference_page

What stands before the functions stays as it is.
"""

import inspect
import re
import textwrap
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

import rollcli
from rollcli.files.atomic import write_atomic

PAGE = Path(rollcli.__file__).with_name("REFERENCE.md")
_SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", flags=re.M)
_TERM = re.compile(r"^(\S.*?) : (.*)$")


def page() -> str:
    """Return the whole page."""
    names = [name for name in rollcli.__all__ if not name.startswith("_")]
    groups: dict[str, list[str]] = {"Functions": [], "Options and results": [], "Errors": []}
    for name in names:
        subject = getattr(rollcli, name)
        of_error = inspect.isclass(subject) and issubclass(subject, Exception)
        title = (
            "Functions" if inspect.isfunction(subject) else "Errors" if of_error else "Options and results"
        )
        groups[title].append(name)
    parts = [PAGE.read_text("utf-8").partition("\n## ")[0]]
    for title, members in groups.items():
        parts.append(f"## {title}\n")
        parts += [part for name in members for part in _entry(name, getattr(rollcli, name))]
    return "\n".join(parts)


def _entry(name: str, subject: object) -> Iterator[str]:
    yield f"### {name}\n"
    if inspect.isfunction(subject):
        yield f"```python\n{_call(name, subject)}\n```\n"
    yield _markdown(inspect.getdoc(subject) or "")
    for member, each in vars(subject).items() if inspect.isclass(subject) else ():
        called = inspect.isfunction(plain := inspect.unwrap(getattr(each, "__func__", each)))
        if not member.startswith("_") and (called or isinstance(each, property | cached_property)):
            given = f"({', '.join([*inspect.signature(plain).parameters][1:])})" if called else ""
            yield f"#### {name}.{member}{given}\n\n{_markdown(inspect.getdoc(each) or '')}"


def _call(name: str, function: object) -> str:
    """How a function is called, a parameter a line: numbers as they are, types in the list below."""
    signature = inspect.signature(function)  # type: ignore[arg-type]
    lines: list[str] = []
    for each in signature.parameters.values():
        if each.kind is each.KEYWORD_ONLY and "*" not in lines:
            lines.append("*")
        star = "*" if each.kind is each.VAR_POSITIONAL else ""
        default = "" if each.default is each.empty else f"={_value(each.default)}"
        lines.append(f"{star}{each.name}{default}")
    return textwrap.fill(f"{name}({', '.join(lines)})", 100, subsequent_indent="    ")


def _value(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else repr(value)


def _markdown(docstring: str) -> str:
    """Turn numpydoc into Markdown: terms are items, examples a block of Python."""
    first, *rest = _SECTION.split(docstring)
    parts = [first.strip()]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        parts.append(f"**{title}**\n\n{_section(title, body.strip())}")
    return "\n\n".join(parts) + "\n"


def _section(title: str, body: str) -> str:
    if title == "Examples":
        return _examples(body)
    if title == "Notes":
        return body
    items: list[str] = []
    for line in body.split("\n"):
        if line and not line.startswith(" "):
            term = _TERM.match(line)
            items.append(f"- `{term[1]}` ({term[2]})" if term else f"- {line}")
        elif line.strip():
            items.append(f"  {line.strip()}")
    return "\n".join(items)


def _examples(body: str) -> str:
    """Prose stays prose, and sessions become blocks."""
    pieces = []
    for paragraph in re.split(r"\n\s*\n", body):
        pieces.append(f"```python\n{paragraph}\n```" if paragraph.startswith(">>>") else paragraph)
    return "\n\n".join(pieces)


if __name__ == "__main__":
    write_atomic(PAGE, page().encode())

"""A reader of plain YAML: mappings, sequences and scalars, as calibration files have them.

Calibration files of ROS, Kalibr, ORB-SLAM and OpenCV use a small part of YAML. This reader knows that part
alone: it has no anchors, builds no objects from tags and converts no numbers, so a hostile file can neither
run code nor take more memory than its own size. A library would add a dependency for the parts that are
unwanted here, and refuses the ``%YAML:1.0`` line of OpenCV.
"""

import re
from typing import NamedTuple, Union

from rollcli.errors import InputError

Value = Union[str, list["Value"], dict[str, "Value"]]  # noqa: UP007 - the alias names itself

_MAX_DEPTH = 16  # calibration files nest three levels deep
_MATRIX_TAG = "!!opencv-matrix"
_NO_KEY = re.compile(r"""[\[\]{},"'#&*!|>%@`]""")
_FLOW = re.compile(
    r"""\s*("[^"]*"|'[^']*'|[\[\]{},]|:(?=[\s\[{]|$)|(?:[^\s\[\]{},:]|:(?=[^\s\[{])|\s(?=[^\s\[\]{},:]))+)"""
)
_BRACKET = re.compile(r"[\[\]{}]")
_COMMENT = re.compile(r"""(?:^|(?<=\s))#.*""")


class _Line(NamedTuple):
    """A line without its comment; one that opens a bracket goes on to where it is closed."""

    number: int
    indent: int
    text: str


def parse_yaml(text: str, name: str) -> dict[str, Value]:
    """Read a document whose top level is a mapping.

    Parameters
    ----------
    text : str
        One document; numbers stay the text they are.
    name : str
        What errors call the file.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        The document uses what plain YAML files do not have; the line is named.
    """
    lines = _lines(text, name)
    if not lines:
        raise InputError(f"{name}: holds no value")
    value, rest = _block(lines, 0, name, 0)
    if rest < len(lines) or not isinstance(value, dict):
        raise _unreadable(name, lines[min(rest, len(lines) - 1)].number)
    return value


def _unreadable(name: str, number: int, why: str = "is not plain YAML") -> InputError:
    return InputError(f"{name}: line {number} {why}")


def _lines(text: str, name: str) -> list[_Line]:
    """Return the lines with content."""
    found: list[_Line] = []
    parts: list[str] = []  # of a line whose brackets are still open
    begun = depth = 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = _without_comment(raw).rstrip()
        if depth == 0 and (line.startswith("%") or line in ("", "---")):
            continue
        if depth == 0 and line == "...":
            break
        if depth == 0:
            begun, parts = number, []
            if "\t" in line[: len(line) - len(line.lstrip())]:
                raise _unreadable(name, number, "is indented by a tab")
        parts.append(line)
        for bracket in _BRACKET.findall(line):
            depth += 1 if bracket in "[{" else -1
            if depth > _MAX_DEPTH:
                raise _unreadable(name, number, "nests deeper than a calibration does")
            if depth < 0:
                raise _unreadable(name, number, "closes a bracket that is not open")
        if depth == 0:
            first = parts[0]
            indent = len(first) - len(first.lstrip())
            found.append(_Line(begun, indent, " ".join(" ".join(parts).split())))
    if depth:
        raise _unreadable(name, begun, "opens a bracket that is never closed: the file is cut off")
    return found


def _without_comment(line: str) -> str:
    # a number sign inside of quotes is rare enough in a calibration to be left to the error of the quote
    return _COMMENT.sub("", line, count=1) if "#" in line else line


def _block(lines: list[_Line], at: int, name: str, depth: int) -> tuple[Value, int]:
    """Read the mapping or sequence that begins at a line; return it and the line after it."""
    if depth > _MAX_DEPTH:
        raise _unreadable(name, lines[at].number, "nests deeper than a calibration does")
    if lines[at].text == "-" or lines[at].text.startswith("- "):
        return _sequence(lines, at, name, depth)
    return _mapping(lines, at, name, depth)


def _mapping(lines: list[_Line], at: int, name: str, depth: int) -> tuple[dict[str, Value], int]:
    values: dict[str, Value] = {}
    indent = lines[at].indent
    while at < len(lines) and lines[at].indent == indent:
        line = lines[at]
        split = _split_key(line.text)
        if split is None:
            raise _unreadable(name, line.number)
        key, text = split
        if key in values:
            raise _unreadable(name, line.number, f"gives {key} a second time")
        text = text.removeprefix(_MATRIX_TAG).strip()
        at += 1
        if text:
            values[key] = _scalar_or_flow(text, name, line.number)
        elif at < len(lines) and (
            lines[at].indent > indent or (lines[at].indent == indent and lines[at].text.startswith("-"))
        ):
            values[key], at = _block(lines, at, name, depth + 1)
        else:
            values[key] = ""
    if at < len(lines) and lines[at].indent > indent:
        raise _unreadable(name, lines[at].number)
    return values, at


def _split_key(text: str) -> tuple[str, str] | None:
    """Return key and value of a line of a mapping, or None where it is no such line."""
    key, colon, value = text.partition(": ")
    if not colon:
        key, colon, value = text.partition(":")  # a key at the end of its line, or OpenCV's `key:value`
    key = key.strip().strip("\"'")
    return (key, value.strip()) if colon and key and not _NO_KEY.search(key) else None


def _sequence(lines: list[_Line], at: int, name: str, depth: int) -> tuple[list[Value], int]:
    values: list[Value] = []
    indent = lines[at].indent
    while at < len(lines) and lines[at].indent == indent and lines[at].text.startswith("-"):
        line = lines[at]
        text = line.text[1:].lstrip()
        if not text:
            raise _unreadable(name, line.number)
        if text.startswith("- ") or (_split_key(text) and text[0] not in "[{"):
            # what follows the dash is a block of its own, indented to where it stands
            lines[at] = _Line(line.number, indent + len(line.text) - len(text), text)
            value, at = _block(lines, at, name, depth + 1)
        else:
            value, at = _scalar_or_flow(text, name, line.number), at + 1
        values.append(value)
    return values, at


def _scalar_or_flow(text: str, name: str, number: int) -> Value:
    if text[0] in "[{":
        tokens = _FLOW.findall(text)
        value, rest = _flow(tokens, 0, name, number)
        if rest != len(tokens):
            raise _unreadable(name, number)
        return value
    if text[0] in "&*!|>@`":
        raise _unreadable(name, number, f"begins with {text[0]}, which calibration files have no use for")
    return text.strip("\"'")


def _flow(tokens: list[str], at: int, name: str, number: int) -> tuple[Value, int]:
    """Read one value in brackets; how deep they nest is checked before."""
    token = tokens[at]
    if token == "[":
        items: list[Value] = []
        at += 1
        while tokens[at] != "]":
            item, at = _flow(tokens, at, name, number)
            items.append(item)
            at = _after_comma(tokens, at, "]", name, number)
        return items, at + 1
    if token == "{":
        values: dict[str, Value] = {}
        at += 1
        while tokens[at] != "}":
            key = tokens[at].strip("\"'")
            if at + 1 >= len(tokens) or tokens[at + 1] != ":" or key in values:
                raise _unreadable(name, number)
            values[key], at = _flow(tokens, at + 2, name, number)
            at = _after_comma(tokens, at, "}", name, number)
        return values, at + 1
    if token in "]},:" or token[0] in "&*!":
        raise _unreadable(name, number)
    return token.strip().strip("\"'"), at + 1


def _after_comma(tokens: list[str], at: int, close: str, name: str, number: int) -> int:
    if at < len(tokens) and tokens[at] == ",":
        at += 1
    elif at >= len(tokens) or tokens[at] != close:
        raise _unreadable(name, number)
    if at >= len(tokens):
        raise _unreadable(name, number)
    return at

"""The YAML of calibration files, parsed by PyYAML: mappings, sequences, and scalars that stay text.

ROS, Kalibr, ORB-SLAM and OpenCV write it. What they have no use for is refused as soon as the parser meets
it: aliases, which can make a few lines fill the memory, and tags, which name objects.
"""

import re
from typing import Union

from rollcli.errors import InputError

Value = Union[str, list["Value"], dict[str, "Value"]]  # noqa: UP007 - the alias names itself

_MAX_DEPTH = 16  # calibration files nest three levels deep
_MAX_EVENTS = 30_000  # a matrix has 16 numbers; PyYAML parses so many in a second
_MATRIX = "tag:yaml.org,2002:opencv-"
# OpenCV's first line is no directive of YAML, and its files may lack the space after a key's colon
_DIRECTIVE = re.compile(r"^%YAML.*", re.MULTILINE)
_TIGHT_KEY = re.compile(r"^( *[\w.]+):(?=\S)", re.MULTILINE)


def parse_yaml(text: str, name: str) -> dict[str, Value]:
    """Read a document whose top level is a mapping.

    Parameters
    ----------
    text : str
        What follows the end of its first document is left alone; numbers stay the text they are.
    name : str
        What errors call the file.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        The text is no YAML, or has what calibration files have no use for; the line is named.
    """
    import yaml  # takes 25 ms, and most calibrations are no YAML

    if "%YAML:" in text:
        text = _TIGHT_KEY.sub(r"\1: ", text)
    text = _without_inner_tabs(_DIRECTIVE.sub("", text, count=1))
    parents: list[list[Value]] = []
    values: list[Value] = []
    try:
        for count, event in enumerate(yaml.parse(text, Loader=yaml.BaseLoader)):
            line = event.start_mark.line + 1 if event.start_mark else 1
            if count > _MAX_EVENTS:
                raise _unreadable(name, line, "has more values before it than a calibration has")
            if isinstance(event, yaml.DocumentEndEvent):
                break
            if isinstance(event, yaml.NodeEvent):
                tag = getattr(event, "tag", None)
                what = f"anchor or alias {event.anchor}" if event.anchor is not None else f"tag {tag}"
                if event.anchor is not None or (tag is not None and not tag.startswith(_MATRIX)):
                    raise _unreadable(name, line, f"has the {what}, which calibrations have no use for")
            if isinstance(event, yaml.ScalarEvent):
                values.append(event.value)
            elif isinstance(event, yaml.CollectionStartEvent):
                parents.append(values)
                values = []
                if len(parents) > _MAX_DEPTH + 1:
                    raise _unreadable(name, line, "nests deeper than a calibration does")
            elif isinstance(event, yaml.MappingEndEvent):
                parents[-1].append(_mapping(name, line, values))
                values = parents.pop()
            elif isinstance(event, yaml.SequenceEndEvent):
                parents[-1].append(values)
                values = parents.pop()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        why = " ".join(filter(None, (error.context, error.problem)))
        why += ": the file is cut off" if "<stream end>" in why or "end of stream" in why else ""
        raise _unreadable(name, mark.line + 1 if mark else 1, f"is no YAML: {why}") from error
    except yaml.YAMLError as error:
        raise InputError(f"{name}: is no YAML: {' '.join(str(error).split())}") from error
    if not values or not isinstance(values[0], dict):
        raise InputError(f"{name}: holds no value that has a name")
    return values[0]


def _without_inner_tabs(text: str) -> str:
    """Put spaces where PyYAML refuses tabs and other readers do not: anywhere but in the indentation."""
    if "\t" not in text:
        return text
    lines = (line.rstrip() for line in text.splitlines())
    return "\n".join(
        line[: len(line) - len(line.lstrip())] + line.lstrip().replace("\t", " ") for line in lines
    )


def _mapping(name: str, line: int, flat: list[Value]) -> dict[str, Value]:
    """Return the mapping whose keys and values were listed in turn."""
    found: dict[str, Value] = {}
    for key, value in zip(flat[::2], flat[1::2], strict=True):
        if not isinstance(key, str):
            raise _unreadable(name, line, "ends a mapping with a key that is no text")
        if key in found:
            raise _unreadable(name, line, f"ends a mapping that gives {key} a second time")
        found[key] = value
    return found


def _unreadable(name: str, line: int, why: str) -> InputError:
    return InputError(f"{name}: line {line} {why}")

"""The YAML of calibration files, parsed by PyYAML: mappings, sequences, and scalars that stay text.

ROS, Kalibr, ORB-SLAM and OpenCV write it. What they have no use for is refused as soon as the parser meets
it: anchors and aliases, which can make a few lines fill the memory, and tags, which name objects.
"""

import re
from typing import Any, Union

from rollcli.errors import InputError

Value = Union[str, list["Value"], dict[str, "Value"]]  # noqa: UP007 - the alias names itself

_MOST = 1 << 17  # characters, which PyYAML parses in a second; real calibrations have a few thousand
_MATRIX = "tag:yaml.org,2002:opencv-"
# OpenCV's first line is no directive of YAML, and its files may lack the space after a key's colon
_DIRECTIVE = re.compile(r"^%YAML.*", re.MULTILINE)
_TIGHT_KEY = re.compile(r"^( *[\w.]+):(?=\S)", re.MULTILINE)
# PyYAML refuses tabs where other readers do not: anywhere but in the indentation
_INNER_TABS = re.compile(r"(?<=\S)[ \t]*\t[ \t]*|^[ \t]+$", re.MULTILINE)


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
    if len(text) > _MOST:
        raise InputError(f"{name}: has {len(text)} characters; no calibration in YAML has more than {_MOST}")
    import yaml  # takes 25 ms, and most calibrations are no YAML

    class Loader(yaml.BaseLoader):
        """Build text, lists and mappings, but nothing that an anchor, an alias or a tag asks for."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            event = self.peek_event()  # type: ignore[no-untyped-call]
            tag = getattr(event, "tag", None)
            if event.anchor is not None or not (tag or _MATRIX).startswith(_MATRIX):
                what = f"tag {tag}" if event.anchor is None else f"anchor or alias {event.anchor}"
                raise _unreadable(name, event, f"has the {what}, which calibrations have no use for")
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            found = super().construct_mapping(node, deep)
            seen = set[str]()
            for key, _ in node.value:
                if key.value in seen:
                    raise _unreadable(name, key, f"gives {key.value} a second time")
                seen.add(key.value)
            return found

    if "%YAML:" in text:
        text = _TIGHT_KEY.sub(r"\1: ", text)
    text = _INNER_TABS.sub(" ", _DIRECTIVE.sub("", text, count=1))
    try:
        values = Loader(text).get_data()
    except yaml.MarkedYAMLError as error:
        why = " ".join(filter(None, (error.context, error.problem)))
        why += ": the file is cut off" if "<stream end>" in why or "end of stream" in why else ""
        mark = error.problem_mark or error.context_mark
        raise InputError(f"{name}: line {mark.line + 1 if mark else 1} is no YAML: {why}") from error
    except yaml.YAMLError as error:
        raise InputError(f"{name}: is no YAML: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise InputError(f"{name}: nests deeper than a calibration does") from error
    if not isinstance(values, dict):
        raise InputError(f"{name}: holds no value that has a name")
    return values


def _unreadable(name: str, place: Any, why: str) -> InputError:
    return InputError(f"{name}: line {place.start_mark.line + 1} {why}")

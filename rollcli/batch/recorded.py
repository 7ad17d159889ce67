"""The options of a run, read back from its record: what `record.py` writes, the other way round."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

from rollcli.batch.run_record import OPTION_NAMES
from rollcli.errors import InputError
from rollcli.frames.options import EncodingOptions, FrameOptions, ImageOptions
from rollcli.imaging.stereo_options import StereoOptions

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_NUMBERS = ("scale", "num_disparities", "vertical_offset")  # options that are none by default
Options = TypeVar("Options", bound="DataclassInstance")


def recorded_options(run: Mapping[str, Any] | None, name: str) -> FrameOptions:
    """How the run read, matched and wrote its frames; the defaults where there is no record.

    Parameters
    ----------
    run : mapping or None
        The content of FILE.run.json.
    name : str
        What errors call it.

    Raises
    ------
    InputError
        It is not what a run has recorded.
    """
    given = (run or {}).get("options", {})
    if not isinstance(given, Mapping):
        raise InputError(f"{name}: is not the record of a run: its options are no table")
    try:
        return FrameOptions(
            encoding=_filled(EncodingOptions(), given),
            stereo=_filled(StereoOptions(), given),
            images=_filled(ImageOptions(), given),
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: is not the record of a run: {error}") from error


def _filled(defaults: Options, given: Mapping[str, Any]) -> Options:
    """The defaults, but for what is given."""
    values = {}
    for field in fields(defaults):
        key = OPTION_NAMES.get(field.name, field.name).replace("_", "-")
        before = getattr(defaults, field.name)
        value: Any = given.get(key, before)
        if isinstance(before, tuple) and isinstance(value, list):
            value = tuple(map(float, value))
        if not isinstance(value, _kinds(field.name, before)) or isinstance(value, bool):
            raise TypeError(f"{key} is {value!r}")
        values[field.name] = value
    return type(defaults)(**values)


def _kinds(name: str, default: Any) -> tuple[type, ...]:
    """What JSON may hold for an option."""
    if default is None:
        return (type(None), int, float) if name in _NUMBERS else (type(None), str)
    return {int: (int,), float: (int, float), tuple: (tuple,)}.get(type(default), (str,))

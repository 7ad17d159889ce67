"""Plan a simulation: which frames, into which folder, and which of them an interrupted one has left."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rollcli import __version__
from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import output_error
from rollcli.files.results import read_run, run_path
from rollcli.files.resumable import differences, not_resumable
from rollcli.simulate.dataset import TRUTH, Dataset
from rollcli.simulate.draw import draw_specs
from rollcli.simulate.options import CROSSFALL, KERB, KERBED, MIXED, SimulateOptions


def plan_dataset(folder: str | Path, options: SimulateOptions, *, overwrite: bool = False) -> Dataset:
    """Draw the frames, and check that they can be written.

    Parameters
    ----------
    folder : str or Path
        Where to write; made if it does not exist.
    options : SimulateOptions
        What to render.
    overwrite : bool
        Whether to begin anew in a folder with files in it.

    Raises
    ------
    UsageError
        Options contradict each other, or the folder has files in it that may not be replaced or continued.
    """
    if options.resume and overwrite:
        raise UsageError("give either --resume or --overwrite")
    _refuse_idle(options)
    specs = draw_specs(
        options.frames,
        scene=options.scene,
        roll=_radians(options.roll_deg),
        pitch=_radians(options.pitch_deg),
        curvature=options.curvature,
        bend=options.bend,
        cross_section=options.cross_section,
        crossfall=_shares(options.crossfall or CROSSFALL),
        gutter=_shares(options.gutter),
        kerb=options.kerb or KERB,
        size=options.size,
        focal=options.focal,
        baseline=options.baseline,
        height=options.height,
        principal_point=options.principal_point,
        principal_offset=options.principal_offset,
        noise=options.noise,
        gain=options.gain,
        colour=not options.grey,
        seed=options.seed,
    )
    dataset = Dataset(Path(folder), tuple(specs), _record(options))
    if _is_free(Path(folder)) or overwrite:
        return dataset
    if not options.resume:
        raise UsageError(
            f"{folder}: there are files in it; --resume continues an interrupted simulation, "
            "--overwrite begins anew"
        )
    _check_resumable(dataset)
    whole = (task.stem for task in dataset.tasks if all(path.exists() for path in task.images()))
    return replace(dataset, kept=frozenset(whole))


def _refuse_idle(options: SimulateOptions) -> None:
    """Refuse options that change nothing in the frames that are asked for."""
    if options.crossfall is not None and options.cross_section == "flat":
        raise UsageError("--crossfall: a flat road has none; choose another --cross-section")
    if options.kerb is not None and options.scene not in (*KERBED, MIXED):
        raise UsageError(f"--kerb: the scene {options.scene} has no kerbs; {' and '.join(KERBED)} have")


def _is_free(folder: Path) -> bool:
    """Tell whether the folder is empty or does not exist."""
    try:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"{folder}: is a file, not a folder to write to")
        return not folder.is_dir() or not any(folder.iterdir())
    except OSError as error:
        raise output_error(folder, error) from error


def _record(options: SimulateOptions) -> Mapping[str, Any]:
    """Collect what decides the bytes of the frames: the version, and the options by their names."""
    values = {key.removesuffix("_deg").replace("_", "-"): value for key, value in asdict(options).items()}
    del values["resume"]
    return {"rollcli": __version__, "options": values}


def _check_resumable(dataset: Dataset) -> None:
    """Refuse to continue a folder of another version, of other options or without a record.

    Raises
    ------
    UsageError
        Says what differs.
    """
    name, record = str(dataset.folder), run_path(TRUTH)
    try:
        was = read_run(dataset.folder / TRUTH)
    except InputError as error:
        raise not_resumable(name, f"{record} is damaged") from error
    if was is None:
        raise not_resumable(name, f"there is no {record}")
    if not isinstance(was.get("rollcli"), str) or not isinstance(was.get("options"), dict):
        raise not_resumable(name, f"{record} is damaged")
    for difference in differences(was, dataset.record or {}):
        raise not_resumable(name, difference)


def _shares(percent: Sequence[float]) -> tuple[float, float]:
    return percent[0] / 100, percent[1] / 100


def _radians(span: Sequence[float]) -> tuple[float, float]:
    return math.radians(span[0]), math.radians(span[1])

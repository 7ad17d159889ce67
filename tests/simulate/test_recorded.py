"""What frames of every kind look like, to the grey level and the millimetre; see `tests.recorded`."""

import math
from dataclasses import replace
from functools import partial

from rollcli.simulate.build import build_scene, carriageway_of, draw_dips, render_frame, road_camber
from rollcli.simulate.dataset import calibration, lane_rolls_of, truth_csv
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from rollcli.simulate.views import render_view
from tests.recorded import made, recorded_test

SMALL = {"size": (96, 72), "focal": 60.0}
_frame = partial(FrameSpec, **SMALL)
FRAMES = {
    "bare": _frame("bare", math.radians(-6), 0.03, seed=1),
    "bare sag": _frame("bare", 0.05, 0.02, curvature=0.002, seed=2, colour=False),
    "open": _frame("open", math.radians(4), 0.05, seed=3),
    "open crest": _frame("open", -0.1, 0.08, curvature=-0.0008, bend=-0.003, seed=4),
    "street": _frame("street", 0.08, 0.0, seed=5, gain=1.2),
    "street to the right": _frame("street", -0.02, 0.04, bend=0.006, seed=6, height=1.2, noise=0.0),
    "street of another seed": _frame("street", 0.0, 0.1, seed=17, index=3, baseline=0.2),
    "verge": _frame("verge", 0.03, 0.06, seed=7),
    "verge to the left": _frame("verge", -0.12, 0.02, bend=-0.008, curvature=0.0005, seed=8, index=2),
    "crown": _frame("street", 0.02, 0.1, cross_section="crown", crossfall=0.03, gutter=0.04, seed=9, dips=2),
    "roof": _frame("open", 0.0, 0.1, cross_section="roof", crossfall=0.025, roughness="C", seed=10, dips=5),
    "dish": _frame(
        "verge", -0.04, 0.1, cross_section="dish", crossfall=0.04, roughness="E", seed=11, dips=12
    ),
    "superelevated": _frame(
        "open", 0.04, 0.12, cross_section="superelevated", crossfall=0.03, bend=0.005, seed=12, dips=0
    ),
    "rough and bare": _frame("bare", 0.0, 0.15, roughness="A", dips=4, seed=13),
    "high kerbs": _frame("street", 0.0, 0.2, kerb=(0.25, 0.3), height=2.5, seed=14, roughness="D"),
    "off the centre": _frame("open", 0.3, -0.05, principal_point=(40.0, 30.5), seed=15),
    "looking down": _frame("street", -0.5, 0.6, seed=16),
    "upright": _frame("street", math.pi / 2, 0.1, seed=18),
    "bare, dark on the right": _frame("bare", 0.0, 0.1, seed=19, gain=1e-4),
}


def _rendered(spec):
    frame, scene = render_frame(spec), build_scene(spec)
    carriageway = carriageway_of(spec)
    view = render_view(scene, spec.cameras(scene.normal)[1])
    return {
        "left": frame.left,
        "right": frame.right,
        "disparity": frame.disparity,
        "road": frame.road,
        "heights": frame.heights,
        "light": view.light,
        "materials": view.material,
        "camber": road_camber(spec),
        "lanes": lane_rolls_of(spec),
        "edges": [carriageway.left, carriageway.right],
        "dips": draw_dips(spec, carriageway) if spec.dips else None,
    }


def _table(**options):
    """The true values of frames that are drawn, and the calibration of the last."""
    specs = made(draw_specs, SimulateOptions(frames=6, size=(96, 72), seed=3, **options))
    if isinstance(specs, str):
        return specs
    names = [f"frame{place}" for place in range(len(specs))]
    return [truth_csv(zip(names, specs, strict=True)).decode(), calibration(specs[-1]).decode()]


# at the edges of the image and hardly beyond them
POINTS = ((0.0, 0.0), (95.0, 71.0), (95.1, 3.0), (3.0, 71.1), (-0.1, 3.0), (3.0, -0.1))


def _possible(**values):
    found = made(replace, FrameSpec(**SMALL, height=3.0), **values)
    return found if isinstance(found, str) else "is possible"


CASES = {
    **{name: partial(_rendered, spec) for name, spec in FRAMES.items()},
    "drawn": _table,
    "drawn of a scene": partial(_table, scene="bare", grey=True, principal_offset=(-5.0, 5.0)),
    "drawn with sections": partial(
        _table,
        scene="verge",
        cross_section="mixed",
        crossfall=(2.0, 3.0),
        gutter=(0.0, 4.0),
        bend=(-0.01, 0.01),
        curvature=(-0.002, 0.002),
        height=(1.2, 1.9),
        roughness="B",
    ),
    "drawn with kerbs": partial(_table, scene="street", kerb=(0.0, 0.2), roll_deg=(3.0, 3.0), focal=80.0),
    "drawn beyond": partial(_table, principal_offset=(-60.0, 0.0)),
    "drawn beside": partial(_table, principal_point=(50.0, 30.0), principal_offset=(5.0, 5.0)),
    "drawn bent": partial(_table, curvature=(0.001, 0.002), bend=(0.002, 0.005), cross_section="mixed"),
    "drawn beyond too": lambda: [
        _table(**options)
        for options in ({"height": (0.3, 0.3), "roll_deg": (-57.0, 57.0)}, {"principal_offset": (0.0, 400.0)})
    ],
    "possible": lambda: [
        *(_possible(principal_point=point) for point in POINTS),
        _possible(roll=-1.2, height=0.5),
        _possible(roll=-1.2, pitch=0.5, height=0.4),
    ],
}

test_answers_are_those_recorded = recorded_test("simulate", CASES, rel=2e-5, least=2e-5)

"""Dips and bumps in the carriageway, and how high what a camera sees lies over the road without them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Camera, PixelRays
from rollcli.simulate.relief import LEVEL, Dip
from rollcli.simulate.road import Carriageway, CrossSection, cross_section
from rollcli.simulate.scene import Scene, draw
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Course, Ground, Surface
from rollcli.simulate.views import bands, first_hits

_DEPTH = (0.025, 0.07)  # metres, of dips as of bumps
_RADIUS = (0.25, 0.5)  # metres
_AHEAD = (4.5, 12.0)  # metres
_TRIES = 50  # for a place beside those that are there


def draw_dips(spec: FrameSpec, carriageway: Carriageway) -> tuple[Dip, ...]:
    """Draw the dips and bumps of a frame: apart from each other, and each within one piece of the road.

    Those for which there is no room are left out.
    """
    rng = spec.rng(Stream.DIPS)
    found: list[Dip] = []
    for _ in range(spec.dips or 0):
        for _ in range(_TRIES):
            across, along = draw(rng, *_RADIUS), draw(rng, *_RADIUS)
            height = draw(rng, *_DEPTH) * float(rng.choice([-1.0, 1.0]))
            middle = carriageway.shift + carriageway.lane * draw(rng, -0.5, 0.5)
            dip = Dip(middle, draw(rng, *_AHEAD), across, along, height)
            if _fits(dip, found, carriageway):
                found.append(dip)
                break
    return tuple(found)


def _fits(dip: Dip, others: Sequence[Dip], carriageway: Carriageway) -> bool:
    ends = (dip.lateral - 1.3 * dip.across, dip.lateral + 1.3 * dip.across)
    section = carriageway.section
    one_piece = section.piece(ends[0]) is section.piece(ends[1])
    inside = section.pieces[0].start < ends[0] and ends[1] < section.pieces[-1].end
    apart = all(
        abs(dip.lateral - each.lateral) > 1.2 * (dip.across + each.across)
        or abs(dip.z - each.z) > dip.along + each.along + 1.0
        for each in others
    )
    return one_piece and inside and apart


def add_dips(scene: Scene, spec: FrameSpec, carriageway: Carriageway) -> None:
    """Put the dips and bumps of a frame into the grounds of its carriageway."""
    dips = draw_dips(spec, carriageway)
    scene.surfaces = [_dipped(surface, dips) for surface in scene.surfaces] if dips else scene.surfaces


def _dipped(surface: Surface, dips: Sequence[Dip]) -> Surface:
    if not isinstance(surface, Ground):
        return surface
    mine = tuple(dip for dip in dips if surface.edges[0] <= dip.lateral < surface.edges[-1])
    return replace(surface, relief=replace(surface.relief or LEVEL, dips=mine)) if mine else surface


def true_heights(
    scene: Scene, spec: FrameSpec, carriageway: Carriageway, camera: Camera
) -> NDArray[np.float32]:
    """Return how high the ground that a camera sees lies over the road, metres, (H, W); NaN for the rest.

    The road is the carriageway without dips, bumps and gutters, which goes on beyond its edges as it is at
    them.
    """
    section = cross_section(
        spec.cross_section, spec.crossfall, 0.0, carriageway.left, carriageway.right, carriageway.course.bend
    )
    ground = np.array([isinstance(each, Ground) for each in scene.surfaces] + [False])
    rows = [
        _row_heights(scene, PixelRays.of_rows(camera, part), ground, carriageway.course, section)
        for part in bands(camera)
    ]
    return np.concatenate(rows).reshape(camera.height, camera.width)


def _row_heights(
    scene: Scene, pixels: PixelRays, ground: NDArray[np.bool_], course: Course, section: CrossSection
) -> NDArray[np.float32]:
    depth, owner = first_hits(scene, pixels)
    seen = ground[owner]
    points = pixels.rays.origin + np.where(seen, depth, 0) * pixels.rays.direction
    lateral = course.lateral(points)
    over, slope = course.elevation(points), np.zeros_like(lateral)
    for piece in section.pieces:
        first, last = piece is section.pieces[0], piece is section.pieces[-1]
        mine = (first | (lateral >= piece.start)) & (last | (lateral < piece.end))
        over[mine] -= (piece.offset + (piece.slope + piece.camber / 2 * lateral) * lateral)[mine]
        slope[mine] = (piece.slope + piece.camber * lateral)[mine]
    normal = -slope * course.across(points[2])
    normal[1] += 1.0
    normal[2] -= course.curvature * points[2]
    return np.where(seen, over / np.linalg.norm(normal, axis=0), np.nan).astype(np.float32)

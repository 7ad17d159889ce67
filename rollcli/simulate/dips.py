"""Dips and bumps in the carriageway, and how high what a camera sees lies over the road without them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.camera import Camera, PixelRays
from rollcli.simulate.road import Carriageway, CrossSection, cross_section
from rollcli.simulate.scene import Scene, draw
from rollcli.simulate.spec import FrameSpec, Stream
from rollcli.simulate.surfaces import Course, Ground, Surface, SurfaceSample
from rollcli.simulate.vectors import Array
from rollcli.simulate.views import first_hits

_DEPTH = (0.025, 0.07)  # metres, of dips as of bumps
_RADIUS = (0.25, 0.5)  # metres
_AHEAD = (4.5, 12.0)  # metres
_FLOOR = 0.5  # of the radius: so far out a dip is as deep as in its middle
_TRIES = 50  # for a place beside those that are there
_STEPS, _HALVINGS = 33, 40  # of a ray near a dip: a step is a few centimetres


@dataclass(frozen=True)
class Dip:
    """An ellipse of the road that lies lower, or higher where `height` is positive; metres.

    `lateral` and `z` are its middle in road coordinates, `across` and `along` its radii.
    """

    lateral: float
    z: float
    across: float
    along: float
    height: float

    def relief(self, lateral: Array, z: Array) -> tuple[Array, Array, Array]:
        """Return height over the road, metres, and its slopes by lateral and by z."""
        x, y = (lateral - self.lateral) / self.across, (z - self.z) / self.along
        out = np.hypot(x, y)
        fall = np.clip((out - _FLOOR) / (1 - _FLOOR), 0, 1)
        by_out = -np.pi / 2 / (1 - _FLOOR) * np.sin(np.pi * fall) * self.height / np.maximum(out, _FLOOR)
        return (
            self.height * (0.5 + 0.5 * np.cos(np.pi * fall)),
            by_out * x / self.across,
            by_out * y / self.along,
        )


@dataclass(frozen=True)
class DippedGround(Ground):
    """Ground with dips and bumps in it."""

    dips: tuple[Dip, ...] = ()

    def intersect(self, origin: Array, direction: Array) -> Array:
        t = super().intersect(origin, direction)
        points = origin + np.where(np.isfinite(t), t, 0) * direction
        lateral = self.course.lateral(points)
        rising = -self._steepness(origin, direction, t)
        for dip in self.dips:
            # a ray that meets a bump would meet the road behind it
            behind = np.where(rising > 0, max(dip.height, 0.0) / np.maximum(rising, 1e-9) * direction[2], 0.0)
            near = np.isfinite(t) & (np.abs(lateral - dip.lateral) < 1.2 * dip.across)
            near &= (points[2] > dip.z - dip.along) & (points[2] < dip.z + dip.along + 1.5 * behind)
            (at,) = np.nonzero(near)
            if len(at):
                of = origin if origin.shape[1] == 1 else origin[:, at]
                t[at] = self._first_crossing(of, direction[:, at], t[at], 1.2 * abs(dip.height) / rising[at])
        return t

    def _over(self, points: Array) -> Array:
        """Return how high points are over the ground without dips, along Y."""
        lateral = self.course.lateral(points)
        sheet = self.offset + (self.slope + self.camber / 2 * lateral) * lateral
        return np.asarray(self.course.elevation(points) - sheet)

    def _steepness(self, origin: Array, direction: Array, t: Array) -> Array:
        """Return how fast rays rise over the ground where they meet it."""
        ahead = np.where(np.isfinite(t), t, 0)
        step = 1e-3
        return (
            self._over(origin + (ahead + step) * direction) - self._over(origin + (ahead - step) * direction)
        ) / (2 * step)

    def _first_crossing(self, origin: Array, direction: Array, t: Array, reach: Array) -> Array:
        """Return where rays, which meet the ground at t, first meet its relief, at most `reach` away."""

        def clearance(at: Array) -> Array:
            points = origin + at * direction
            lateral = self.course.lateral(points)
            return self._over(points) - sum(dip.relief(lateral, points[2])[0] for dip in self.dips)

        shares = np.linspace(-1, 1, _STEPS)
        below = np.array([clearance(t + share * reach) <= 0 for share in shares])
        first = np.maximum(below.argmax(axis=0), 1)
        met = below.any(axis=0)
        low, high = (t + shares[place] * reach for place in (first - 1, first))
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            over = clearance(middle) > 0
            low, high = np.where(over, middle, low), np.where(over, high, middle)
        return np.where(met, high, t)

    def sample(self, points: Array) -> SurfaceSample:
        flat = super().sample(points)
        normal = np.array(flat.normal)
        for dip in self.dips:
            _, by_lateral, by_z = dip.relief(flat.p, points[2])
            normal = normal - by_lateral * flat.grad_p
            normal[2] -= by_z
        return flat._replace(normal=normal)


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
    if type(surface) is not Ground:
        return surface
    mine = tuple(dip for dip in dips if surface.edges[0] <= dip.lateral < surface.edges[-1])
    given = {name: getattr(surface, name) for name in surface.__dataclass_fields__}
    return DippedGround(**given, dips=mine) if mine else surface


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
        for part in _bands(camera)
    ]
    return np.concatenate(rows).reshape(camera.height, camera.width)


def _bands(camera: Camera) -> Iterator[range]:
    step = max(1, 350_000 // camera.width)
    return (range(top, min(top + step, camera.height)) for top in range(0, camera.height, step))


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

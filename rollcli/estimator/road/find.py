"""Which pixels are road: the plane that best explains what lies ahead of the rig.

Planes through triples of pixels are judged by what they leave unexplained. Three things tell a road from the
walls, verges and sky that may cover more of the image: nothing lies below a road; around each of its pixels
the map rises as the road itself does; and it is what the rig drives on, so it fills the corridor straight
ahead, a few camera heights wide. All three are measured in units of the hypothesis itself: they need neither
the focal length nor the scale of the disparities.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.road.hypotheses import draw_planes
from rollcli.estimator.road.model import RoadModel
from rollcli.estimator.road.neighbours import Singles
from rollcli.estimator.road.scoring import PlaneScorer
from rollcli.estimator.road.subsample import Sample
from rollcli.estimator.road.tuning import SearchTuning

HARDLY_A_PIXEL = "no road: hardly a pixel lies on the best plane that was found"


@dataclass(frozen=True)
class Road:
    """The plane that was found.

    Attributes
    ----------
    plane : ndarray, shape (3,)
        d = c0 + c1 x + c2 y on the sample's grid.
    score : float
        The share of the road-like pixels ahead that lie on the plane, less those below it; at most 1. It is
        the mean of two shares, in the corridor and in its core, where a wide verge has no pixel. A plane
        whose horizon is far outside of the image, as that of a wall, scores less.
    rival : float
        The best score of another plane, one whose roll differs by `SearchTuning.rival_angle` or more.
    """

    plane: NDArray[np.float64]
    score: float
    rival: float

    @property
    def model(self) -> RoadModel:
        """The plane as a road without curvature."""
        return RoadModel.of_plane(*self.plane.tolist())

    @property
    def horizon(self) -> float:
        """How far the plane's horizon is from the centre of the image, units: large for a wall or a table."""
        c0, c1, c2 = self.plane.tolist()
        return abs(float(c0)) / math.hypot(c1, c2)


def find_road(sample: Sample, max_roll: float, seed: int) -> Road:
    """Find the plane of the road.

    Parameters
    ----------
    sample : Sample
    max_roll : float
        The largest abs(roll) considered, radians; more than 0, less than pi / 2.
    seed : int
        Of the triples drawn.

    Returns
    -------
    Road

    Raises
    ------
    EstimationError
        When no plane through the pixels rises downward in the image, as a road's disparity does, or none
        has pixels on it.
    """
    planes = draw_planes(sample, max_roll, seed)
    if len(planes) == 0:
        raise EstimationError("no road: nowhere does the disparity grow downward, as it does on a road")
    tuning = sample.tuning.search
    scorer = PlaneScorer.of(sample)
    planes = planes[_varied(scorer.first_costs(planes, tuning.first_pixels), _rolls(planes), tuning)]
    fitted = scorer.fitted(planes)
    kept = np.abs(fitted[:, 1]) <= math.tan(max_roll) * fitted[:, 2]
    fitted = _distinct(fitted[kept] if kept.any() else planes[:1], tuning.same_plane * sample.noise)
    scores = scorer.scores(fitted)
    winner = int(scores.argmax())
    if not fitted[winner, 2] > 0:  # fitted to no pixel, it scores 0, and the others have more against them
        raise EstimationError(HARDLY_A_PIXEL)
    rolls = _rolls(fitted)
    far = np.abs(rolls - rolls[winner]) > tuning.rival_angle
    return Road(fitted[winner].astype(np.float64), float(scores[winner]), float(scores[far].max(initial=-1)))


def _varied(costs: Singles, rolls: Singles, tuning: SearchTuning) -> list[int]:
    """Return the cheapest planes, few of each roll: a wide verge must not crowd out the road."""
    bins = np.floor(rolls / tuning.rival_angle).astype(np.intp).tolist()
    taken = dict.fromkeys(bins, 0)  # a Counter takes longer
    chosen: list[int] = []
    for plane in costs.argsort(kind="stable").tolist():
        alike = bins[plane]
        if taken[alike] < tuning.of_each_roll:
            taken[alike] += 1
            chosen.append(plane)
            if len(chosen) == tuning.refined:
                break
    return chosen


def _distinct(planes: Singles, least: float) -> Singles:
    """Return those planes that differ from all before them, by so much somewhere within a unit, px.

    Most fits on a good map end at the same plane.
    """
    distinct: list[list[float]] = []
    for plane in planes.tolist():
        a0, a1, a2 = plane
        if all(abs(a0 - b0) + abs(a1 - b1) + abs(a2 - b2) >= least for b0, b1, b2 in distinct):
            distinct.append(plane)
    return np.array(distinct, np.float32)


def _rolls(planes: Singles) -> Singles:
    return np.arctan2(-planes[:, 1], planes[:, 2])

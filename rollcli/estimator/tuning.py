"""Every tuned number of the estimator: its unit, its reason, and what it does.

One frozen record a stage, all of them in `Tuning`. ``tests/benchmarks/bench_ablation.py`` changes one number
at a time; its table is in ``rollcli/estimator/README.md``. Lengths are in camera heights where it says so,
else in units of half the map's longer side; a tolerance is `Sample.tolerance`, a pixel's own.
"""

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class SampleTuning:
    """Numbers of `take_sample`: which pixels are looked at, and how far they may be off.

    Attributes
    ----------
    pixels : int
        Pixels aimed at. With 10,000 rendered frames are as exact, but fewer lidar sweeps are covered (0.98
        and not 1.00), and real maps are lost on which a third or half of the pixels are noise.
    coarse_pixels : int
        Pixels of these that planes are drawn through, fitted to and judged by.
    noise_share : float
        Share of the median disparity that matching gets wrong on real roads, whatever the scale.
    uneven_share : float
        Share of a pixel's own disparity: 2 % of the camera's height, 3 cm on a car.
    reach : float
        Of the map's longer side: how far away neighbours are. Nearer ones share a matcher's errors.
    """

    pixels: int = 12000
    coarse_pixels: int = 1600
    noise_share: float = 0.012
    uneven_share: float = 0.02
    reach: float = 1 / 310


@dataclass(frozen=True)
class SearchTuning:
    """Numbers of `find_road`: which planes are tried, and what makes a plane a road.

    Attributes
    ----------
    draws : int
        Triples drawn; about half are planes that could be a road.
    radius : float
        Of a triple, units. Smaller: planes are noise; larger: triples leave the road.
    first_pixels : int
        Pixels on which all planes are judged.
    refined : int
        Planes that go on, each the best of its roll: they are fitted, and judged on more pixels. Of 41 maps
        of real pairs and twelve seeds one had no angle with 4: the road's was the sixth. 8 cost 3 % of a map.
    corridor : float
        Half-width of the corridor ahead, and of the lane in it, camera heights.
    off_slope_weight : float
        Weight of a pixel around which the map does not rise as the road does.
    slope_share : float
        Of the road's own slope: how far the map's may be off.
    """

    draws: int = 256
    radius: float = 0.35
    first_pixels: int = 240
    refined: int = 8
    corridor: float = 1.0
    off_slope_weight: float = 0.2
    slope_share: float = 0.4


@dataclass(frozen=True)
class FitTuning:
    """Numbers of `fit_surface`: the robust fit of parabola, roll and camber, and the profile across.

    Attributes
    ----------
    pixels : int
        Pixels near the plane that are looked at, each averaged with those around it.
    start_width : float
        Tolerances within which a pixel counts at first.
    width : float
        Of the pixels' root mean square distance: within which they count in the end.
    other_roll : float
        Radians: what a rig rolled by this much more or less would not see does not count.
    camber : float
        How much camber a road has, as the standard deviation of a prior, 1/(camera height). With 0.002 the
        errors on crowned roads are a quarter larger (95 %).
    off_level : float
        Camera heights over or under the lane at which the weight is halved: on gentle verges and the far side
        of a crown there is no step.
    profile : float
        Camera heights to the side at which weights end, as exp(-(side / profile)^8).
    """

    pixels: int = 4500
    start_width: float = 2.0
    width: float = 3.75
    other_roll: float = 0.10
    camber: float = 0.003
    off_level: float = 0.01
    profile: float = 1.25


@dataclass(frozen=True)
class IntervalTuning:
    """Numbers of `jackknife` and `interval_of`.

    Attributes
    ----------
    groups : int
        Bands and columns of the jackknife. More are less independent, fewer have fewer degrees of freedom.
    independent_pixels : int
        Pixels that could be independent: neighbouring ones repeat each other, more do not tell more.
    white : float
        Of the textbook's half-width: what makes neighbours alike shows in bands and columns, too. With 1 the
        interval covers every flat rendered road; tangents need all of it, since one shift of all disparities
        turns no road, and shows nowhere else.
    factor : float
        Of the jackknife's half-width. Two thirds of it cover 0.88 of 400 rendered pairs instead of 0.965, and
        0.96 of 104 real maps, whose intervals are mostly of uneven ground, instead of 0.97.
    uneven : float
        Of the road's unevenness. It covers 0.94 of 430 rendered pairs of ISO 8608's classes, and all of
        41 lidar sweeps; with 5.5 it is 0.93, and 0.98.
    noise_falls : float
        By how much noise falls from a quarter of a patch to the whole: by 4 where neighbours share none of
        it. With 4 the intervals of smooth rendered roads are half as wide again; with 2, 0.86 of the rough
        ones and 0.88 of the sweeps are covered.
    twist : float
        By how much the lane turns between the lower border and where it begins to be seen: radians per
        camera height that the view is wider there. Fitted to one half of 41 lidar sweeps and as many pairs,
        without their lower 30 to 120 rows, it is 0.0021 or 0.0030.
    bend : float
        Of the angle by which the camber moves theta: a crown is no exact parabola.
    slant : float
        Growth of the interval from no roll to a right angle, by the sine of the roll.
    """

    groups: int = 6
    independent_pixels: int = 100
    white: float = 0.2
    factor: float = 0.44
    uneven: float = 6.0
    noise_falls: float = 2.5
    twist: float = 0.0026
    bend: float = 2.75
    slant: float = 1.0


@dataclass(frozen=True)
class DoubtTuning:
    """Numbers of the reasons to doubt an angle; each is where an angle stops being ok.

    Attributes
    ----------
    near_minimum : float
        Times the lowest energy up to which another minimum is nearly as low.
    other_angle : float
        Radians by which another minimum is another answer.
    narrowest : float
        Camera heights that a view is wide at its bottom at the least: cameras that look down at the road see
        1.06, those at a table 0.6. Without it 26 of 1080 scenes without a road are ok in place of 2.
    filled_by_horizon : float
        Least share of all pixels that is on the road, for each unit from the centre to its horizon: the
        further down a camera looks, the more it sees of its road. Without it 20 of 1080 scenes without a road
        are ok in place of 2 (bench_roadless.py).
    most_filled : float
        That share at most: empty roads seen steeply from above leave 0.98, tables 0.95.
    reach : float
        Camera heights that the view is wide, up to where a road goes on at the least, and twice as far: all
        of 131 real roads do, and all of 540 rendered ones but 3 that end behind a truck. Planes that are none
        mostly end nearer than 4.
    most_below : float
        Share of the lane's pixels in a band that may lie below the plane: of real and rendered roads 0.4 at
        most. Without it 13 of 1080 scenes without a road are ok in place of 2, desks above all; with 0.3
        roads behind noise or a wall over half of the image are doubted twice as often.
    least_beyond : float
        Share of the pixels beyond `reach` that is on the plane, of all or of those in the lane: of all 0.27
        and more on real roads, 0.24 on rendered ones, 0.07 behind a truck; in the lane 0.37 and more from a
        truck. Without it 47 scenes are ok: shelves, desks, rooms; with 0.15 21 of 3600 are in place of 17.
    least_farther : float
        Share of the road's pixels that lie more than twice as far away as the nearest of them: 0.09 and more
        on real roads and rendered ones, 0.05 on crops of lidar sweeps; of dashboards mostly 0. Without it 39
        of 200 scenes inside a car are ok in place of 2 (bench_roadless.py).
    rival_share : float
        Share of the road's score from which another plane explains the map nearly as well.
    longest_move : float
        Radians by which the fit to the road's pixels may move the roll of its plane.
    noise_share : float
        Share of the widest interval that noise alone may make. At two thirds of it six of 28 real maps that
        are right are doubted, instead of two.
    """

    near_minimum: float = 1.1
    other_angle: float = math.radians(2)
    narrowest: float = 0.8
    filled_by_horizon: float = 0.7
    most_filled: float = 0.97
    reach: float = 8.0
    most_below: float = 0.5
    least_beyond: float = 0.2
    least_farther: float = 0.05
    rival_share: float = 0.75
    longest_move: float = math.radians(1)
    noise_share: float = 0.45


@dataclass(frozen=True)
class Tuning:
    """Every tuned number of the estimator."""

    sample: SampleTuning = field(default_factory=SampleTuning)
    search: SearchTuning = field(default_factory=SearchTuning)
    fit: FitTuning = field(default_factory=FitTuning)
    interval: IntervalTuning = field(default_factory=IntervalTuning)
    doubts: DoubtTuning = field(default_factory=DoubtTuning)


TUNING = Tuning()

"""Every tuned number of the estimator: its unit, its reason, and what it does.

One frozen record a stage, all of them in `Tuning`. ``tests/benchmarks/bench_ablation.py`` changes one number
at a time; its table is in ``rollcli/estimator/README.md``. Lengths are in camera heights where it says so,
else in units of half the map's longer side; a tolerance is `Sample.tolerance`, a pixel's own.
"""

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class SampleTuning:
    """Numbers of `take_sample`: which pixels are looked at, and how far they may be off."""

    pixels: int = 12000
    """Pixels aimed at. With 9,000 rotations of real maps are followed worse, more only take longer."""
    coarse_pixels: int = 2000
    """Pixels of these that planes are drawn through, fitted to and judged by. With 600, two of 92 rotations
    are grossly off, and three of 69 maps with 30 % of noise."""
    sparse_share: float = 0.45
    """Share of `pixels` below which a sparse map is sampled anew on a finer grid."""
    finer_share: float = 0.6
    """Share of `pixels` that the finer grid aims at."""
    least_pixels: int = 50
    """Pixels without which no road is looked for."""
    noise_share: float = 0.012
    """Share of the median disparity that matching gets wrong on real roads, whatever the scale."""
    uneven_share: float = 0.02
    """Share of a pixel's own disparity: 2 % of the camera's height, 3 cm on a car."""
    quantum_share: float = 0.29
    """Of the smallest step in the map: rounding is off by 1 / sqrt(12) steps, root mean square."""
    quantum_part: int = 20
    """The smallest step is the 1/20 quantile of all steps: smaller ones are rounding of floats."""
    coherent_share: float = 0.03
    """Share of the median disparity by which neighbours may differ and still agree."""
    coherent_from: float = 0.5
    """Share of agreeing neighbours from which a pixel is coherent, that is no noise."""
    neighbour_part: int = 310
    """Neighbours are 1/310 of the longer side away: 4 px at 1242. Nearer ones share a matcher's errors."""
    neighbour_least: int = 3
    """Neighbours are at least this far away, px: matchers blur over less."""
    neighbour_most: int = 16
    """Neighbours are at most this far away, px."""
    border_part: int = 8
    """Neighbours are at most 1/8 of the shorter side away: a small map needs its pixels."""


@dataclass(frozen=True)
class HypothesisTuning:
    """Numbers of `draw_planes`."""

    draws: int = 512
    """Triples drawn; about half are planes that could be a road."""
    kept: int = 160
    """Planes kept of these, the first ones. With 40 of 128, five of 92 rotations of real maps are grossly
    off, instead of none (`bench_follow.py`)."""
    radius: float = 0.35
    """Of a triple, units. Smaller: planes are noise; larger: triples leave the road."""
    least_area: float = 0.004
    """Twice the area of a triangle, square units: below, its plane is ill conditioned."""
    least_rise: float = 4.0
    """Tolerances by which a road rises within the radius: less is the noise of a wall, or of a car ahead."""


@dataclass(frozen=True)
class ScoreTuning:
    """Numbers of `PlaneScorer`: what makes a plane a road."""

    corridor: float = 1.0
    """Half-width of the corridor ahead, camera heights; that of its core is 1 / sqrt(8) of it."""
    fits: int = 2
    """Weighted fits of each plane that is judged again."""
    first_fit_width: float = 2.0
    """Tolerances within which a pixel counts in the first of these fits, 1 in the others."""
    below_penalty: float = 0.85
    """Added cost of a coherent pixel below the plane (off it: 1); nothing lies below a road."""
    off_slope_weight: float = 0.2
    """Weight of a pixel around which the map does not rise as the road does."""
    slope_share: float = 0.4
    """Of the road's own slope: how far the map's may be off."""
    beside_weight: float = 0.03
    """Weight of a pixel far beside the corridor. Higher: wide verges and walls win."""
    nearness: float = 1.5
    """Typical disparities up to which weights grow: what is near ahead is the road driven on."""
    horizon: float = 2.0
    """Units from the centre: a plane whose horizon is farther away is rather a wall, or an own bonnet."""
    least_corridor: float = 0.025
    """Share of the pixels that the corridor should weigh: an emptier one scores less, and depth maps are told
    as such. Twice this, and twice `least_core`, give a narrow lane to the verge, 4.7 degrees off."""
    least_core: float = 0.01
    """The same for its core."""


@dataclass(frozen=True)
class SearchTuning:
    """Numbers of `find_road`: how many planes are judged on how many pixels."""

    first_pixels: int = 320
    """Pixels on which all planes are judged cheaply. With 80 one of 92 rotations of real maps is grossly off,
    instead of none."""
    of_each_roll: int = 2
    """Planes of one roll that go on: a wide verge must not crowd out the road."""
    refined: int = 5
    """Planes that go on: they are fitted, and judged again. With 6 the same errors, and 2 % more time; with
    4, seven of 2,240 degraded maps are wrong and called ok, instead of four."""
    same_plane: float = 1.0
    """Of the noise: of planes that differ by less, everywhere in the map, one is judged. More than half are
    such; without this the same errors, and 1 % more time."""
    rival_angle: float = math.radians(2)
    """Radians by which another plane's roll differs, to be a rival."""


@dataclass(frozen=True)
class FitTuning:
    """Numbers of `NearPixels`: the robust fit of parabola and roll."""

    pixels: int = 4500
    """Pixels near the plane that are looked at, each averaged with those around it. With 3,000 the median
    error on rendered roads is a seventh larger, and all takes 4 % less time."""
    least_pixels: int = 30
    """Pixels with some weight, without which there is no road."""
    reach: float = 3.0
    """Tolerances from the plane beyond which a pixel is not looked at again."""
    rounds: int = 3
    """Rounds of the fit to the road, which starts from the lane ahead."""
    most_turn: float = 0.2
    """Radians that a round may turn the road by."""
    start_width: float = 2.0
    """Tolerances within which a pixel counts at first."""
    even_width: float = 3.0
    """Standard deviations within which a pixel of an even road counts in the end."""
    uneven_width: float = 3.5
    """The same for an uneven road: its rises and dips are no noise."""
    least_width: float = 0.2
    """Tolerances within which a pixel counts in any case; at least one step of a map of whole pixels."""
    even_spread: float = 0.35
    """Standard deviation up to which a road is even, tolerances."""
    uneven_spread: float = 0.55
    """Standard deviation from which a road is uneven, tolerances; between the two the widths are mixed."""
    biweight_spread: float = 1.25
    """Standard deviation of a normal distribution over its root mean square under biweights."""
    lane: float = 1.0
    """Half-width of the lane ahead, camera heights; it ends as exp(-(side / lane)^4)."""
    camber: float = 0.003
    """How much camber a road has, as the standard deviation of a prior, 1/(camera height). With 0.002 the
    errors on crowned roads are a quarter larger (95 %)."""
    independent_pixels: int = 120
    """Pixels that could be independent: neighbouring ones repeat each other, more do not tell more. With 200
    rotations of real maps are followed within 0.07 degrees (95 %) instead of 0.06."""
    least_weight: float = 0.001
    """Weight by the profile below which a pixel is left out: it would only take time."""
    beside: float = 0.01
    """Weight of a pixel beside the lane when its spread is measured: a lane may be hidden."""
    other_roll: float = 0.10
    """Radians: what a rig rolled by this much more or less would not see does not count."""
    large_roll: float = 0.2
    """Tangent of the roll from which on less and less of the corners is left out."""
    corner_fade: float = 0.01
    """Units over which the weight fades out there."""


@dataclass(frozen=True)
class ProfileTuning:
    """Numbers of `read_profile`: the profile across the road, in bins of height over the lane ahead."""

    bin_width: float = 0.25
    """Camera heights."""
    bins: int = 10
    """To each side."""
    bin_pixels: int = 12
    """Pixels without which a bin has no height."""
    least_place: float = 0.1
    """Weight by place and slope (`NearPixels.place`) from which a pixel is looked at."""
    least_road: float = 0.1
    """Share of a pixel's disparity that the road's must have: above the horizon there is no profile."""
    core_bins: int = 2
    """Bins from the middle that are the lane's in any case."""
    off_level: float = 0.01
    """Camera heights over or under the lane at which the weight is halved: on gentle verges and the far side
    of a crown there is no step."""
    width: float = 1.25
    """Camera heights to the side at which weights end, as exp(-(side / width)^8). With 1.5 the errors on
    crowned roads are a fifth larger (95 %), and the intervals of real ones 6 % wider."""


@dataclass(frozen=True)
class SurfaceTuning:
    """Numbers of `Surface.covers`."""

    steady: float = 0.5
    """Of the road's own rise: how far that of the map may be off. Higher: feet of walls are road."""
    least_level: float = 0.5
    """How much of the lane's level the ground has from which it is shown as road (`Profile.level`)."""


@dataclass(frozen=True)
class RoadTuning:
    """Every tuned number of road finding, by stage."""

    sample: SampleTuning = field(default_factory=SampleTuning)
    hypotheses: HypothesisTuning = field(default_factory=HypothesisTuning)
    score: ScoreTuning = field(default_factory=ScoreTuning)
    search: SearchTuning = field(default_factory=SearchTuning)
    fit: FitTuning = field(default_factory=FitTuning)
    profile: ProfileTuning = field(default_factory=ProfileTuning)
    surface: SurfaceTuning = field(default_factory=SurfaceTuning)


ROAD_TUNING = RoadTuning()


@dataclass(frozen=True)
class IntervalTuning:
    """Numbers of `jackknife` and `interval_of`."""

    groups: int = 6
    """Bands and columns of the jackknife. More are less independent, fewer have fewer degrees of freedom."""
    independent_pixels: int = 100
    """Pixels that could be independent: neighbouring ones repeat each other, more do not tell more."""
    white: float = 0.2
    """Of the textbook's half-width: what makes neighbours alike shows in bands and columns, too. With 1 the
    interval covers every flat rendered road; tangents need all of it, since one shift of all disparities
    turns no road, and shows nowhere else."""
    factor: float = 0.65
    """Of the jackknife's half-width. Two thirds of it cover 0.86 of 28 real maps instead of 0.93, and 0.92 of
    24 rendered ones instead of 0.96."""
    lateral: float = 0.75
    """Of the difference between the lane's angle and that of all pixels."""
    depth: float = 0.55
    """Of the difference between the near half's angle and the far half's."""
    bend: float = 2.75
    """Of the angle by which the camber moves theta: a crown is no exact parabola."""
    depth_fade: float = 0.02
    """Units over which near turns into far."""
    whole_share: float = 0.02
    """Share of the whole that is added to a part, which may be nearly empty."""
    slant: float = 1.0
    """Growth of the interval from no roll to a right angle, by the sine of the roll."""


@dataclass(frozen=True)
class DoubtTuning:
    """Numbers of the reasons to doubt an angle; each is where an angle stops being ok."""

    near_minimum: float = 1.1
    """Times the lowest energy up to which another minimum is nearly as low."""
    other_angle: float = math.radians(2)
    """Radians by which another minimum is another answer."""
    least_score: float = 0.03
    """`Road.score` below which little of what lies ahead looks like a road. Behind a car, and with noise on
    four fifths of the pixels, right angles have 0.04 and more; wrong ones, with more noise still, 0.02."""
    least_steep_score: float = 0.18
    """The same for a plane whose horizon is far away: tables and stairs have up to 0.17."""
    steep: float = 0.5
    """Units from the centre beyond which a horizon is far away: of roads it is within 0.2, of tables 1.5."""
    rival_share: float = 0.75
    """Share of the road's score from which another plane explains the map nearly as well."""
    longest_move: float = math.radians(1)
    """Radians by which the fit to the road's pixels may move the roll of its plane."""
    bound_share: float = 0.99
    """Share of the largest roll from which a roll is at its bound."""
    noise_share: float = 0.45
    """Share of the widest interval that noise alone may make. At two thirds of it six of 28 real maps that
    are right are doubted, instead of two."""


@dataclass(frozen=True)
class Tuning:
    """Every tuned number of the estimator."""

    road: RoadTuning = field(default_factory=RoadTuning)
    interval: IntervalTuning = field(default_factory=IntervalTuning)
    doubts: DoubtTuning = field(default_factory=DoubtTuning)


TUNING = Tuning()

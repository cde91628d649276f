"""One bag, read for the report: its methods, and the chosen estimators run over its streams."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pose_core.api import EstimateSeries, Extrinsics, FloatArray, SkeletonSeries
from pose_core.arrays import rows_between
from pose_core.errors import InputError, PoseError
from pose_evaluation.methods import FUSED, MEAN, methods_of_bag
from pose_evaluation.offline import (
    ALIASES,
    IMU_ENDING,
    NEED_IMUS,
    MethodRun,
    known_setups,
    run_methods,
)
from pose_io.bag_samples import BagSamples, read_estimates
from pose_io.bags import BagReader, Progress
from pose_io.names import FUSE_STATUS
from pose_io.topics import imu_topics, sensor_topics
from pose_node.node_status import NodeStatus
from pose_view.recorded_fusion import read_statuses, recorded_fusion

PREFERRED = (FUSED, "default+imus", "default", "li2020", "joint_kf", MEAN)
ALL = "all"  # selects all methods
COMMENT_KEY = "comment"  # key of the recording's comment in a bridge's report
MAX_DURATION_S = 1e9  # [s] replaces infinity
SYNTHETIC = "synthetic"  # beginning of the comment of a synthetic recording

FindExtrinsics = Callable[[BagReader, tuple[str, ...]], Extrinsics]


@dataclass(frozen=True, kw_only=True)
class ReportData:
    """Content of a bag for the report."""

    name: str
    begin_ns: int  # [ns] first instant of any method: zero of every time axis
    duration_s: float  # [s]
    comment: str  # comment of the source; may be empty
    views: Mapping[str, SkeletonSeries]  # by sensor, in its own frame
    segments: tuple[str, ...]  # segments with an IMU
    T_map_sensor: Mapping[str, FloatArray]  # (4, 4); empty where the extrinsics are unknown
    methods: Mapping[str, SkeletonSeries]  # in the order of the tables; sensors as in `views`
    estimates: Mapping[str, EstimateSeries]  # of the methods that give any
    focus: str  # the method of figures for a single method
    notes: tuple[str, ...] = field(default=())  # remarks on missing results
    said: tuple[str, ...] = ()  # by ./pose fuse, which made the bag
    unused_imus: tuple[str, ...] = ()  # segments or topics, of IMUs that a method could not use
    fused_by: str = ""  # estimator of the bag's own result; empty if it is not known
    limb_runs: Mapping[str, MethodRun] = field(default_factory=dict)  # for zhang2015's figures only

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that tracked a person."""
        return tuple(self.views)

    @property
    def is_synthetic(self) -> bool:
        """Whether the bag is marked as synthetic."""
        return self.comment.startswith(SYNTHETIC)

    def in_map(self, method: str) -> SkeletonSeries | None:
        """A method's joints in ``map``; None for a sensor without extrinsics."""
        series = self.methods[method]
        if method not in self.sensors:
            return series
        return series.transformed(self.T_map_sensor[method]) if self.T_map_sensor else None


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """The user's options."""

    name: str  # of the recording
    methods: tuple[str, ...] = ()  # `usual_methods` if empty
    focus: str = ""  # the best available one if empty
    person: str = ""
    body: str = ""
    from_s: float = 0.0  # [s] after the recording's first instant
    until_s: float = math.inf  # [s]


def read_report_data(
    bag: BagReader, wanted: Wanted, find_extrinsics: FindExtrinsics, progress: Progress
) -> ReportData:
    """Read a bag, and run the estimators over it.

    Args:
        bag: An open bag.
        wanted: The user's options.
        find_extrinsics: Function that returns the sensors' poses.
        progress: Called with the fraction done, 0 to 1.

    Raises:
        InputError: If a method is unknown, or no person is tracked.
    """
    segments = tuple(imu_topics(bag))
    statuses = read_statuses(bag)
    estimated = _estimate(bag, wanted, bool(segments), find_extrinsics, progress)
    fusion = recorded_fusion(bag, statuses, wanted.body)
    estimated.notes += [f"{FUSED}: IMU {name}: {why}." for name, why in fusion.unused.items()]
    whole = _span(estimated.methods)
    methods = _cut(estimated.methods, wanted, whole[0])
    if not methods:
        raise InputError(
            f"no person is seen from {wanted.from_s:g} to {wanted.until_s:g} s of the recording"
        )
    begin_ns, end_ns = _span(methods)
    if whole != (begin_ns, end_ns):
        begin_s, end_s = ((ns - whole[0]) * 1e-9 for ns in (begin_ns, end_ns))
        estimated.notes.append(
            f"This is the stretch from {begin_s:.1f} to {end_s:.1f} s of a longer recording."
        )
    return ReportData(
        name=wanted.name,
        begin_ns=begin_ns,
        duration_s=(end_ns - begin_ns) * 1e-9,
        comment=comment_of(statuses),
        views=_cut(estimated.views, wanted, whole[0]),
        segments=segments,
        T_map_sensor=estimated.T_map_sensor,
        methods=methods,
        estimates={
            name: rows_between(each, begin_ns, end_ns)
            for name, each in estimated.estimates.items()
            if name in methods and len(each.stamps_ns)
        },
        focus=wanted.focus if wanted.focus in methods else preferred(list(methods)),
        notes=tuple(estimated.notes),
        said=() if estimated.views else _said_by_fuse(statuses),
        unused_imus=tuple(dict.fromkeys([*fusion.unused, *estimated.unused_imus])),
        fused_by=fusion.estimator,
        limb_runs={
            name: MethodRun(
                series=run.series.between(begin_ns, end_ns),
                estimates=rows_between(run.estimates, begin_ns, end_ns),
            )
            for name, run in estimated.limb_runs.items()
        },
    )


def usual_methods(known: Sequence[str], sensors: Sequence[str]) -> tuple[str, ...]:
    """Default methods: the cameras' mean, a Kalman filter per joint, the best available one."""
    cameras = MEAN if len(sensors) > 1 else sensors[0]
    return (cameras, "joint_kf", preferred(known))


def preferred(names: Sequence[str]) -> str:
    """The best available method."""
    return next((name for name in PREFERRED if name in names), names[0])


def comment_of(statuses: Sequence[NodeStatus]) -> str:
    """Comment of the source of a bag's skeletons, from its bridge's report."""
    comments = (status.values.get(COMMENT_KEY, "") for status in statuses)
    return next(filter(None, comments), "")


def _said_by_fuse(statuses: Sequence[NodeStatus]) -> tuple[str, ...]:
    return tuple(
        line for status in statuses if status.name == FUSE_STATUS for line in status.values.values()
    )


@dataclass(kw_only=True)
class _Estimated:
    """Results of the whole bag, before an interval is selected."""

    methods: dict[str, SkeletonSeries]
    views: dict[str, SkeletonSeries] = field(default_factory=dict)
    estimates: dict[str, EstimateSeries] = field(default_factory=dict)
    T_map_sensor: dict[str, FloatArray] = field(default_factory=dict)
    notes: list[str]
    unused_imus: tuple[str, ...] = ()
    limb_runs: dict[str, MethodRun] = field(default_factory=dict)


def _estimate(
    bag: BagReader,
    wanted: Wanted,
    has_imus: bool,
    find_extrinsics: FindExtrinsics,
    progress: Progress,
) -> _Estimated:
    """All methods: the sensors, their mean, the estimators, the bag's own result."""
    sensors = tuple(sensor_topics(bag))
    extrinsics: Extrinsics | None = None
    notes = []
    try:
        extrinsics = find_extrinsics(bag, sensors)
    except PoseError as error:
        if sensors:  # a fused bag without skeletons needs no extrinsics
            notes.append(f"The sensors' places are unknown ({error}): no method joins them.")
    own = methods_of_bag(bag, wanted.person, wanted.body, extrinsics)
    setups = known_setups(has_imus=has_imus)
    known = [*own, MEAN, *(setup.name for setup in setups)]
    unknown = sorted({*wanted.methods, wanted.focus or ALL} - {*known, ALL})
    if unknown:
        names = ", ".join(dict.fromkeys(known))
        raise InputError(f"there is no method {', '.join(unknown)} here: expected some of {names}")
    limb_methods = () if wanted.methods else NEED_IMUS
    if not wanted.methods:
        usual = tuple(own) if extrinsics is None else usual_methods(known, sensors)
        wanted = replace(wanted, methods=usual)
    elif wanted.methods == (ALL,):
        methods = tuple(n for n in known if n.removesuffix(IMU_ENDING) not in ALIASES)
        wanted = replace(wanted, methods=methods)
    shown = (*wanted.methods, wanted.focus)
    result = _Estimated(methods={name: own[name] for name in sensors}, notes=notes)
    if extrinsics is not None:
        placed = (name for name in extrinsics.sensors if name in sensors)
        result.T_map_sensor = {name: extrinsics.T_map_sensor(name) for name in placed}
        result.methods |= {MEAN: own[MEAN]} if MEAN in own else {}
        chosen = [setup for setup in setups if setup.name in (*shown, *limb_methods)]
        imus = any(setup.use_imus for setup in chosen)
        samples = BagSamples(bag, wanted.person, progress, extrinsics=extrinsics, imus=imus)
        runs = run_methods(samples, chosen, extrinsics) if chosen else {}
        result.notes += [f"{line[0].upper()}{line[1:]}." for line in samples.left_out]
        for name, run in runs.items():
            if name not in shown:
                result.limb_runs[name] = run
                continue
            result.methods[name], result.estimates[name] = run.series, run.estimates
            result.notes += [f"{name}: {line}." for line in run.imus]
            if name.endswith(IMU_ENDING):
                result.unused_imus = run.unused_imus
    if FUSED in own:
        result.methods[FUSED] = own[FUSED]
        result.estimates[FUSED] = read_estimates(bag, wanted.body)
    result.views = {name: result.methods[name] for name in sensors}
    for name in [name for name, series in result.methods.items() if len(series) < 2]:
        result.notes.append(f"{name} gave no pose, and is left out.")
        del result.methods[name]
    result.methods = {name: each for name, each in result.methods.items() if name in shown}
    if not result.methods:
        raise InputError("no person is seen in this recording: there is nothing to report")
    return result


def _span(methods: Mapping[str, SkeletonSeries]) -> tuple[int, int]:
    """First and last instant [ns] of any method."""
    begin_ns = min(int(series.stamps_ns[0]) for series in methods.values())
    return begin_ns, max(int(series.stamps_ns[-1]) for series in methods.values())


def _cut(
    methods: Mapping[str, SkeletonSeries], wanted: Wanted, zero_ns: int
) -> dict[str, SkeletonSeries]:
    """Select the requested interval; methods without data in it are left out."""
    begin_ns = zero_ns + round(wanted.from_s * 1e9)
    end_ns = zero_ns + round(min(wanted.until_s, MAX_DURATION_S) * 1e9)
    cut = {name: series.between(begin_ns, end_ns) for name, series in methods.items()}
    return {name: series for name, series in cut.items() if len(series) > 1}


def seconds(stamps_ns: np.ndarray, begin_ns: int) -> FloatArray:
    """Stamps [ns] as seconds since an instant."""
    return np.asarray((stamps_ns - begin_ns) * 1e-9, float)

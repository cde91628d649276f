"""How long one update takes: the estimators, the textbook filter, and how the cost grows.

Times are of the thread's CPU, so that what else the machine does hardly counts; each is of one
call, prediction included.
"""

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata, util
from pathlib import Path

import numpy as np

from pose_bench.reference.opensim_ik import OpenSimIk
from pose_bench.reference.segment_filter import ReferenceFilter
from pose_bench.reference.textbook_ukf import TextbookFilter
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import BodyModel, load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.filters.li2020 import Li2020Filter, Li2020Parameters
from pose_core.filters.looks import CameraLooks, LinkLooks
from pose_core.filters.segment_filter import SegmentFilter
from pose_core.fusion.estimation import Estimation
from pose_core.fusion.observation_block import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.preparing import neutral_pose
from pose_core.fusion.tracking import tracking_counters
from pose_core.imu.readings import SegmentReading, readings_of
from pose_core.joints import JOINTS, TrackingState
from pose_core.session.neutral_stand import shape_of
from pose_core.streams.samples import FloatArray

PERIOD_S = 1.0 / 30.0
CAMERA_HEIGHT = 1.2  # [m]
NOISE = 0.02  # [m] of a joint
WHOLE = "default, whole estimator, two Kinects, nine IMUs"
OPENSIM = "OpenSim's inverse kinematics, 15 joints"
TEXTBOOK = "filterpy, Python fx and hx"
Step = Callable[[int], object]
"""One update, of the frame with this number."""


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Times of many calls."""

    name: str
    times_ms: FloatArray  # (calls,)

    @property
    def median_ms(self) -> float:
        """Half of the calls take less."""
        return float(np.median(self.times_ms))

    @property
    def p99_ms(self) -> float:
        """One call in a hundred takes more."""
        return float(np.percentile(self.times_ms, 99.0))


class Scene:
    """A person who moves, seen by any number of cameras and IMUs; the same one every time.

    Args:
        model: The body model.
        frames: Number of frames.
    """

    def __init__(self, model: BodyModel, frames: int) -> None:
        rng = np.random.default_rng(1)
        self.model = model
        self.shape: BodyShape = shape_of(model, neutral_pose())
        t = PERIOD_S * np.arange(frames)[:, None]
        dof = 0.3 * np.sin(2.0 * np.pi * (0.4 * t + rng.random(model.size)))
        dof[:, 2] += 0.9
        pose = ForwardKinematics(model, self.shape.offsets).pose(dof)
        self.dof, self.joints, self.rotations = dof, pose.positions, pose.rotations
        self._noise = rng.normal(0.0, NOISE, (16, *self.joints.shape))

    def seen(self, frame: int, sensors: int) -> FloatArray:
        """The joints that sensors see, shape (sensors, 15, 3) [m]."""
        return np.ascontiguousarray(self.joints[frame] + self._noise[:sensors, frame])

    def looks(self, frame: int, sensors: int) -> CameraLooks:
        """The same for the default estimator's filter."""
        return CameraLooks(
            positions=self.seen(frame, sensors),
            tracking_state=np.full((sensors, len(JOINTS)), int(TrackingState.TRACKED), np.uint8),
            cameras=np.array([camera_place(index) for index in range(sensors)]),
            offsets=np.zeros((sensors, len(JOINTS), 3)),
            delay_s=0.0,
        )

    def imus(self, frame: int, count: int) -> LinkLooks:
        """What IMUs say of the links; with more IMUs than links some have two."""
        links = np.arange(count) % len(self.rotations[frame])
        return LinkLooks(
            links=links,
            R_map_link=self.rotations[frame][links],
            variance=np.full((count, 3), 0.04),
            angular_velocity=np.zeros((count, 3)),
            rate_variance=np.full(count, 0.0025),
        )

    def observation(self, frame: int, segments: list[str]) -> Observation:
        """Two cameras and some IMUs for a whole estimator."""
        names = list(self.model.links)
        readings = {
            segment: SegmentReading(
                R_map_segment=self.rotations[frame, names.index(self.model.segments[segment])],
                angular_velocity=np.zeros(3),
                stddev=np.full(3, 0.05),
            )
            for segment in segments
        }
        stamp_ns = round(1e9 * PERIOD_S * (frame + 1))
        return Observation(
            stamp_ns=stamp_ns,
            newest_ns=stamp_ns,
            shape=self.shape,
            positions=self.seen(frame, 2),
            tracking_state=np.full((2, len(JOINTS)), int(TrackingState.TRACKED), np.uint8),
            cameras=np.stack([camera_place(0), camera_place(1)]),
            offsets=np.zeros((2, len(JOINTS), 3)),
            readings=readings_of(readings),
        )


def camera_place(index: int) -> FloatArray:
    """Where a camera stands: on a circle around the person."""
    angle = 2.0 * np.pi * index / 16.0
    return np.array([3.0 * np.cos(angle), 3.0 * np.sin(angle), CAMERA_HEIGHT])


def measure(name: str, step: Step, frames: int, warm_up: int = 5) -> Timing:
    """Call ``step`` with the numbers of all frames; the first ones are not counted."""
    times = []
    for frame in range(frames):
        start_ns = time.thread_time_ns()
        step(frame)
        times.append((time.thread_time_ns() - start_ns) * 1e-6)
    return Timing(name=name, times_ms=np.array(times[warm_up:]))


def segment_steps(scene: Scene, sensors: int, imus: int, kind: type = SegmentFilter) -> Step:
    """Prediction and update of the default estimator's filter, compiled or plain."""
    filter_ = kind(SegmentTree(scene.model, scene.shape))
    filter_.start(scene.rotations[0], scene.dof[0, :3])
    looks = [
        (scene.looks(frame, sensors), scene.imus(frame, imus)) for frame in range(len(scene.dof))
    ]

    def step(frame: int) -> None:
        filter_.predict(PERIOD_S)
        filter_.update(*looks[frame])

    return step


def persons_steps(scene: Scene, persons: int) -> Step:
    """Two Kinects and nine IMUs for each of several persons: each has a filter."""
    steps = [segment_steps(scene, 2, 9) for _ in range(persons)]

    def step(frame: int) -> None:
        for each in steps:
            each(frame)

    return step


def estimator_steps(scene: Scene, name: str, imus: int) -> Step:
    """A whole estimator, from observation to estimate."""
    parameters = FusionParameters(estimator=name)
    estimation = Estimation(scene.model, parameters, Counters(*tracking_counters(parameters)))
    segments = list(scene.model.segments)[:imus]
    observations = [scene.observation(frame, segments) for frame in range(len(scene.dof))]
    return lambda frame: estimation.take([observations[frame]])


def li2020_steps(scene: Scene) -> Step:
    """The filter of li2020."""
    filter_ = Li2020Filter(scene.model, scene.shape, Li2020Parameters())
    filter_.start(scene.joints[0])
    seen = [scene.seen(frame, 2) for frame in range(len(scene.dof))]
    return lambda frame: filter_.step(PERIOD_S, seen[frame])


def textbook_steps(scene: Scene) -> Step:
    """The same filter, a sigma point at a time."""
    filter_ = textbook_of(scene, Li2020Parameters())
    seen = [scene.seen(frame, 2) for frame in range(len(scene.dof))]
    return lambda frame: filter_.step(PERIOD_S, seen[frame])


def opensim_steps(scene: Scene) -> Step:
    """OpenSim's inverse kinematics on the mean of two cameras' joints."""
    seen = np.stack([scene.seen(frame, 2).mean(axis=0) for frame in range(len(scene.dof))])
    return OpenSimIk(scene.model, scene.shape, seen, 1.0 / PERIOD_S).step


def textbook_of(scene: Scene, parameters: Li2020Parameters) -> TextbookFilter:
    """The textbook's filter, started as that of li2020 starts."""
    started = Li2020Filter(scene.model, scene.shape, parameters)
    started.start(scene.joints[0])
    filter_ = TextbookFilter(
        scene.model, scene.shape, started.kinematics.R_reference.copy(), parameters
    )
    filter_.ukf.x, filter_.ukf.P = started.state
    return filter_


def update_timings(frames: int, slow_frames: int) -> Iterator[Timing]:
    """Every filter on two cameras, the default one with nine IMUs too."""
    scene, paper = (Scene(load_body_model(name), frames) for name in ("default", "li2020"))
    yield measure("default, two Kinects, nine IMUs", segment_steps(scene, 2, 9), frames)
    yield measure("default, two Kinects", segment_steps(scene, 2, 0), frames)
    yield measure(WHOLE, estimator_steps(scene, "default", 9), frames)
    yield measure("li2020, two Kinects", li2020_steps(paper), frames)
    yield measure("joint_kf, two Kinects", estimator_steps(paper, "joint_kf", 0), frames)
    if util.find_spec("opensim") is not None:
        few = Scene(paper.model, max(frames // 5, 20))
        yield measure(OPENSIM, opensim_steps(few), len(few.dof))
    plain = segment_steps(scene, 2, 9, ReferenceFilter)
    yield measure("default in plain numpy, nine IMUs", plain, slow_frames)
    yield measure(TEXTBOOK, textbook_steps(paper), slow_frames)


def growth(frames: int) -> dict[str, list[tuple[int, float]]]:
    """CPU milliseconds per second of data, by number of sensors (30 Hz each) and of IMUs."""
    scene = Scene(load_body_model("default"), frames)
    per_second = 1.0 / PERIOD_S
    sensors = [
        (n, per_second * measure("", segment_steps(scene, n, 9), frames).median_ms)
        for n in (1, 2, 4, 8, 16)
    ]
    imus = [
        (n, 2.0 * per_second * measure("", segment_steps(scene, 1, n), frames).median_ms)
        for n in (0, 1, 2, 4, 9, 17)
    ]
    persons = [
        (n, per_second * measure("", persons_steps(scene, n), frames).median_ms)
        for n in (1, 2, 3, 4, 6)
    ]
    return {"sensors": sensors, "IMUs": imus, "persons": persons}


def exponent(points: list[tuple[int, float]]) -> float:
    """Slope of log cost over log number."""
    n, cost = np.array([point for point in points if point[0] > 0], float).T
    return float(np.polyfit(np.log(n), np.log(cost), 1)[0])


def machine() -> str:
    """The processor and the versions that the times are of."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    versions = ", ".join(f"{p} {metadata.version(p)}" for p in ("numpy", "numba", "scipy"))
    opensim = metadata.version("opensim") if util.find_spec("opensim") else "not installed"
    return f"{model}; Python {platform.python_version()}, {versions}; opensim {opensim}"

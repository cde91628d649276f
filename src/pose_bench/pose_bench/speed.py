"""CPU time of one update of the estimators and the textbook filter, and its growth.

Times are CPU times of the thread, which hardly depend on other load; each is of one call, including
the prediction.
"""

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata, util
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pose_bench.reference.default_filter import ReferenceFilter
from pose_bench.reference.opensim_ik import OpenSimIk
from pose_bench.reference.textbook_ukf import TextbookFilter
from pose_core.arrays import FloatArray
from pose_core.baseline_filters.li2020 import Li2020Filter
from pose_core.body.average_body import neutral_pose
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import BodyModel, load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape, shape_of
from pose_core.counters import Counters
from pose_core.estimates.observation import Observation
from pose_core.estimators.parameters import PipelineParameters
from pose_core.filter.constants import FilterConstants, make_constants
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuFrame
from pose_core.filter.layout import make_layout
from pose_core.filter.motion import predict
from pose_core.filter.state import FilterState, start_state, with_imu, with_shared_offset
from pose_core.filter.step import update_with_frame, update_with_imus
from pose_core.filter.tuning import FilterTuning
from pose_core.fusion.estimator_runner import EstimatorRunner, runner_counters
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.joints import JOINT_INDEX, JOINTS, LIMB_ENDS, TrackingState

FRAMES = 2000  # repeats of an update
SLOW_FRAMES = 60  # the same of filterpy's
GROWTH_FRAMES = 300  # the same of each size, for the growth
WARM_UP = 5  # [frames] not timed
PERIOD_S = 1.0 / 30.0
CAMERA_HEIGHT = 1.2  # [m]
NOISE = 0.02  # [m] of a joint
WHOLE = "default, whole estimator, two Kinects, nine IMUs"
OPENSIM = "OpenSim's inverse kinematics, 15 joints"
TEXTBOOK = "filterpy, Python fx and hx"
TRACKED = np.full(len(JOINTS), int(TrackingState.TRACKED), np.uint8)
Step = Callable[[int], object]
"""One update, of the frame with this number."""


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Times of many calls."""

    name: str
    times_ms: FloatArray  # (calls,)

    @property
    def median_ms(self) -> float:
        """Median time [ms]."""
        return float(np.median(self.times_ms))

    @property
    def p99_ms(self) -> float:
        """99th percentile [ms]."""
        return float(np.percentile(self.times_ms, 99.0))


class Scene:
    """A moving person, measured by any number of cameras and IMUs; deterministic."""

    def __init__(self, model: BodyModel, frames: int) -> None:
        rng = np.random.default_rng(1)
        self.model = model
        self.shape: BodyShape = shape_of(model, neutral_pose())
        t = PERIOD_S * np.arange(frames)[:, None]
        dof = 0.3 * np.sin(2.0 * np.pi * (0.4 * t + rng.random(model.size)))
        dof[:, 2] += 0.9
        pose = ForwardKinematics(model, self.shape.offsets).pose(dof)
        self.dof, self.joints, self.rotations = dof, pose.positions, pose.rotations
        after = np.roll(self.rotations, -1, axis=0)
        turns = Rotation.from_matrix((np.swapaxes(self.rotations, 2, 3) @ after).reshape(-1, 3, 3))
        self.rates = turns.as_rotvec().reshape(frames, -1, 3) / PERIOD_S
        self._noise = rng.normal(0.0, NOISE, (16, *self.joints.shape))

    @property
    def size(self) -> int:
        """Number of frames."""
        return len(self.dof)

    def seen(self, frame: int, sensors: int) -> FloatArray:
        """The joints measured by sensors, (sensors, 15, 3) [m]."""
        return np.ascontiguousarray(self.joints[frame] + self._noise[:sensors, frame])

    def frames(self, frame: int, sensors: int) -> list[CameraFrame]:
        """Camera frames for the default estimator's filter."""
        return [
            CameraFrame(sensor, positions, TRACKED, camera_place(sensor))
            for sensor, positions in enumerate(self.seen(frame, sensors))
        ]

    def imus(self, frame: int, count: int) -> ImuFrame:
        """Measurements of aligned IMUs, one on each of the first links."""
        return ImuFrame(
            links=np.arange(count),
            R_world_sensor=np.ascontiguousarray(self.rotations[frame, :count]),
            angular_velocity=np.ascontiguousarray(self.rates[frame, :count]),
            age_s=np.zeros(count),
            rate_stddev=np.zeros(count),
        )

    def observation(self, frame: int, segments: list[str]) -> Observation:
        """Observation of two cameras and unaligned IMUs, for a whole estimator."""
        names = list(self.model.links)
        links = [names.index(self.model.segments[segment]) for segment in segments]
        stamp_ns = round(1e9 * PERIOD_S * (frame + 1))
        return Observation(
            stamp_ns=stamp_ns,
            newest_ns=stamp_ns,
            shape=self.shape,
            positions=self.seen(frame, 2),
            tracking_state=np.stack([TRACKED, TRACKED]),
            cameras=np.stack([camera_place(0), camera_place(1)]),
            imus=ImuMeasurements(
                segments=tuple(segments),
                R_world_sensor=self.rotations[frame, links],
                angular_velocity=self.rates[frame, links],
                stddev=np.full((len(links), 3), 0.05),
                age_s=np.zeros(len(links)),
            ),
        )


def camera_place(index: int) -> FloatArray:
    """Pose of a camera on a circle around the person."""
    angle = 2.0 * np.pi * index / 16.0
    return np.array([3.0 * np.cos(angle), 3.0 * np.sin(angle), CAMERA_HEIGHT])


def measure(name: str, step: Step, frames: int) -> Timing:
    """Time ``step`` for all frames, without the first :data:`WARM_UP` ones."""
    times = []
    for frame in range(frames):
        start_ns = time.thread_time_ns()
        step(frame)
        times.append((time.thread_time_ns() - start_ns) * 1e-6)
    return Timing(name=name, times_ms=np.array(times[WARM_UP:]))


def aligned_filter(scene: Scene, sensors: int, imus: int) -> tuple[FilterConstants, FilterState]:
    """The default estimator's filter at the first pose, with IMUs that are aligned."""
    tree, tuning = SegmentTree(scene.model, scene.shape), FilterTuning()
    layout = make_layout(len(tree.parents), len(tree.sliding_links))
    constants = make_constants(tree, tuning)
    slide_variance = constants.motion.slide_variance
    state = start_state(
        layout, sensors, tuning, slide_variance, scene.dof[0, :3], scene.rotations[0]
    )
    shared_variance = tuning.camera.shared_offset_stddev**2
    for link in range(imus):
        state = with_imu(state, link, np.eye(3), 0.0, 0.01 * np.eye(4))
        name = scene.model.link_names[link]
        if name in LIMB_ENDS:
            state = with_shared_offset(state, JOINT_INDEX[LIMB_ENDS[name][1]], shared_variance)
    return constants, state


def filter_steps(scene: Scene, sensors: int, imus: int) -> Step:
    """The default estimator's filter: a prediction, the IMUs, each camera's frame."""
    constants, state = aligned_filter(scene, sensors, imus)
    information = np.zeros((2, len(state.imus.heading), 3, 3))
    seen = [(scene.imus(frame, imus), scene.frames(frame, sensors)) for frame in range(scene.size)]

    def step(frame: int) -> None:
        imus, frames = seen[frame]
        predict(constants.motion, state, PERIOD_S)
        update_with_imus(constants, state, imus, information[1])
        for each in frames:
            update_with_frame(constants, state, each, information[0])

    return step


def plain_steps(scene: Scene) -> Step:
    """The default estimator's filter in plain numpy, with two Kinects and nine IMUs."""
    plain = ReferenceFilter(*aligned_filter(scene, 2, 9))

    def step(frame: int) -> None:
        plain.predict(PERIOD_S)
        plain.update_with_imus(scene.imus(frame, 9))
        for each in scene.frames(frame, 2):
            plain.update_with_frame(each)

    return step


def persons_steps(scene: Scene, persons: int) -> Step:
    """Filters of several persons, each with two Kinects and nine IMUs."""
    steps = [filter_steps(scene, 2, 9) for _ in range(persons)]

    def step(frame: int) -> None:
        for each in steps:
            each(frame)

    return step


def estimator_steps(scene: Scene, name: str, imus: int) -> Step:
    """A whole estimator, from observation to estimate."""
    parameters = PipelineParameters(estimator=name, output_rate=0.0)
    runner = EstimatorRunner(scene.model, parameters, Counters(*runner_counters(parameters)))
    segments = list(scene.model.segments)[:imus]
    observations = [scene.observation(frame, segments) for frame in range(scene.size)]

    def step(frame: int) -> None:
        runner.process(observations[frame])
        runner.take()

    return step


def li2020_steps(scene: Scene, filter_: Li2020Filter | TextbookFilter) -> Step:
    """The filter of li2020, or the same with filterpy, on two cameras' joints."""
    seen = [scene.seen(frame, 2) for frame in range(scene.size)]
    return lambda frame: filter_.step(PERIOD_S, seen[frame])


def opensim_steps(scene: Scene) -> Step:
    """OpenSim's inverse kinematics on the mean of two cameras' joints."""
    seen = np.stack([scene.seen(frame, 2).mean(axis=0) for frame in range(scene.size)])
    return OpenSimIk(scene.model, scene.shape, seen, 1.0 / PERIOD_S).step


def li2020_of(scene: Scene) -> Li2020Filter:
    """The filter of li2020 at the first pose."""
    filter_ = Li2020Filter(scene.model, scene.shape)
    filter_.start(scene.joints[0])
    return filter_


def textbook_of(scene: Scene) -> TextbookFilter:
    """The textbook filter with li2020's initial state."""
    started = li2020_of(scene)
    filter_ = TextbookFilter(scene.model, scene.shape, started.kinematics.R_reference.copy())
    filter_.ukf.x, filter_.ukf.P = started.state
    return filter_


def update_timings(frames: int, slow_frames: int) -> Iterator[Timing]:
    """Every filter on two cameras, the default one with nine IMUs too."""
    scene, paper = (Scene(load_body_model(name), frames) for name in ("default", "li2020"))
    yield measure("default, two Kinects, nine IMUs", filter_steps(scene, 2, 9), frames)
    yield measure("default, two Kinects", filter_steps(scene, 2, 0), frames)
    yield measure(WHOLE, estimator_steps(scene, "default", 9), frames)
    li2020 = li2020_of(paper)
    yield measure("li2020, two Kinects", li2020_steps(paper, li2020), frames)
    yield measure("joint_kf, two Kinects", estimator_steps(paper, "joint_kf", 0), frames)
    if util.find_spec("opensim") is not None:
        few = Scene(paper.model, max(frames // 5, 20))
        yield measure(OPENSIM, opensim_steps(few), few.size)
    yield measure("default in plain numpy, nine IMUs", plain_steps(scene), slow_frames)
    textbook = textbook_of(paper)
    yield measure(TEXTBOOK, li2020_steps(paper, textbook), slow_frames)


def growth(frames: int) -> dict[str, list[tuple[int, float]]]:
    """CPU milliseconds per second of data, by number of sensors (30 Hz each), IMUs and persons."""
    scene = Scene(load_body_model("default"), frames)

    def cost(step: Step, rate: float = 1.0 / PERIOD_S) -> float:
        return rate * measure("", step, frames).median_ms

    return {
        "sensors": [(n, cost(filter_steps(scene, n, 9))) for n in (1, 2, 4, 8, 16)],
        "IMUs": [(n, cost(filter_steps(scene, 1, n), 2.0 / PERIOD_S)) for n in (0, 1, 2, 4, 9)],
        "persons": [(n, cost(persons_steps(scene, n))) for n in (1, 2, 3, 4, 6)],
    }


def exponent(points: list[tuple[int, float]]) -> float:
    """Exponent of the cost: slope of log cost over log number."""
    n, cost = np.array([point for point in points if point[0] > 0], float).T
    return float(np.polyfit(np.log(n), np.log(cost), 1)[0])


def machine() -> str:
    """The processor and the versions of the measurement."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    versions = ", ".join(f"{p} {metadata.version(p)}" for p in ("numpy", "numba", "scipy"))
    opensim = metadata.version("opensim") if util.find_spec("opensim") else "not installed"
    return f"{model}; Python {platform.python_version()}, {versions}; opensim {opensim}"

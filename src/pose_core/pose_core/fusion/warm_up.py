"""Warm-up: run an estimator once on a synthetic body, so that its kernels are compiled and loaded.

Compiling them, at the very first start, takes tens of seconds; loading them takes tenths of one.
"""

from collections.abc import Iterator

import numpy as np

from pose_core.body.average_body import neutral_pose
from pose_core.body.frames import BodyFrames
from pose_core.body.model import BodyModel
from pose_core.body.shape import shape_of
from pose_core.counters import Counters
from pose_core.estimates.body_estimates import EstimateBlock
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.estimator_runner import EstimatorMaker, EstimatorRunner, runner_counters
from pose_core.fusion.preprocessor import COUNTERS, Preprocessor
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.joints import JOINTS, TrackingState
from pose_core.kernels.compiling import announce_compilation
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.streams.samples import ImuSample, SkeletonSample
from pose_core.transforms import rigid_transform

PLACES = {"left": (3.0, 0.0, 1.0), "right": (0.0, 3.0, 1.0)}  # [m] of the sensors, not rotated
PERIOD_NS = 33_333_333
FRAMES = 45  # enough to align and use an IMU with a known alignment


_warm: dict[tuple[str, str], EstimateBlock] = {}


def warm_up(estimator: str, model: BodyModel) -> EstimateBlock:
    """Compile or load an estimator's kernels; does nothing the second time.

    Returns:
        The last estimate, as an example.
    """
    key = (estimator, model.name)
    if key not in _warm:
        announce_compilation()
        _warm[key] = run_once(estimator, model) or warm_up("default", model)
    return _warm[key]


def run_once(
    estimator: str, model: BodyModel, make: EstimatorMaker | None = None, *, imus: bool = True
) -> EstimateBlock | None:
    """Run an estimator over a still body; return its last estimates, if any.

    Args:
        estimator: Its name.
        model: The body model.
        make: Factory of the estimator; its class if None.
        imus: Whether there are samples of an IMU.
    """
    # Estimators of a single sensor need its name among the sensors.
    parameters = PipelineParameters(estimator=estimator, sensors=tuple(PLACES), output_rate=0.0)
    counters = Counters(*COUNTERS, *runner_counters(parameters))
    poses = {sensor: rigid_transform(np.eye(3), place) for sensor, place in PLACES.items()}
    preprocessor = Preprocessor(model, parameters, counters)
    preprocessor.use_extrinsics(extrinsics_from_map(poses))
    preprocessor.shape = shape_of(model, neutral_pose())
    runner = EstimatorRunner(model, parameters, counters, make)
    segment = next(iter(model.segments))
    known = SensorToSegment(R_sensor_segment=np.eye(3), stddev=np.full(3, 0.05))
    runner.use_sensor_to_segment({segment: known})
    example: EstimateBlock | None = None
    for frame in range(1, FRAMES + 1):
        stamp_ns = frame * PERIOD_NS
        for sample in _samples(stamp_ns, segment if imus else ""):
            for observation in preprocessor.add(sample):
                runner.process(observation)
        for block in runner.take():
            example = block
            instants = (block.T_map_link, block.position, block.fk_joints)
            BodyFrames(model, parameters.subject).places(*instants)
    runner.interpolate((stamp_ns - PERIOD_NS // 2,), stamp_ns)
    stamp_ns = (FRAMES + 1) * PERIOD_NS
    runner.predict(stamp_ns, stamp_ns, preprocessor.imus_at(stamp_ns))
    runner.flush(stamp_ns)
    return next(iter(runner.take()), example)


def _samples(stamp_ns: int, segment: str) -> Iterator[ImuSample | SkeletonSample]:
    """Samples of an IMU, if there is one, and of all cameras at one instant [ns]."""
    if segment:
        yield ImuSample(
            stamp_ns=stamp_ns,
            segment=segment,
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            orientation_stddev=np.full(3, 0.05),
            angular_velocity=np.zeros(3),
        )
    for sensor, place in PLACES.items():
        yield SkeletonSample(
            stamp_ns=stamp_ns,
            sensor=sensor,
            person="",
            positions=neutral_pose() - place,
            tracking_state=np.full(len(JOINTS), int(TrackingState.TRACKED), np.uint8),
        )

"""Runs an estimator once before anybody is there, so that nobody waits for its kernels later.

Compiling them, at the very first start, takes tens of seconds; loading them takes tenths of one.
"""

from functools import cache

import numpy as np

from pose_core.body.frames import BodyFrames
from pose_core.body.model import load_body_model
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.fusion.observation import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.seen import SensorsInMap
from pose_core.fusion.telling import Telling
from pose_core.fusion.tracking import Tracking, tracking_counters
from pose_core.imu.imu_set import ImuSet
from pose_core.imu.mounting import Mounting
from pose_core.imu.track import ImuStates
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.kernels.compiling import say_if_compiling
from pose_core.session.extrinsics import Extrinsics, extrinsics_from_map
from pose_core.session.neutral_stand import shape_of
from pose_core.streams.samples import FloatArray, ImuSample, SkeletonSample, block_of
from pose_core.streams.time_alignment import AlignedFrame

NEUTRAL = {  # [m] from the middle of the hips, x forward, y left, z up: about anybody
    "head": (0.0, 0.0, 0.75),
    "neck": (0.0, 0.0, 0.52),
    "torso": (0.0, 0.0, 0.25),
    "shoulder": (0.0, 0.18, 0.48),
    "elbow": (0.0, 0.18, 0.2),
    "hand": (0.0, 0.18, -0.05),
    "hip": (0.0, 0.09, 0.0),
    "knee": (0.0, 0.09, -0.43),
    "foot": (0.0, 0.09, -0.85),
}
PLACES = {"left": (3.0, 0.0, 1.0), "right": (0.0, 3.0, 1.0)}  # [m] of the sensors, not turned
PERIOD_NS = 33_333_333
FRAMES = 45  # enough for an IMU whose mounting is known to be aligned and used


def neutral_pose() -> FloatArray:
    """Joints of a body in the N-pose, shape (15, 3) [m]."""
    joints = np.zeros((len(JOINTS), 3))
    for joint, row in JOINT_INDEX.items():
        side, _, name = joint.partition("_")
        joints[row] = NEUTRAL[name or side]
        if side == "right":
            joints[row, 1] *= -1.0
    return joints


@cache
def prepare(estimator: str, model_name: str) -> None:
    """Have an estimator's kernels ready; does nothing the second time.

    Args:
        estimator: Its name.
        model_name: Of the body model.
    """
    say_if_compiling()
    model = load_body_model(model_name)
    shape = shape_of(model, neutral_pose())
    # The estimator that shows one sensor alone wants its name among the sensors'.
    parameters = FusionParameters(estimator=estimator, sensors=tuple(PLACES))
    sensors = SensorsInMap(parameters.sensors, _extrinsics())
    counters = Counters(*tracking_counters(parameters))
    tracking, telling = Tracking(model, parameters, counters), Telling(model, parameters)
    segment = next(iter(model.segments))
    known = Mounting(R_sensor_segment=np.eye(3), stddev=np.full(3, 0.05), residual=0.0)
    tracking.use_mountings({segment: known})
    imus = ImuSet()
    for frame in range(1, FRAMES + 1):
        stamp_ns = frame * PERIOD_NS
        imus.add(block_of(_imu_sample(segment, stamp_ns)))
        poses = tracking.take(_observation(sensors, shape, stamp_ns, imus.read(stamp_ns)))
        if poses is not None:
            block = telling.tell(poses, shape)
            instants = (block.T_map_link, block.position, block.joints)
            BodyFrames(model, parameters.subject).places(*instants)
    stamp_ns = (FRAMES + 1) * PERIOD_NS
    ahead = tracking.predict(stamp_ns, stamp_ns, imus.read(stamp_ns))
    if ahead is not None:
        telling.tell_ahead(ahead)


def _extrinsics() -> Extrinsics:
    T_map_sensor = {sensor: np.eye(4) for sensor in PLACES}
    for sensor, place in PLACES.items():
        T_map_sensor[sensor][:3, 3] = place
    return extrinsics_from_map(T_map_sensor)


def _imu_sample(segment: str, stamp_ns: int) -> ImuSample:
    return ImuSample(
        stamp_ns=stamp_ns,
        segment=segment,
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        orientation_stddev=np.full(3, 0.05),
        angular_velocity=np.zeros(3),
    )


def _observation(
    sensors: SensorsInMap, shape: BodyShape, stamp_ns: int, readings: ImuStates
) -> Observation:
    samples = {
        sensor: SkeletonSample(
            stamp_ns=stamp_ns,
            sensor=sensor,
            person="",
            positions=neutral_pose() - PLACES[sensor],
            tracking_state=np.full(len(JOINTS), int(TrackingState.TRACKED), np.uint8),
        )
        for sensor in PLACES
    }
    seen = sensors.see(AlignedFrame(stamp_ns=stamp_ns, samples=samples))
    return Observation(
        stamp_ns=stamp_ns,
        newest_ns=stamp_ns,
        shape=shape,
        positions=seen.positions,
        tracking_state=seen.tracking_state,
        cameras=sensors.places,
        readings=readings,
    )

"""Runs an estimator once before anybody is there, so that nobody waits for its kernels later.

Compiling them, at the very first start, takes tens of seconds; loading them takes tenths of one.
"""

from functools import cache

import numpy as np

from pose_core.body.frames import BodyFrames
from pose_core.body.model import BodyModel, load_body_model
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.fusion.learning import COUNTERS, FrameLearner
from pose_core.fusion.observation_block import Observation, block_of_observations
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.seen import SensorsInMap
from pose_core.fusion.telling import Telling
from pose_core.fusion.tracking import Tracking, tracking_counters
from pose_core.imu.imu_set import ImuSet
from pose_core.imu.readings import SegmentReading, readings_of
from pose_core.imu.segment_alignment import AlignmentRows, SegmentAlignment
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.kernels.compiling import say_if_compiling
from pose_core.kernels.heading import relate
from pose_core.session.extrinsics import extrinsics_from_map
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
FRAMES = 3
PERIOD_NS = 33_333_333


def neutral_pose() -> FloatArray:
    """Joints of a body in the neutral pose, shape (15, 3) [m]."""
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
    parameters = FusionParameters(estimator=estimator, sensors=("left", "right"))
    counters = Counters(*tracking_counters(parameters))
    tracking, telling = Tracking(model, parameters, counters), Telling(model, parameters)
    for frame in range(1, FRAMES + 1):
        seen = _observation(model, shape, frame * PERIOD_NS)
        poses = tracking.take(block_of_observations([seen]), shape)
        if poses is not None:
            block = telling.tell(poses, shape)
            instants = (block.T_map_link, block.position, block.joints)
            BodyFrames(model, parameters.subject).places(*instants)
    _prepare_learning(model, shape, parameters)
    _prepare_rare()


def _prepare_rare() -> None:
    """What is called once in a while only: a heading that is lent, or told by a joint."""
    rows = AlignmentRows()
    alignment = SegmentAlignment(rows)
    alignment.anchor.reset()
    if not alignment.is_mounted:
        alignment.anchor.start(0.0, 1.0)
    relate(rows.anchors, 0, 0, 0.0, 1.0, 1.0)


def _prepare_learning(model: BodyModel, shape: BodyShape, parameters: FusionParameters) -> None:
    imus = ImuSet(model)
    for sample in range(1, FRAMES + 1):
        imus.add(
            block_of(
                ImuSample(
                    stamp_ns=sample * PERIOD_NS,
                    segment=next(iter(model.segments)),
                    orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                    orientation_stddev=np.full(3, 0.05),
                    angular_velocity=np.zeros(3),
                )
            )
        )
    stamp_ns = FRAMES * PERIOD_NS
    samples = {
        sensor: SkeletonSample(
            stamp_ns=stamp_ns,
            sensor=sensor,
            person="",
            positions=neutral_pose(),
            tracking_state=np.full(len(JOINTS), int(TrackingState.TRACKED), np.uint8),
        )
        for sensor in parameters.sensors
    }
    extrinsics = extrinsics_from_map(dict.fromkeys(parameters.sensors, np.eye(4)))
    seen = SensorsInMap(parameters.sensors, extrinsics).see(
        AlignedFrame(stamp_ns=stamp_ns, samples=samples)
    )
    counters = Counters(*COUNTERS)
    FrameLearner(model, parameters, imus, counters, takes_offsets=False).learn(seen, shape)
    imus.read(stamp_ns)


def _observation(model: BodyModel, shape: BodyShape, stamp_ns: int) -> Observation:
    segment = next(iter(model.segments))
    reading = SegmentReading(
        R_map_segment=np.eye(3), angular_velocity=np.zeros(3), stddev=np.full(3, 0.05)
    )
    return Observation(
        stamp_ns=stamp_ns,
        newest_ns=stamp_ns,
        shape=shape,
        positions=np.stack([neutral_pose(), neutral_pose()]),
        tracking_state=np.full((2, len(JOINTS)), int(TrackingState.TRACKED), np.uint8),
        cameras=np.array([[3.0, 0.0, 1.0], [0.0, 3.0, 1.0]]),
        offsets=np.zeros((2, len(JOINTS), 3)),
        readings=readings_of({segment: reading}),
    )

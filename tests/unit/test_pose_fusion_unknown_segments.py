"""An IMU on a segment that the body model does not have disturbs no other."""

import numpy as np

from pose_core.body.model import load_body_model
from pose_core.counters import Counters
from pose_core.fusion.estimation import Estimation
from pose_core.fusion.observation_block import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.preparing import neutral_pose
from pose_core.fusion.tracking import tracking_counters
from pose_core.imu.readings import SegmentReading, readings_of
from pose_core.joints import JOINTS, TrackingState
from pose_core.session.neutral_stand import shape_of

MODEL = load_body_model("default")


def angles(readings):
    """What the estimator says after a few frames of a person who stands."""
    parameters = FusionParameters(sensors=("left",))
    shape = shape_of(MODEL, neutral_pose())
    estimation = Estimation(MODEL, parameters, Counters(*tracking_counters(parameters)))
    for frame in range(1, 5):
        observation = Observation(
            stamp_ns=frame * 33_000_000,
            newest_ns=frame * 33_000_000,
            shape=shape,
            positions=neutral_pose()[None],
            tracking_state=np.full((1, len(JOINTS)), int(TrackingState.TRACKED), np.uint8),
            cameras=np.array([[3.0, 0.0, 1.0]]),
            offsets=np.zeros((1, len(JOINTS), 3)),
            readings=readings_of(readings),
        )
        [block] = estimation.take([observation])
    return block.position[0]


def reading(turn):
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return SegmentReading(R_map_segment=R, angular_velocity=np.zeros(3), stddev=np.full(3, 0.02))


def test_an_imu_on_a_segment_that_the_model_does_not_have_changes_nothing():
    known = {"left_thigh": reading(-0.5), "torso": reading(0.0)}
    alone = angles(known)
    np.testing.assert_array_equal(angles({"tail": reading(1.0), **known}), alone)
    assert np.abs(alone - angles({})).max() > np.radians(5.0)

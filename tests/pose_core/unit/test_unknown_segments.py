"""An IMU on a segment that the body model does not have disturbs no other."""

import numpy as np

from pose_core.body.average_body import neutral_pose
from pose_core.body.model import load_body_model
from pose_core.body.shape import shape_of
from pose_core.counters import Counters
from pose_core.estimates.observation import Observation
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.estimator_runner import EstimatorRunner, runner_counters
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.joints import JOINTS, TrackingState

MODEL = load_body_model("default")
FRAMES = 150  # enough for IMUs whose alignment is known to be aligned


def run(readings):
    """An estimator that has seen a person stand, with these IMUs turning in the end; its angles."""
    parameters = PipelineParameters(sensors=("left",))
    shape = shape_of(MODEL, neutral_pose())
    runner = EstimatorRunner(MODEL, parameters, Counters(*runner_counters(parameters)))
    known = SensorToSegment(R_sensor_segment=np.eye(3), stddev=np.full(3, 0.05))
    runner.use_sensor_to_segment(dict.fromkeys(readings, known))
    for frame in range(1, FRAMES + 4):
        share = max(0, frame - FRAMES) / 3.0
        observation = Observation(
            stamp_ns=frame * 33_000_000,
            newest_ns=frame * 33_000_000,
            shape=shape,
            positions=neutral_pose()[None],
            tracking_state=np.full((1, len(JOINTS)), int(TrackingState.TRACKED), np.uint8),
            cameras=np.array([[3.0, 0.0, 1.0]]),
            imus=measured({name: share * turn for name, turn in readings.items()}),
        )
        runner.process(observation)
    angles = runner.estimator._filter.state.pose.rotations
    return runner, angles.ravel()


def about_y(turn):
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def measured(turns):
    count = len(turns)
    return ImuMeasurements(
        segments=tuple(turns),
        R_world_sensor=np.array([about_y(turn) for turn in turns.values()]).reshape(-1, 3, 3),
        angular_velocity=np.zeros((count, 3)),
        stddev=np.full((count, 3), 0.02),
        age_s=np.zeros(count),
    )


def test_an_imu_on_a_segment_unknown_to_the_model_is_reported_and_not_used():
    known = {"left_thigh": -0.5, "torso": 0.4}
    _, alone = run(known)
    runner, angles = run({"tail": 1.0, **known})
    np.testing.assert_array_equal(angles, alone)
    assert np.abs(alone - run({})[1]).max() > np.radians(3.0)
    (tail,) = [use for use in runner.estimator.imu_uses if use.segment == "tail"]
    assert tail.frames_used == 0
    assert "no link for this segment: wear it on, or name, another one" in str(tail)

"""What is known of the IMUs of one body."""

import numpy as np
import pytest

from pose_core.body.model import load_body_model
from pose_core.filter.imu_alignments import ImuAlignments
from pose_core.filter.tuning import FilterTuning
from pose_core.imu.sensor_to_segment import SensorToSegment


@pytest.fixture
def alignments():
    return ImuAlignments(load_body_model("default"), FilterTuning())


def calibrated(**details):
    return SensorToSegment(R_sensor_segment=np.eye(3), stddev=np.full(3, 0.05), **details)


def test_what_a_wrong_state_told_is_forgotten_with_it(alignments):
    alignments.z_down = frozenset({"left_thigh", "torso"})  # seen in a mirror, up is down

    alignments.restart(discard=True)

    assert alignments.z_down == frozenset()


def test_what_a_calibration_told_outlives_a_wrong_state(alignments):
    alignments.use_sensor_to_segment({"left_thigh": calibrated(z_down=True)})
    alignments.z_down |= {"torso"}

    alignments.restart(discard=True)

    assert alignments.z_down == {"left_thigh"}


def test_after_a_gap_the_sensors_are_as_before(alignments):
    alignments.z_down = frozenset({"left_thigh"})

    alignments.restart()

    assert alignments.z_down == {"left_thigh"}

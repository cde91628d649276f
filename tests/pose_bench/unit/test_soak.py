"""The endurance benchmarks: a session with stamps that go on, and random steps of the filter."""

from collections import Counter

import numpy as np
import pytest

from pose_bench.random_steps import random_steps
from pose_bench.repeated_messages import LOOP_NS, VISITOR, in_loop
from pose_bench.replayed_person import captured_person
from pose_bench.tools.soak import Measurement, broken_bounds
from pose_bench.tools.soak_recording import STEP_NS, steps_of
from pose_bench.tools.soak_session import LiveSession
from pose_core.api import extrinsics_from_map
from pose_core.stamps import serialized_ns
from pose_io.cdr.skeleton_bytes import SkeletonReader
from pose_sim.captured.session import START_NS


@pytest.fixture(scope="module")
def person():
    return captured_person()


@pytest.fixture(scope="module")
def recording(person):
    return steps_of(person, is_light=False)


def test_a_repeated_message_has_the_stamps_and_the_visitor_of_its_loop(recording):
    _, visited = recording
    source, data = next(each for step in visited for each in step if VISITOR in each[1])

    (persons,) = SkeletonReader(source).read([in_loop(data, START_NS + LOOP_NS, 7)])

    assert [person.person for person in persons] == ["1", "00000007"]
    stamps_ns = {person.stamp_ns for person in persons}
    assert stamps_ns == {serialized_ns(data) + LOOP_NS}
    assert VISITOR in data  # is left as it was


def test_a_light_recording_has_a_third_of_the_frames_and_a_quarter_of_two_imus_samples(
    person, recording
):
    def counts(steps):
        return Counter(source for step in steps for source, _ in step)

    whole, light = counts(recording[0]), counts(steps_of(person, is_light=True)[0])
    assert set(light) == {"left", "right", "imu/torso", "imu/right_thigh"}
    for source, count in light.items():
        share = 0.25 if source.startswith("imu/") else 1.0 / 3.0
        assert count == pytest.approx(share * whole[source], rel=0.05)


def test_a_session_publishes_at_the_output_rate(person, recording):
    session = LiveSession(extrinsics_from_map(person.T_map_sensor), output_rate=100.0)
    session.kept = []
    for index, messages in enumerate(recording[0][:500]):
        session.step(messages, START_NS + (index + 1) * STEP_NS)

    bodies = session.take_kept()
    assert session.outputs == len(bodies.stamps_ns) > 250  # the body is measured for two seconds
    assert set(np.diff(bodies.stamps_ns).tolist()) == {STEP_NS}
    assert np.isfinite(bodies.values).all()
    assert session.bytes > 1000 * session.outputs


def measurement(hours, **values):
    usual = {"taken_s": 1.0, "memory_mb": 400.0, "files": 6, "threads": 3, "outputs": 1}
    return Measurement(hours=hours, rmse_deg=5.0, **{**usual, **values})


@pytest.mark.parametrize(
    ("last", "broken"),
    [
        ({"memory_mb": 407.0}, []),
        ({"memory_mb": 409.0}, ["memory"]),
        ({"files": 7}, ["open files"]),
        ({"threads": 4}, ["threads"]),
    ],
)
def test_growth_is_measured_from_the_first_hour_on(last, broken):
    measured = [measurement(0.5, memory_mb=300.0), measurement(1.0), measurement(24.0, **last)]
    assert broken_bounds(measured) == broken


def test_random_steps_leave_the_covariance_symmetric_and_positive_definite():
    *_, checks = random_steps(2000, seed=3)

    assert checks.steps == 2000
    assert checks.factorised == 200
    assert checks.indefinite == checks.infinite == 0
    assert checks.asymmetry < 1e-12
    assert checks.least > 0.0

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.protocols.star import StarParser
from pose_sim.body import Body
from pose_sim.choreography import compose
from pose_sim.imu_file import encode_all
from pose_sim.imu_noise import CLEAN, TYPICAL
from pose_sim.virtual_imu import NODES, earth_field, measure, mount, to_frames

HEADING = 0.8  # [rad] of map's x, from east
FIELD = earth_field(CLEAN, HEADING)


@pytest.fixture(scope="module")
def motion():
    return compose("leg_lift_jump", 26.0, 3, heading=0.4)


def mounted(parameters, seed=0):
    return mount(Body(), parameters, np.random.default_rng(seed))


def measured(motion, node_id, parameters, seed=0):
    alignment = mounted(parameters, seed)[node_id]
    return alignment, measure(motion, alignment, FIELD, parameters, np.random.default_rng(seed))


@pytest.mark.parametrize("node_id", NODES)
def test_a_node_at_rest_measures_gravity_upwards_and_no_rotation(motion, node_id):
    alignment, said = measured(motion, node_id, replace(CLEAN, misalignment_max=20.0))
    still = said.sample_s < 2.0
    heading = Rotation.from_euler("z", 0.4)
    up = (heading * alignment.R_segment_sensor).apply(said.specific_force[still])
    assert np.allclose(up, (0.0, 0.0, 9.80665), atol=1e-3)
    assert np.abs(said.angular_velocity[still]).max() < 1e-6


@pytest.mark.parametrize("node_id", [1, 3, 6, 7])
def test_the_integrated_gyroscope_reproduces_the_segments_rotation(motion, node_id):
    alignment, said = measured(motion, node_id, replace(CLEAN, misalignment_max=20.0))
    path = motion.segment(alignment.segment, alignment.place)
    true = path.rotation(said.sample_s) * alignment.R_segment_sensor
    step = np.diff(said.sample_s)[:, None]
    middle = 0.5 * (said.angular_velocity[1:] + said.angular_velocity[:-1])
    now = true[0]
    largest = 0.0
    for index, turn in enumerate(Rotation.from_rotvec(middle * step), start=1):
        now = now * turn
        largest = max(largest, (now.inv() * true[index]).magnitude())
    assert np.degrees(largest) < 0.5


def test_the_twice_integrated_accelerometer_reproduces_the_points_path(motion):
    alignment, said = measured(motion, 7, CLEAN)
    path = motion.segment(alignment.segment, alignment.place)
    force = path.rotation(said.sample_s).apply(said.specific_force)
    acceleration = force - (0.0, 0.0, 9.80665)
    step = np.diff(said.sample_s)[:, None]
    velocity = np.cumsum(0.5 * (acceleration[1:] + acceleration[:-1]) * step, axis=0)
    place = np.cumsum(velocity * step, axis=0)
    true = path.position(said.sample_s)
    assert np.abs(place - (true[1:] - true[0])).max() < 0.1


@pytest.mark.parametrize("node_id", [1, 4, 9])
def test_the_magnetometer_measures_the_earths_field_in_its_axes(motion, node_id):
    alignment, said = measured(motion, node_id, replace(CLEAN, misalignment_max=20.0))
    path = motion.segment(alignment.segment, alignment.place)
    in_map = (path.rotation(said.sample_s) * alignment.R_segment_sensor).apply(said.magnetic_field)
    assert np.allclose(in_map, FIELD, atol=1e-12)
    in_enu = Rotation.from_euler("z", HEADING).apply(in_map)
    assert np.allclose(in_enu[:, 0], 0.0, atol=1e-12)
    assert np.all(in_enu[:, 1] > 0.0)
    dip = np.degrees(np.arctan2(-in_enu[:, 2], in_enu[:, 1]))
    assert np.allclose(dip, CLEAN.field_dip)


def test_the_field_is_disturbed_by_the_given_amount(motion):
    parameters = replace(CLEAN, disturbance=5.0)
    norms = []
    for node_id in NODES:
        _, said = measured(motion, node_id, parameters, seed=node_id)
        norms.append(np.linalg.norm(said.magnetic_field, axis=1))
        assert np.ptp(norms[-1]) < 1e-10
    assert np.std([norm[0] for norm in norms]) > 1e-6


def test_nodes_are_strapped_on_crooked_within_the_limits():
    angles = [
        np.degrees(node.R_segment_sensor.magnitude())
        for seed in range(20)
        for node in mounted(TYPICAL, seed).values()
    ]
    assert min(angles) >= 5.0
    assert max(angles) <= 20.0
    assert max(angles) - min(angles) > 10.0


def test_biases_and_noise_have_the_given_sizes(motion):
    parameters = replace(CLEAN, gyroscope_bias=2.0, accelerometer_noise=0.1, gyroscope_noise=0.3)
    alignment, said = measured(motion, 1, parameters)
    still = said.sample_s < 2.4
    gyroscope = np.degrees(said.angular_velocity[still])
    assert np.allclose(gyroscope.mean(axis=0), np.degrees(alignment.gyroscope_bias), atol=0.15)
    assert gyroscope.std() > 0.2
    assert said.specific_force[still].std(axis=0) == pytest.approx(0.1, rel=0.25)


def test_each_node_samples_at_100_hz_on_its_own_clock(motion):
    fits = []
    for node_id in (1, 2):
        _, said = measured(motion, node_id, TYPICAL, seed=node_id)
        assert np.allclose(np.diff(said.sample_s), 0.01, rtol=1e-3)
        fits.append(np.polyfit(said.sample_s, said.clock_us * 1e-6, 1))
    assert abs(fits[0][0] - fits[1][0]) > 1e-7
    assert abs(fits[0][1] - fits[1][1]) > 1.0


def test_what_goes_over_the_wire_decodes_to_what_was_measured(motion):
    said = {node_id: measured(motion, node_id, TYPICAL, seed=node_id)[1] for node_id in NODES}
    frames = to_frames(said, TYPICAL, np.random.default_rng(0))
    parser = StarParser()
    samples = parser.parse(b"".join(encode_all(frames)))
    assert len(samples) == sum(len(node.sample_s) for node in said.values())
    assert parser.counters["bytes_skipped"] == 0
    assert np.all(np.diff(frames.due_ns) >= 0)
    for node_id, node in said.items():
        own = [sample for sample in samples if sample.node_id == node_id]
        assert (
            np.abs(np.array([r.angular_velocity for r in own]) - node.angular_velocity).max() < 6e-4
        )
        assert np.abs(np.array([r.acceleration for r in own]) - node.specific_force).max() < 2e-3
        assert np.abs(np.array([r.magnetic_field for r in own]) - node.magnetic_field).max() < 2e-7
        sequence = np.array([sample.sequence for sample in own])
        assert np.all(np.diff(sequence) % 65536 == 1)


def test_no_measurement_leaves_the_sensors_ranges(motion):
    for node_id in NODES:
        _, said = measured(motion, node_id, TYPICAL)
        assert np.abs(said.specific_force).max() < 8 * 9.8
        assert np.degrees(np.abs(said.angular_velocity)).max() < 2000.0

"""WitMotion's packets: bytes computed by hand, and an emulator from the datasheet."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.protocols.witmotion import WitMotionParser
from pose_sim.uart import received
from pose_sim.witmotion_device import packets

ALL = (0x50, 0x51, 0x52, 0x53, 0x54, 0x59)
# 1 g along z is 2048 counts at 16 g / 32768; 0x55 + 0x51 + 0x08 = 0xae.
GRAVITY = bytes.fromhex("55 51 0000 0000 0008 0000 ae")
# 2000 deg/s / 32768 a count: 0x4000 is 1000 deg/s about x; 0x55 + 0x52 + 0x40 = 0xe7.
TURN = bytes.fromhex("55 52 0040 0000 0000 0000 e7")


def moving(k: int) -> dict[str, Any]:
    turned = Rotation.from_euler("xyz", [0.1, -0.7, 0.02 * k])
    return {
        "acceleration": [0.5, -9.0, 0.01 * k],
        "angular_velocity": [0.1 * (k % 50), -2.0, 0.3],
        "magnetic_field": [2e-5, -1e-5, -4e-5],
        "orientation": turned.as_quat(),
        "roll_pitch_yaw": [0.1, -0.7, 0.02 * k],
        "time_us": 43_200_000_000 + 10_000 * k,
    }


def stream(count: int, content: tuple[int, ...] = ALL) -> bytes:
    return b"".join(packets(**moving(k), content=content) for k in range(count))


def test_golden_packets_are_one_g_and_a_thousand_degrees_a_second():
    parser = WitMotionParser()
    (reading,) = list(parser.parse(GRAVITY + TURN)) + list(parser.finish())
    np.testing.assert_allclose(reading.acceleration, [0, 0, 9.80665])
    np.testing.assert_allclose(reading.angular_velocity, [np.radians(1000), 0, 0])
    assert (reading.magnetic_field, reading.clock_us, reading.orientation) == (None, None, None)


def test_every_quantity_comes_through_in_si_units():
    readings = WitMotionParser().parse(stream(12))
    for k, reading in enumerate(readings):
        sent = moving(k)
        np.testing.assert_allclose(reading.acceleration, sent["acceleration"], atol=3e-3)
        np.testing.assert_allclose(reading.angular_velocity, sent["angular_velocity"], atol=1e-3)
        np.testing.assert_allclose(reading.magnetic_field, sent["magnetic_field"], atol=1e-7)
        np.testing.assert_allclose(reading.orientation, sent["orientation"], atol=1e-4)
        assert reading.clock_us == sent["time_us"]


def test_angles_make_an_orientation_where_no_quaternion_is_sent():
    (reading,) = WitMotionParser().parse(stream(2, (0x51, 0x52, 0x53)))[:1]
    expected = Rotation.from_euler("ZYX", [0.0, -0.7, 0.1])
    assert (Rotation.from_quat(reading.orientation) * expected.inv()).magnitude() < 1e-3


def test_a_sample_does_not_wait_for_the_next_sampling():
    parser = WitMotionParser()
    parser.parse(stream(2, (0x51, 0x52, 0x54)))  # it has seen by now what a sampling holds
    assert len(parser.parse(packets(**moving(2)))) == 1


@pytest.mark.parametrize("size", [1, 7, 11, 100])
def test_half_packets_are_put_together(size: int):
    data, parser = stream(30), WitMotionParser()
    readings = [
        reading
        for start in range(0, len(data), size)
        for reading in parser.parse(data[start : start + size])
    ] + list(parser.finish())
    assert len(readings) == 30
    assert parser.counters["bytes_skipped"] == 0


def test_garbage_between_packets_costs_no_sample():
    parser, rng = WitMotionParser(), np.random.default_rng(1)
    data = b"".join(rng.bytes(int(rng.integers(0, 9))) + packets(**moving(k)) for k in range(200))
    assert len(list(parser.parse(data)) + list(parser.finish())) == 200
    assert parser.counters["frames"] * 11 + parser.counters["bytes_skipped"] == len(data)


def test_a_corrupted_packet_costs_its_own_sample_and_is_counted():
    data = bytearray(stream(5, (0x51, 0x52)))
    data[2 * 22 + 4] ^= 0x10
    parser = WitMotionParser()
    assert len(list(parser.parse(bytes(data))) + list(parser.finish())) == 4
    assert parser.counters["checksum_errors"] >= 1
    assert parser.counters["incomplete_samples"] == 1


def test_a_lost_last_packet_costs_the_field_of_its_own_sample_alone():
    content = (0x51, 0x52, 0x54)
    data = stream(3, content) + packets(**moving(3), content=content[:2]) + stream(3, content)
    parser = WitMotionParser()
    readings = list(parser.parse(data)) + list(parser.finish())
    assert [reading.magnetic_field is None for reading in readings] == [False] * 3 + [
        True,
        *[False] * 3,
    ]


def test_packets_of_other_kinds_are_passed_over():
    body = bytes([0x55, 0x56, *range(8)])
    data = packets(**moving(0)) + body + bytes([sum(body) & 0xFF]) + packets(**moving(1))
    parser = WitMotionParser()
    assert len(list(parser.parse(data)) + list(parser.finish())) == 2
    assert parser.counters["other_packets"] == 1


def test_a_saturated_axis_is_detected():
    fast = packets(acceleration=[0, 0, 9.8], angular_velocity=[50.0, 0, 0])
    parser = WitMotionParser()
    parser.parse(fast)
    assert [reading.saturated for reading in parser.finish()] == [True]


@pytest.mark.parametrize("baud", [9600, 38400, 57600, 230400, 921600])
def test_another_baud_rate_gives_bytes_and_no_packet(baud: int):
    garbled = received(stream(60), 115200, baud)
    parser = WitMotionParser()
    assert parser.parse(garbled) == []
    assert len(garbled) > 100
    assert parser.counters["frames"] == 0

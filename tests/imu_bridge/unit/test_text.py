"""Lines of numbers, their fields named in the nodes file."""

import numpy as np
import pytest

from imu_bridge.protocols.text import TextParser, line_format
from pose_core.errors import InputError
from pose_sim.text_device import FIELDS, UNITS, line

SIX = ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"]


def parser(fields=FIELDS, units=UNITS, **options) -> TextParser:
    return TextParser(line_format({"fields": list(fields), "units": units, **options}))


def read(parser_: TextParser, data: bytes) -> list:
    """What the parser reads behind the line that the stream begins in."""
    return list(parser_.parse(b"rest of a line\r\n" + data))


def test_every_quantity_comes_through_in_si_units():
    data = line(1_234_000, [1.0, -9.8, 0.1], [0.5, -20.0, 0.0], [2e-5, -1e-5, -4e-5])
    (reading,) = read(parser(), data)
    np.testing.assert_allclose(reading.acceleration, [1.0, -9.8, 0.1], atol=6e-3)
    np.testing.assert_allclose(reading.angular_velocity, [0.5, -20.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(reading.magnetic_field, [2e-5, -1e-5, -4e-5], atol=1e-9)
    assert reading.clock_us == 1_234_000


def test_a_prefix_marks_the_lines_that_count():
    razor = parser(SIX, {"acc": "mg", "gyro": "rad/s"}, prefix="#A-C=")
    readings = read(razor, b"#YPR=1,2,3\n#A-C=0,0,1000, 0.1, 0.2, 0.3\n")
    (reading,) = readings
    np.testing.assert_allclose(reading.acceleration, [0, 0, 9.80665])
    assert reading.angular_velocity == (0.1, 0.2, 0.3)
    assert (reading.magnetic_field, reading.clock_us) == (None, None)
    assert razor.counters["other_lines"] == 1


def test_fields_can_be_ignored_turned_round_and_scaled_from_counts():
    reader = parser(
        ["_", "acc_y", "-acc_x", "acc_z", "gyro_x", "gyro_y", "gyro_z", "node"],
        {"acc": 0.0383, "gyro": 0.001},
    )
    (reading,) = read(reader, b"77\t1\t2\t256\t10\t20\t30\t5\n")
    np.testing.assert_allclose(reading.acceleration, [-0.0766, 0.0383, 9.8048])
    np.testing.assert_allclose(reading.angular_velocity, [0.01, 0.02, 0.03])
    assert reading.node_id == 5


@pytest.mark.parametrize("size", [1, 5, 64])
def test_half_lines_are_put_together(size: int):
    data = b"\n" + b"".join(
        line(10_000 * k, [0, 0, 9.8], [0, 0, 0.1], [0, 0, 0]) for k in range(20)
    )
    reader = parser()
    readings = [r for i in range(0, len(data), size) for r in reader.parse(data[i : i + size])]
    assert [reading.clock_us for reading in readings] == [10_000 * k for k in range(20)]


def test_the_incomplete_first_line_of_a_stream_is_ignored():
    whole = line(123_456_000, [0, 0, 9.8], [0, 0, 0], [0, 0, 0])
    reader = parser()
    readings = reader.parse(whole[3:] + whole)  # "456,…" would be a valid line
    assert [reading.clock_us for reading in readings] == [123_456_000]
    assert reader.counters["bytes_skipped"] == len(whole) - 3


@pytest.mark.parametrize(
    "bad", [b"1,2,3\n", b"0,0,0,0,0,0,nan,0,0,0\n", b"0,0,x,0,0,0,0,0,0,0\n", b"\xff\x00\xfe\n"]
)
def test_garbage_is_counted_and_costs_no_other_line(bad: bytes):
    good = line(0, [0, 0, 9.8], [0, 0, 0], [0, 0, 0])
    reader = parser()
    assert len(read(reader, bad + good)) == 1
    assert reader.counters["bad_lines"] == 1


def test_bytes_without_an_end_of_line_are_not_hoarded():
    reader = parser()
    for _ in range(20):
        reader.parse(b"\x8f" * 100)
    assert reader.counters["bytes_skipped"] > 1000
    assert reader.counters["frames"] == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "fields = None is not a list"),
        ({"fields": ["acc_w"]}, "field 'acc_w' is not one of time, node, acc_x"),
        ({"fields": [*SIX, "acc_x"]}, "'acc_x' occurs twice"),
        ({"fields": SIX[:5]}, "name no gyro_z"),
        ({"fields": [*SIX, "mag_x"]}, "name no mag_y, mag_z"),
        ({"fields": SIX}, "unit of acc = None is not one of m/s.2, g, mg"),
        ({"fields": SIX, "units": {"acc": "g", "gyro": "rpm"}}, "unit of gyro = 'rpm'"),
        ({"fields": SIX, "units": {"acc": -1.0, "gyro": "deg/s"}}, "unit of acc = -1.0"),
        ({"fields": SIX, "units": "g"}, "expected units as a mapping"),
    ],
)
def test_a_format_that_makes_no_sense_is_refused(options: dict, message: str):
    with pytest.raises(InputError, match=message):
        line_format(options)


def test_numbers_that_no_field_can_hold_are_bad_lines_and_the_next_line_counts():
    fields = ["time", "node", *SIX]
    reader = parser(fields, {"time": "s", "acc": "g", "gyro": "deg/s"})
    lines = [
        "1e308,1,0,0,1,0,0,0",  # finite as it stands, infinite in microseconds
        "1,1,1e308,0,1,0,0,0",
        "1,1e308,0,0,1,0,0,0",
        "1,70000,0,0,1,0,0,0",
        "1,nan,0,0,1,0,0,0",
        "1,1,0,0,1,0,0,0",
    ]
    (reading,) = read(reader, "\n".join(lines).encode() + b"\n")
    assert reading.clock_us == 1_000_000
    assert reader.counters["bad_lines"] == 5

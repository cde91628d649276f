"""The protocol's frames, against bytes computed by hand."""

import numpy as np
import pytest

from imu_bridge.protocols import star as protocol
from imu_bridge.protocols.star import RawSample, StarParser, encode, frame, quantise, reading

SAMPLE = RawSample(
    node_id=7,
    sequence=0x1234,
    clock_us=0x89ABCDEF,
    accelerometer=(1, -2, 16384),
    gyroscope=(-32768, 32767, 0),
    magnetometer=(100, -100, 256),
    magnetometer_valid=True,
    accelerometer_range=1,
    gyroscope_range=3,
    magnetometer_range=2,
)
GOLDEN = bytes.fromhex(
    "a55a"  # sync
    "1c"  # 28 bytes of payload
    "11"  # version 1, type 1
    "07"  # node
    "3412"  # sequence
    "efcdab89"  # clock
    "2d"  # ranges: 1 | 3 << 2 | 2 << 4
    "01"  # the magnetometer is valid
    "0100feff0040"
    "0080ff7f0000"
    "64009cff0001"
    "e858"  # CRC, worked out bit by bit
)


def test_sample_encodes_to_the_golden_bytes() -> None:
    assert encode(SAMPLE).hex() == GOLDEN.hex()


def test_golden_bytes_decode_to_the_sample() -> None:
    assert StarParser().parse(GOLDEN) == [reading(SAMPLE)]


def test_crc_is_ccitt_false() -> None:
    assert protocol.crc16(b"123456789") == 0x29B1  # the check value of its definition


def test_frame_has_33_bytes() -> None:
    assert len(GOLDEN) == 33


@pytest.mark.parametrize(
    "change",
    [
        {"node_id": 256},
        {"sequence": 65536},
        {"clock_us": -1},
        {"accelerometer": (0, 0, 32768)},
        {"gyroscope_range": 4},
    ],
)
def test_field_that_does_not_fit_is_refused(change: dict) -> None:
    fields = {name: getattr(SAMPLE, name) for name in SAMPLE.__slots__}
    with pytest.raises(ValueError, match=r"fit|range codes"):
        encode(RawSample(**{**fields, **change}))


def test_counts_convert_to_si_units_by_their_range() -> None:
    si = reading(SAMPLE)
    g = 9.80665
    np.testing.assert_allclose(si.acceleration, [4 * g / 32768, -8 * g / 32768, 2 * g])
    np.testing.assert_allclose(
        si.angular_velocity, np.radians([-2000.0, 2000.0 * 32767 / 32768, 0.0])
    )
    np.testing.assert_allclose(si.magnetic_field, [60e-6, -60e-6, 153.6e-6])


def test_invalid_magnetometer_is_none() -> None:
    sample = RawSample(
        node_id=1, sequence=0, clock_us=0, accelerometer=(0, 0, 0), gyroscope=(0, 0, 0)
    )
    assert reading(sample).magnetic_field is None


def test_quantise_saturates_as_a_sensor_does() -> None:
    counts = quantise([0.0, 100.0, -100.0, 9.80665], protocol.ACCELEROMETER_LSB[0])
    assert counts.tolist() == [0, 32767, -32768, 16384]


def test_truncated_frame_yields_nothing_until_its_rest_arrives() -> None:
    parser = StarParser()
    assert parser.parse(GOLDEN[:20]) == []
    assert parser.parse(GOLDEN[20:]) == [reading(SAMPLE)]
    assert parser.counters["bytes_skipped"] == 0


def test_truncated_frame_does_not_hide_the_next() -> None:
    parser = StarParser()
    assert parser.parse(GOLDEN[:20] + GOLDEN + GOLDEN) == [reading(SAMPLE)] * 2
    assert parser.counters.as_dict() == {
        "frames": 2,
        "crc_errors": 1,
        "bytes_skipped": 20,
        "unknown_kinds": 0,
    }


SYNC_WORDS = RawSample(
    node_id=1,
    sequence=0x5AA5,
    clock_us=0x5AA55AA5,
    accelerometer=(0x5AA5,) * 3,
    gyroscope=(0x5AA5,) * 3,
)


def test_sync_word_within_a_payload_is_data() -> None:
    parser = StarParser()
    assert parser.parse(encode(SYNC_WORDS) * 2) == [reading(SYNC_WORDS)] * 2
    assert parser.counters["bytes_skipped"] == 0


def test_stream_joined_within_a_payload_full_of_sync_words_resynchronises() -> None:
    parser = StarParser()
    samples = parser.parse(encode(SYNC_WORDS)[4:] + GOLDEN) + parser.finish()
    assert samples == [reading(SAMPLE)]


def test_flush_finds_the_frame_behind_a_false_length() -> None:
    parser = StarParser()
    assert parser.parse(b"\xa5\x5a\x40" + GOLDEN) == []
    assert parser.finish() == [reading(SAMPLE)]
    assert parser.counters["bytes_skipped"] == 3


def test_frame_of_an_unknown_kind_is_skipped_whole_and_counted() -> None:
    parser = StarParser()
    assert parser.parse(frame(b"\x21" + GOLDEN) + GOLDEN) == [reading(SAMPLE)]
    assert parser.counters["unknown_kinds"] == 1
    assert parser.counters["bytes_skipped"] == 0


def test_longer_payload_of_a_supported_kind_is_read() -> None:
    assert StarParser().parse(frame(GOLDEN[3:-2] + b"later")) == [reading(SAMPLE)]


def test_shorter_payload_of_a_supported_kind_is_counted_as_unknown() -> None:
    parser = StarParser()
    assert parser.parse(frame(GOLDEN[3:-3])) == []
    assert parser.counters["unknown_kinds"] == 1


@pytest.mark.parametrize("size", [0, 65])
def test_payload_of_a_wrong_size_is_refused(size: int) -> None:
    with pytest.raises(ValueError, match="1 to 64"):
        frame(bytes(size))

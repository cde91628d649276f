"""Properties of the parser for every stream."""

import itertools

from hypothesis import given, settings, strategies as st

from imu_bridge.protocols.star import RawSample, StarParser, encode, reading

I16 = st.integers(-32768, 32767)
# Sync words are rare at random: prefer the values that make them.
AXIS = st.one_of(I16, st.sampled_from([0x5AA5, -0x5AA6, 0x1C5A]))
TRIPLE = st.tuples(AXIS, AXIS, AXIS)
CODE = st.integers(0, 3)
SAMPLES = st.builds(
    RawSample,
    node_id=st.integers(0, 255),
    sequence=st.integers(0, 65535),
    clock_us=st.integers(0, 2**32 - 1),
    accelerometer=TRIPLE,
    gyroscope=TRIPLE,
    magnetometer=TRIPLE,
    magnetometer_valid=st.booleans(),
    accelerometer_range=CODE,
    gyroscope_range=CODE,
    magnetometer_range=CODE,
)
GARBAGE = st.one_of(
    st.binary(max_size=80),
    st.lists(st.sampled_from([b"\xa5", b"\x5a", b"\xa5\x5a", b"\x1c", b"\x11"]), max_size=40).map(
        b"".join
    ),
    SAMPLES.flatmap(lambda s: st.integers(0, 32).map(lambda cut: encode(s)[:cut])),
    SAMPLES.flatmap(lambda s: st.integers(1, 33).map(lambda cut: encode(s)[cut:])),
)
PIECES = st.lists(st.tuples(GARBAGE, SAMPLES), max_size=6)


def stream(pieces: list[tuple[bytes, RawSample]]) -> bytes:
    return b"".join(garbage + encode(sample) for garbage, sample in pieces)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(SAMPLES)
def test_every_sample_survives_the_wire(sample: RawSample) -> None:
    assert StarParser().parse(encode(sample)) == [reading(sample)]


@settings(max_examples=200, derandomize=True, deadline=None)
@given(PIECES)
def test_garbage_between_frames_never_loses_an_intact_frame(
    pieces: list[tuple[bytes, RawSample]],
) -> None:
    parser = StarParser()
    samples = parser.parse(stream(pieces)) + parser.finish()
    assert samples == [reading(sample) for _, sample in pieces]


@settings(max_examples=200, derandomize=True, deadline=None)
@given(PIECES, GARBAGE, st.lists(st.integers(0, 700), max_size=12))
def test_any_split_of_a_stream_gives_the_same_samples_and_counts(
    pieces: list[tuple[bytes, RawSample]], tail: bytes, cuts: list[int]
) -> None:
    data = stream(pieces) + tail
    whole = StarParser()
    expected = whole.parse(data) + whole.finish()
    split = StarParser()
    edges = sorted({0, len(data), *(min(cut, len(data)) for cut in cuts)})
    samples = [s for a, b in itertools.pairwise(edges) for s in split.parse(data[a:b])]
    assert samples + split.finish() == expected
    assert split.counters.as_dict() == whole.counters.as_dict()


@settings(max_examples=300, derandomize=True, deadline=None)
@given(SAMPLES, st.integers(0, 33 * 8 - 1), st.integers(1, 0xFFFF))
def test_frame_with_a_corrupted_burst_never_gives_a_sample(
    sample: RawSample, first_bit: int, burst: int
) -> None:
    # A CRC-16 detects every burst of errors of up to 16 bits.
    bits = int.from_bytes(encode(sample), "big")
    error = (burst << first_bit) & ((1 << 33 * 8) - 1)
    corrupted = (bits ^ error).to_bytes(33, "big")
    parser = StarParser()
    samples = parser.parse(corrupted) + parser.finish()
    assert samples == ([reading(sample)] if error == 0 else [])


@settings(max_examples=200, derandomize=True, deadline=None)
@given(PIECES, GARBAGE)
def test_every_byte_is_either_in_a_frame_or_counted_as_skipped(
    pieces: list[tuple[bytes, RawSample]], tail: bytes
) -> None:
    data = stream(pieces) + tail
    parser = StarParser()
    parser.parse(data)
    parser.finish()
    assert 33 * parser.counters["frames"] + parser.counters["bytes_skipped"] == len(data)

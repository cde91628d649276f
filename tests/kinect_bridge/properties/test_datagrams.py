"""Any data on the socket are counted and do not stop the source."""

import json

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.udp import UdpSource

SENDER = ("127.0.0.1", 40000)
ANY = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)
NUMBERS = st.floats() | st.integers(-(2**63), 2**63) | st.none()
FRAMES = st.fixed_dictionaries(
    {
        "v": st.just(1) | ANY,
        "seq": st.integers(0, 2**32 - 1) | ANY,
        "time_ns": st.integers(0, 2**62 - 1) | ANY,
        "people": st.lists(
            st.fixed_dictionaries(
                {
                    "id": st.text(max_size=5) | st.integers(-5, 5),
                    "joints": st.lists(
                        st.none() | st.lists(NUMBERS, min_size=3, max_size=4), max_size=16
                    ),
                }
            ),
            max_size=20,
        )
        | ANY,
    }
)


@pytest.fixture(scope="module")
def source():
    made = UdpSource(KinectBridgeParameters(source="udp", udp_port=0))
    made._now_ns = lambda: 10**18
    yield made
    made.close()


def hear(source: UdpSource, data: bytes) -> None:
    before = source.counters["datagrams_received"]
    source.hear(data, SENDER)
    assert source.counters["datagrams_received"] == before + 1
    frame = source.take()
    if frame is not None:
        seen = frame.tracking_state > 0
        assert np.isfinite(frame.positions[seen]).all()
        assert np.abs(frame.positions[seen]).max(initial=0.0) <= 100.0
        assert len(frame.person) == len(set(frame.person)) <= 16


@settings(deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes(source, data):
    hear(source, data)


@pytest.mark.filterwarnings("ignore:overflow encountered")
@settings(deadline=None)
@given(FRAMES)
def test_anything_that_resembles_a_frame(source, frame):
    hear(source, json.dumps(frame).encode(errors="surrogatepass"))
    hear(source, msgspec.msgpack.encode({**frame, "seq": 1}) if _packs(frame) else b"")


def _packs(frame: dict) -> bool:
    try:
        msgspec.msgpack.encode(frame)
    except (OverflowError, UnicodeEncodeError):
        return False
    return True

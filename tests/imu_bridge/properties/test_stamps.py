"""Properties of stamps for any behaviour of node and link."""

from hypothesis import given, settings, strategies as st

from imu_bridge.node_clock import HOLD_NS, NodeClock

STEP = st.tuples(
    st.one_of(st.integers(0, 50_000), st.integers(0, 2**32 - 1)),  # node clock step [us]
    st.one_of(st.integers(0, 50_000_000), st.integers(0, 10**13)),  # arrival step [ns]
)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.lists(STEP, min_size=1, max_size=40))
def test_stamps_of_a_node_rise_and_are_not_after_the_arrival(steps: list[tuple[int, int]]):
    clock = NodeClock()
    clock_us, arrival_ns, before_ns = 0, 10**18, 0
    for node_step, arrival_step in steps:
        clock_us = (clock_us + node_step) % 2**32
        arrival_ns += arrival_step
        stamp_ns = clock.stamp(clock_us, arrival_ns).stamp_ns
        assert stamp_ns > before_ns
        assert stamp_ns <= arrival_ns + HOLD_NS * clock.counters["stamps_held"]
        before_ns = stamp_ns

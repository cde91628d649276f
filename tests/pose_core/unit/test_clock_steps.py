"""Steps of clocks that are set while a recording runs."""

import numpy as np
import pytest

from pose_core.streams.clock_steps import ClockSteps

SECOND_NS = 1_000_000_000
BEGIN_NS = 1_700_000_000 * SECOND_NS
PERIOD_NS = SECOND_NS // 30


def recorded(count=900, late_ns=20_000_000):
    """Stamps of frames, and when they were recorded."""
    stamps_ns = BEGIN_NS + PERIOD_NS * np.arange(count)
    jitter_ns = np.random.default_rng(3).integers(0, 8_000_000, count)
    return stamps_ns, stamps_ns + late_ns + jitter_ns


def corrected(steps, stamps_ns, recorded_ns, batch):
    found = [
        stamps_ns[k : k + batch]
        + steps.offsets_ns("left", stamps_ns[k : k + batch], recorded_ns[k : k + batch])
        for k in range(0, len(stamps_ns), batch)
    ]
    return np.concatenate(found)


@pytest.mark.parametrize("batch", [7, 100, 900])
@pytest.mark.parametrize("step_s", [-2.0, -0.7, -0.15, 0.15, 0.7, 2.0, 3600.0])
def test_stamps_are_corrected_from_a_step_on(step_s, batch):
    true_ns, recorded_ns = recorded()
    stamps_ns = true_ns + np.where(np.arange(900) >= 400, round(step_s * SECOND_NS), 0)
    steps = ClockSteps()
    found_ns = corrected(steps, stamps_ns, recorded_ns, batch)
    assert np.abs(found_ns - true_ns).max() < 8_000_000
    (step,) = steps.steps
    assert step.step_ns == pytest.approx(step_s * SECOND_NS, abs=8_000_000)
    (line,) = steps.lines(BEGIN_NS)
    assert line.startswith(f"left: clock set by {step_s:+.2f} s at 13.")


def test_a_clock_that_is_set_back_again_is_right_again():
    true_ns, recorded_ns = recorded()
    frame = np.arange(900)
    stamps_ns = true_ns + np.where((frame >= 300) & (frame < 600), -2 * SECOND_NS, 0)
    steps = ClockSteps()
    assert np.abs(corrected(steps, stamps_ns, recorded_ns, 100) - true_ns).max() < 8_000_000
    assert len(steps.lines(BEGIN_NS)) == 2


def test_a_link_that_holds_frames_back_is_no_step():
    stamps_ns, recorded_ns = recorded()
    held = (np.arange(900) >= 300) & (np.arange(900) < 390)
    recorded_ns = np.where(held, recorded_ns[390] - 1000, recorded_ns)
    lost = np.arange(900)[(np.arange(900) < 340) | (np.arange(900) >= 375)]
    steps = ClockSteps()
    for kept in (np.arange(900), lost):
        found_ns = corrected(steps, stamps_ns[kept], recorded_ns[kept], 100)
        assert np.array_equal(found_ns, stamps_ns[kept])
    assert not steps.steps


def test_frames_that_a_link_drops_after_holding_them_back_are_no_step():
    """Their lag is a different one for ten seconds each; it was as short before."""
    stamps_ns, recorded_ns = recorded()
    frame = np.arange(900)
    recorded_ns = recorded_ns + np.where((frame >= 300) & (frame < 600), 150_000_000, 0)
    kept = (frame < 300) | ((frame >= 305) & (frame < 600)) | (frame >= 605)
    steps = ClockSteps()
    assert np.array_equal(
        corrected(steps, stamps_ns[kept], recorded_ns[kept], 100), stamps_ns[kept]
    )


def test_frames_that_are_lost_or_late_from_some_time_on_are_no_step():
    stamps_ns, recorded_ns = recorded()
    frame = np.arange(900)
    recorded_ns = recorded_ns + np.where(frame >= 500, SECOND_NS, 0)
    kept = (frame < 200) | (frame >= 300)
    steps = ClockSteps()
    assert np.array_equal(
        corrected(steps, stamps_ns[kept], recorded_ns[kept], 100), stamps_ns[kept]
    )


def test_a_clock_that_had_not_been_set_is_no_reference():
    true_ns, recorded_ns = recorded()
    stamps_ns = np.where(np.arange(900) < 100, true_ns - BEGIN_NS, true_ns)
    found_ns = corrected(ClockSteps(), stamps_ns, recorded_ns, 100)
    assert np.array_equal(found_ns[100:], true_ns[100:])


def test_sources_that_share_a_clock_are_named_together():
    true_ns, recorded_ns = recorded()
    stamps_ns = true_ns + np.where(np.arange(900) >= 400, 3 * SECOND_NS, 0)
    steps = ClockSteps()
    for source in ("right", "left"):
        steps.offsets_ns(source, stamps_ns, recorded_ns)
    (line,) = steps.lines(BEGIN_NS)
    assert line.startswith("left, right: clock set by +3.00 s at 13.4 s")


def test_repeated_and_swapped_stamps_are_no_step():
    stamps_ns, recorded_ns = recorded()
    stamps_ns[500], stamps_ns[501] = stamps_ns[501], stamps_ns[500]
    stamps_ns[700] -= 2 * SECOND_NS
    steps = ClockSteps()
    assert np.array_equal(corrected(steps, stamps_ns, recorded_ns, 100), stamps_ns)

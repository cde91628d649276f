import numpy as np
import pytest

from pose_core.streams.samples import SkeletonSample
from pose_core.streams.series import series_from_samples

MS = 1_000_000


def sample(stamp_ms, x, state=2):
    return SkeletonSample(
        stamp_ns=round(stamp_ms * MS),
        sensor="left",
        person="1",
        positions=np.full((15, 3), float(x)),
        tracking_state=np.full(15, state, np.uint8),
    )


def stamps(*times_ms):
    return np.array([round(t * MS) for t in times_ms], np.int64)


def x_at(series, *times_ms, **options):
    return series.at(stamps(*times_ms), **options)[:, 0, 0]


def test_positions_between_samples_are_interpolated():
    series = series_from_samples([sample(0, 0.0), sample(40, 4.0)])
    assert x_at(series, 10, 30) == pytest.approx([1.0, 3.0])


def test_positions_are_not_extrapolated():
    series = series_from_samples([sample(0, 0.0), sample(40, 4.0)])
    assert x_at(series, -1, 0, 40, 41) == pytest.approx([np.nan, 0.0, 4.0, np.nan], nan_ok=True)


def test_positions_are_not_interpolated_across_a_long_gap():
    series = series_from_samples([sample(0, 0.0), sample(200, 2.0), sample(240, 6.0)])
    found = x_at(series, 100, 220, max_gap_s=0.15)
    assert found == pytest.approx([np.nan, 4.0], nan_ok=True)


def test_a_joint_missing_in_either_sample_is_not_interpolated():
    series = series_from_samples([sample(0, 0.0), sample(40, 4.0, state=0), sample(80, 8.0)])
    assert x_at(series, 20, 40, 60, 80) == pytest.approx([np.nan] * 3 + [8.0], nan_ok=True)


def test_samples_are_sorted_and_duplicate_stamps_dropped():
    series = series_from_samples([sample(40, 4.0), sample(0, 0.0), sample(40, 9.0)])
    assert list(series.stamps_ns) == list(stamps(0, 40))
    assert series.positions[1, 0, 0] == 4.0


def test_an_empty_series_is_unknown_everywhere():
    series = series_from_samples([])
    assert np.isnan(x_at(series, 1)).all()
    assert series.duration_s == 0.0


def test_a_shift_moves_the_stamps():
    series = series_from_samples([sample(0, 0.0), sample(40, 4.0)]).shifted(-0.010)
    assert x_at(series, 0) == pytest.approx([1.0])


def test_a_transform_rotates_and_translates_positions():
    turn = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 0.0], [0, 0, 1, 0], [0, 0, 0, 1]])
    series = series_from_samples([sample(0, 2.0)]).transformed(turn)
    assert series.positions[0, 0] == pytest.approx([3.0, 2.0, 2.0])


def test_a_grid_has_a_constant_rate():
    series = series_from_samples([sample(0, 0.0), sample(30, 3.0), sample(100, 10.0)])
    (positions,) = series.on_grids(100.0)
    assert positions[:, 0, 0] == pytest.approx(np.arange(11.0))


def test_the_grid_restarts_after_a_gap():
    year_ms = 3.2e10
    series = series_from_samples([sample(0, 0.0), sample(20, 2.0), sample(year_ms, 5.0)])
    assert [len(positions) for positions in series.on_grids(100.0)] == [3, 1]

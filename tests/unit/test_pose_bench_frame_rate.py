import numpy as np
import pytest

from pose_bench.frame_rate import time_stretch
from pose_core.streams.angle_series import AngleSeries

SECONDS = np.arange(0.0, 3.0, 0.01)


def series(seconds, angle):
    return AngleSeries(stamps_ns=np.rint(1e9 * seconds).astype(np.int64), angles={"knee": angle})


def bend(seconds):
    return 1.5 * np.sin(np.pi * seconds / 3.0) ** 4


@pytest.mark.parametrize("stretch", [0.94, 1.0, 1.2])
def test_a_view_that_ran_slower_or_faster_is_found_out(stretch):
    nominal = np.arange(0.0, 3.0 / stretch, 1.0 / 30.0)

    found = time_stretch(
        series(nominal, bend(stretch * nominal) + 0.1), series(SECONDS, bend(SECONDS)), ["knee"]
    )

    assert found == pytest.approx(stretch, abs=0.021)


def test_where_nothing_moves_the_nominal_rate_stays():
    still = series(np.arange(0.0, 3.0, 1.0 / 30.0), np.full(90, np.nan))

    assert time_stretch(still, series(SECONDS, bend(SECONDS)), ["knee"]) == 1.0

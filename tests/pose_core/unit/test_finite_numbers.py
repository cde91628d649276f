import numpy as np
import pytest

from pose_core.finite_numbers import finite_numbers, nan_median


@pytest.mark.parametrize(
    ("value", "shape"),
    [([1, 2.5, -3], (3,)), ([[1, 0], [0, 1]], (2, 2)), (4.0, ()), ([], (0,))],
)
def test_finite_numbers_of_the_right_shape_give_an_array(value, shape):
    numbers = finite_numbers(value, *shape)
    assert numbers.dtype == np.float64
    np.testing.assert_array_equal(numbers, value)


@pytest.mark.parametrize(
    "value",
    [
        None,
        "three",
        {"x": 1.0},
        [1.0, 2.0],
        [[1.0, 2.0, 3.0]],
        [1.0, [2.0], 3.0],
        [1.0, float("nan"), 3.0],
        [1.0, float("inf"), 3.0],
        [1.0, None, 3.0],
        [1.0, 10**400, 3.0],
    ],
)
def test_other_values_give_none(value):
    assert finite_numbers(value, 3) is None


def test_the_median_ignores_nan():
    values = np.random.default_rng(0).normal(size=(9, 4, 3))
    values[np.random.default_rng(1).random(values.shape) < 0.4] = np.nan
    np.testing.assert_array_equal(nan_median(values), np.nanmedian(values, axis=0))


def test_there_is_no_median_of_nothing():
    assert np.isnan(nan_median(np.full((3, 2), np.nan))).all()
    assert np.isnan(nan_median(np.empty((0, 2)))).all()

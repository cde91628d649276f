"""The compiled inverse of a covariance."""

import numpy as np
import pytest

from pose_core.kernels.inverse import SMALL, add_information, invert


@pytest.mark.parametrize("size", [1, 7, 30, SMALL, SMALL + 1, 78, 101])
def test_the_inverse_by_halves_is_the_inverse(size):
    factor = np.random.default_rng(size).normal(size=(size, 2 * size))
    covariance = factor @ factor.T
    inverse = covariance.copy()
    assert invert(inverse)
    np.testing.assert_allclose(inverse @ covariance, np.eye(size), atol=1e-10)
    np.testing.assert_array_equal(inverse, inverse.T)


@pytest.mark.parametrize("row", [0, 40, 95])
@pytest.mark.parametrize("value", [-1e-9, 0.0, np.nan])
def test_a_matrix_that_is_not_positive_definite_has_none(row, value):
    matrix = np.eye(96)
    matrix[row, row] = value
    assert not invert(matrix)


@pytest.mark.parametrize("informed", [4, 60, 96])
def test_information_of_the_first_rows_is_added_as_to_the_whole(informed):
    rng = np.random.default_rng(informed)
    factor = rng.normal(size=(96, 200))
    covariance = factor @ factor.T / 200.0
    seen = rng.normal(size=(informed, 45))
    information = seen @ seen.T
    whole = np.zeros((96, 96))
    whole[:informed, :informed] = information
    expected = np.linalg.inv(np.linalg.inv(covariance) + whole)
    assert add_information(covariance, information)
    np.testing.assert_allclose(covariance, expected, atol=1e-10)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-14)

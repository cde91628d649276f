"""The compiled inverse of a covariance."""

import numpy as np
import pytest

from pose_fusion.kernels.inverse import SMALL, invert


@pytest.mark.parametrize("size", [1, 7, SMALL, SMALL + 1, 78, 101])
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

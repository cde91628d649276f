"""What is known of IMUs' headings, all in one filter's state: a row, and five states, an IMU."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.streams.samples import FloatArray

Y, DRIFT, Y0, LATERAL, BESIDE = range(5)
STATES = 5


class Anchors(NamedTuple):
    """What is known of n IMUs' headings."""

    state: FloatArray  # (n, 5): y [rad], drift [rad/s], y₀ [rad], lateral error [rad], how far
    # the joint to the parent's segment shows the heading beside [rad]; NaN: not yet
    covariance: FloatArray  # (5 n, 5 n) of all IMUs' states, each IMU's five in turn
    joint_noise: FloatArray  # (n,) [-] variance of what that joint shows, against what it measures
    recent: FloatArray  # (n, 2) [s] sums of dot and cross products of the leaning axis
    recent_axes: FloatArray  # (n, 2, 3) mean of that axis, see kernels.fresh_part
    unseen_s: FloatArray  # (n,) since the cameras saw it
    contradicted_s: FloatArray  # (n,)
    neutral: FloatArray  # (n, 2) y₀ and its variance, kept over a loss; NaN: none
    is_mounting_known: NDArray[np.bool_]  # (n,)
    restarts: NDArray[np.int64]  # (n,)


def make_anchors(count: int) -> Anchors:
    """Of IMUs that nothing is known of."""
    return Anchors(
        state=np.full((count, STATES), np.nan),
        covariance=np.zeros((STATES * count, STATES * count)),
        joint_noise=np.zeros(count),
        recent=np.zeros((count, 2)),
        recent_axes=np.zeros((count, 2, 3)),
        unseen_s=np.full(count, np.inf),
        contradicted_s=np.zeros(count),
        neutral=np.full((count, 2), np.nan),
        is_mounting_known=np.zeros(count, np.bool_),
        restarts=np.zeros(count, np.int64),
    )


def joined(first: Anchors, second: Anchors) -> Anchors:
    """Some IMUs and some more, of which nothing is known together."""
    size, more = len(first.covariance), len(second.covariance)
    covariance = np.zeros((size + more, size + more))
    covariance[:size, :size], covariance[size:, size:] = first.covariance, second.covariance
    parts = {
        name: np.concatenate((kept, getattr(second, name)))
        for name, kept in first._asdict().items()
        if name != "covariance"
    }
    return Anchors(covariance=covariance, **parts)


@compiled_in_place
def is_known(a: Anchors, i: int) -> bool:
    """Whether a heading has been observed."""
    return not np.isnan(a.state[i, Y])


@compiled
def own_covariance(a: Anchors, i: int) -> FloatArray:
    """The covariance of one IMU's states, shape (5, 5), a view."""
    first = STATES * i
    return a.covariance[first : first + STATES, first : first + STATES]


@compiled
def forget_covariance(a: Anchors, i: int) -> None:
    """Nothing is known any more of one IMU's states, nor of what they have to do with others'."""
    first = STATES * i
    a.covariance[first : first + STATES] = 0.0
    a.covariance[:, first : first + STATES] = 0.0

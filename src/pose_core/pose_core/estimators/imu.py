"""``imu``: the IMUs alone, the root held where the cameras saw it first."""

from typing import ClassVar

from pose_core.estimators.segments import SegmentEstimator


class ImuEstimator(SegmentEstimator):
    """The default estimator that looks at no camera after its first pose.

    The cameras still place the body at the start, and align the IMUs with it.
    """

    LOOKS_AT_CAMERAS: ClassVar[bool] = False

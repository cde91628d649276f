"""``imu``: the IMUs alone, the root held where the cameras saw it first."""

from pose_fusion.filters.segment_filter import NO_CAMERAS, CameraLooks
from pose_fusion.fusion.estimators.estimator import Observation
from pose_fusion.fusion.estimators.segments import SegmentEstimator


class ImuEstimator(SegmentEstimator):
    """The default estimator that looks at no camera after its first pose.

    The cameras still place the body at the start, and align the IMUs with it.
    """

    def _camera_looks(self, observation: Observation, delay_s: float) -> CameraLooks:
        return NO_CAMERAS

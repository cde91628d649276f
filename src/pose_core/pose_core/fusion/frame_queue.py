"""Queue of the frames to estimate: of single sensors, of all sensors, or of only the IMUs."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import NS_PER_S, newest_of
from pose_core.streams.frame_order import FrameOrder
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import AlignedFrame, TimeAligner

ALONE_NS = NS_PER_S // 20  # [ns] least silence of the cameras after which the IMUs give frames
STEP_NS = NS_PER_S // 50  # [ns] between frames with only IMUs
LATEST_ALONE_NS = 3 * NS_PER_S // 20  # [ns] the same of slow cameras, at most
MAX_LAG_NS = NS_PER_S // 2  # [ns] bound of the cameras' usual lag behind the IMUs
LAGS = 9  # [frames] over which lags and intervals are remembered


class CameraLag:
    """Tracks the cameras' usual lag behind the IMUs, to detect silence of the cameras."""

    def __init__(self) -> None:
        self.newest_imu_ns = 0
        self._newest_seen_ns = 0  # stamp of the newest camera frame
        self._newest_frame_ns = 0
        self._lags_ns: deque[int] = deque(maxlen=LAGS)
        self._intervals_ns: deque[int] = deque(maxlen=LAGS)

    def note_seen(self, stamp_ns: int) -> None:
        """Note a camera's frame."""
        self._lags_ns.append(max(self.newest_imu_ns - stamp_ns, 0))
        self._intervals_ns.append(max(stamp_ns - self._newest_seen_ns, 0))
        self._newest_seen_ns = newest_of(self._newest_seen_ns, stamp_ns)

    def note_frame(self, stamp_ns: int) -> None:
        """Note a frame to be estimated, with or without a camera."""
        self._newest_frame_ns = newest_of(self._newest_frame_ns, stamp_ns)

    def begins_ns(self) -> int:
        """The instant after which the IMUs give the next frame."""
        silent_ns = min(max(5 * max(self._intervals_ns, default=0) // 4, ALONE_NS), LATEST_ALONE_NS)
        return max(
            self._newest_seen_ns + self._usual_lag_ns() + silent_ns, self._newest_frame_ns + STEP_NS
        )

    def instants(self, stamp_ns: int) -> tuple[int, ...]:
        """Instants of frames with only IMUs, from the end of the cameras' lag to ``stamp_ns``."""
        first_ns = max(self._newest_frame_ns + STEP_NS, stamp_ns - self._usual_lag_ns())
        return (*range(first_ns, stamp_ns - STEP_NS // 2, STEP_NS), stamp_ns)

    def _usual_lag_ns(self) -> int:
        return min(*self._lags_ns, MAX_LAG_NS) if self._lags_ns else 0


class FrameQueue:
    """Makes frames of the sensors' samples and orders them by time.

    Args:
        aligner: Interpolates all sensors to common instants. None: one frame for each sensor's
            sample, and frames with only IMUs while the cameras are silent.
        is_live: See :class:`FrameOrder`.
    """

    def __init__(self, aligner: TimeAligner | None, *, is_live: bool) -> None:
        self._aligner = aligner
        self._is_live = is_live
        self.order: FrameOrder[AlignedFrame] = FrameOrder(is_live=is_live)
        self._camera_lag = CameraLag()
        self.ready: deque[AlignedFrame] = deque()
        """Frames to be estimated now."""
        self.first_ns = 0
        """Stamp of the first sample of any source [ns]."""
        self.newest_ns = 0
        """Stamp of the newest sample of any source [ns]."""

    def add_skeleton(self, sample: SkeletonSample) -> None:
        """Add one sensor's sample."""
        self._update_newest(sample.stamp_ns)
        if self._aligner is not None:
            self.ready.extend(self._aligner.add(sample))
            return
        self._camera_lag.note_seen(sample.stamp_ns)
        frame = AlignedFrame(stamp_ns=sample.stamp_ns, samples={sample.sensor: sample})
        for ready in self.order.add(sample.sensor, sample.stamp_ns, frame):
            self._await(ready)

    def count_until_alone(self, stamps_ns: NDArray[np.int64]) -> int:
        """Number of the IMU samples up to the first one that gives a frame without cameras."""
        if self._aligner is not None:
            return len(stamps_ns)
        is_late = stamps_ns > self._camera_lag.begins_ns()
        return int(is_late.argmax()) + 1 if is_late.any() else len(stamps_ns)

    def add_imus(self, stamps_ns: NDArray[np.int64]) -> int:
        """Add the stamps of IMU samples; return the number of frames with only IMUs."""
        is_alone = self._aligner is None and stamps_ns[-1] > self._camera_lag.begins_ns()
        self._camera_lag.newest_imu_ns = int(stamps_ns.max())
        self._update_newest(self._camera_lag.newest_imu_ns)
        if not is_alone:
            return 0
        instants_ns = self._camera_lag.instants(int(stamps_ns[-1]))
        for instant_ns in instants_ns:
            self._camera_lag.note_frame(instant_ns)
            frame = AlignedFrame(stamp_ns=instant_ns, samples={})
            for ready in self.order.insert(instant_ns, frame):
                self._await(ready)
        if self._is_live:
            self.release_all()
        return len(instants_ns)

    def release_all(self) -> None:
        """Release the frames that wait for earlier ones."""
        for frame in self.order.flush():
            self._await(frame)

    def flush(self) -> None:
        """Release all frames, after the end of the streams."""
        self.release_all()
        if self._aligner is not None:
            self.ready.extend(self._aligner.flush())

    def _await(self, frame: AlignedFrame) -> None:
        self._camera_lag.note_frame(frame.stamp_ns)
        self.ready.append(frame)

    def _update_newest(self, stamp_ns: int) -> None:
        self.first_ns = self.first_ns or stamp_ns
        self.newest_ns = newest_of(self.newest_ns, stamp_ns)

"""The frames that are to be estimated, in their order: of each sensor, of all, or of IMUs alone."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import NS_PER_S
from pose_core.streams.frame_order import FrameOrder
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import JUMP_BACK_NS, AlignedFrame, TimeAligner

SILENT_NS = NS_PER_S // 20  # after which the IMUs alone give a frame
LONGEST_LAG_NS = NS_PER_S // 2  # by which cameras may usually be behind the IMUs
LAGS = 9  # [frames] of which the least is what is usual


class CameraLag:
    """Knows how far the cameras usually are behind the IMUs: that is no silence yet."""

    def __init__(self) -> None:
        self.newest_imu_ns = 0
        self._newest_seen_ns = 0  # by a camera
        self._newest_frame_ns = 0
        self._lags_ns: deque[int] = deque(maxlen=LAGS)

    def note_seen(self, stamp_ns: int) -> None:
        """A camera's frame has come."""
        self._lags_ns.append(max(self.newest_imu_ns - stamp_ns, 0))
        is_set_back = stamp_ns < self._newest_seen_ns - JUMP_BACK_NS
        self._newest_seen_ns = stamp_ns if is_set_back else max(self._newest_seen_ns, stamp_ns)

    def note_frame(self, stamp_ns: int) -> None:
        """A frame, of a camera or of none, is the next to be estimated."""
        self._newest_frame_ns = stamp_ns

    def begins_ns(self) -> int:
        """The instant from which on the IMUs alone give the next frame."""
        return max(self._newest_seen_ns + self._usual_lag_ns(), self._newest_frame_ns) + SILENT_NS

    def instants(self, stamp_ns: int) -> tuple[int, ...]:
        """Instants of frames of the IMUs alone up to one, from where waiting for cameras ended."""
        first_ns = max(self._newest_frame_ns + SILENT_NS, stamp_ns - self._usual_lag_ns())
        return (*range(first_ns, stamp_ns - SILENT_NS // 2, SILENT_NS), stamp_ns)

    def _usual_lag_ns(self) -> int:
        return min(*self._lags_ns, LONGEST_LAG_NS) if self._lags_ns else 0


class FrameQueue:
    """Makes frames of the sensors' samples and has them wait for their turn.

    Args:
        aligner: Brings all sensors to common instants; None: each one's frame as it comes, and
            frames without any while the cameras are silent.
    """

    def __init__(self, aligner: TimeAligner | None) -> None:
        self._aligner = aligner
        self._order: FrameOrder[AlignedFrame] = FrameOrder()
        self._camera_lag = CameraLag()
        self.ready: deque[AlignedFrame] = deque()
        """Frames whose turn has come."""
        self.newest_ns = 0
        """Stamp of the newest sample of any source [ns]."""

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._order.holds

    def add_skeleton(self, sample: SkeletonSample) -> None:
        """Take one sensor's sample."""
        self._update_newest(sample.stamp_ns)
        if self._aligner is not None:
            self.ready.extend(self._aligner.add(sample))
            return
        self._camera_lag.note_seen(sample.stamp_ns)
        frame = AlignedFrame(stamp_ns=sample.stamp_ns, samples={sample.sensor: sample})
        for ready in self._order.add(sample.sensor, sample.stamp_ns, frame):
            self._await(ready)

    def count_until_alone(self, stamps_ns: NDArray[np.int64]) -> int:
        """How many of some IMUs' samples come before they give a frame alone, with that one."""
        if self._aligner is not None:
            return len(stamps_ns)
        is_late = stamps_ns > self._camera_lag.begins_ns()
        return int(is_late.argmax()) + 1 if is_late.any() else len(stamps_ns)

    def add_imus(self, stamps_ns: NDArray[np.int64]) -> int:
        """Take the stamps of so many samples; how many frames of the IMUs alone they give."""
        is_alone = self._aligner is None and stamps_ns[-1] > self._camera_lag.begins_ns()
        self._camera_lag.newest_imu_ns = int(stamps_ns.max())
        self._update_newest(self._camera_lag.newest_imu_ns)
        if not is_alone:
            return 0
        self.release_all()
        instants_ns = self._camera_lag.instants(int(stamps_ns[-1]))
        for instant_ns in instants_ns:
            self._await(AlignedFrame(stamp_ns=instant_ns, samples={}))
        return len(instants_ns)

    def release_all(self) -> None:
        """Wait no longer for frames that should come before others."""
        for frame in self._order.flush():
            self._await(frame)

    def flush(self) -> None:
        """Wait for nothing more: the streams have ended."""
        self.release_all()
        if self._aligner is not None:
            self.ready.extend(self._aligner.flush())

    def _await(self, frame: AlignedFrame) -> None:
        self._camera_lag.note_frame(frame.stamp_ns)
        self.ready.append(frame)

    def _update_newest(self, stamp_ns: int) -> None:
        is_set_back = stamp_ns < self.newest_ns - JUMP_BACK_NS  # a recording that loops
        self.newest_ns = stamp_ns if is_set_back else max(self.newest_ns, stamp_ns)

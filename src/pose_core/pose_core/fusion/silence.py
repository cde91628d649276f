"""When cameras are silent, the IMUs alone give the frames."""

from collections import deque

from pose_core.stamps import NS_PER_S
from pose_core.streams.time_alignment import JUMP_BACK_NS

SILENT_NS = NS_PER_S // 20  # after which the IMUs alone give a frame
LONGEST_LAG_NS = NS_PER_S // 2  # by which cameras may usually be behind the IMUs
LAGS = 9  # [frames] of which the least is what is usual


class CamerasSilence:
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

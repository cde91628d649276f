"""``file``: one sensor of a recording, replayed at its own rate or another."""

from collections.abc import Callable
from pathlib import Path

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.replay import Replay
from kinect_bridge.source import SkeletonFrame, SkeletonSource
from pose_core.errors import ParameterError
from pose_io.recordings.formats import read_recording
from pose_io.recordings.timeline import make_timeline
from pose_node.node_status import Level, Report

MAX_DELAY_NS = 10_000_000_000  # [ns] largest delay of a start that is caught up
LATE_NS = 200_000_000  # [ns] delay that is reported


class RecordingSource(SkeletonSource):
    """Source of a recorded sensor's frames in real time.

    Raises:
        PoseError: If the recording cannot be read, or a parameter does not fit it.
    """

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        if not parameters.file:
            raise ParameterError("file is empty: give the path of a recording to replay")
        self._parameters = parameters
        parameters.start_at_ns(0)  # checked before the file is read
        if parameters.joint_map:
            raise ParameterError(
                f"joint_map = '{parameters.joint_map}' is for live sources: a recording's format "
                "has its own"
            )
        path = Path(parameters.file).expanduser()
        self._recording = read_recording(path, parameters.format)
        self._replay = Replay(
            self._recording,
            [make_timeline(each, parameters.clock) for each in self._recording.streams],
            parameters.sensor,
            start_at_ns=0,
            rate=parameters.rate,
            loop=parameters.loop,
        )
        self._stream, self._timeline = self._replay.stream, self._replay.timeline
        self.hardware_id = self._stream.name
        self._skipped = 0  # frames that were due before a restart
        self._late_ns = 0  # [ns] longest since the last report
        self._reported = (0, 0)  # [ns] and frames, at the last report

    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Start at ``start_at``, or now."""
        self._now_ns = now_ns
        self._reported = (now_ns(), 0)
        self._replay.restart(self._parameters.start_at_ns(now_ns()))
        if self._parameters.start_at:
            # A restart during a common replay continues at the current time.
            self._skipped = self._replay.skip(now_ns() - MAX_DELAY_NS)

    @property
    def is_finished(self) -> bool:
        """Whether all frames have been replayed."""
        return self._replay.finished

    def take(self) -> SkeletonFrame | None:
        """The next frame, if it is due; one per call, so that a late replay causes no burst."""
        now_ns = self._now_ns()
        due = self._replay.take(now_ns)
        if due is None:
            return None
        frame, stamp_ns = due
        self._late_ns = max(self._late_ns, now_ns - stamp_ns)
        rows = self._stream.rows(frame)
        return SkeletonFrame(
            stamp_ns=stamp_ns,
            person=self._stream.person[rows.start : rows.stop],
            positions=self._stream.positions[rows.start : rows.stop],
            tracking_state=self._stream.tracking_state[rows.start : rows.stop],
        )

    def wait_ns(self) -> int | None:
        """Time until the next frame is due [ns]; None at the end."""
        return self._replay.wait_ns(self._now_ns())

    def report(self) -> Report:
        """Progress of the replay, and counts of frames left out."""
        now_ns = self._now_ns()
        before_ns, before = self._reported
        self._reported = (now_ns, self._replay.played)
        late_ns, self._late_ns = self._late_ns, 0
        elapsed_s = max(now_ns - before_ns, 1) * 1e-9
        fit = self._timeline.fit
        return Report(
            level=Level.WARN if late_ns > LATE_NS else Level.OK,
            message=self._message(now_ns, late_ns),
            values={
                "file": self._recording.source,
                "format": self._recording.format,
                "sensor": self._stream.name,
                "comment": "; ".join(self._recording.comments),
                "progress": f"{self._replay.progress:.4f}",
                "rate_hz": f"{(self._replay.played - before) / elapsed_s:.1f}",
                "frames_skipped": self._skipped,
                "late_ms": f"{late_ns * 1e-6:.1f}",
                **self._timeline.counts,
                "rows_repeated": self._stream.rows_repeated,
                "clock": "host" if fit is None else "sensor",
                **({} if fit is None else fit.summary()),
            },
        )

    def _message(self, now_ns: int, late_ns: int) -> str:
        if self._replay.finished:
            return "recording finished"
        due_ns = self._replay.due_ns(self._replay.played)
        if self._replay.played == 0 and due_ns is not None and due_ns > now_ns:
            return f"recording begins in {(due_ns - now_ns) * 1e-9:.1f} s"
        if late_ns > LATE_NS:
            return f"replaying a recording, {late_ns * 1e-9:.1f} s late"
        return "replaying a recording"

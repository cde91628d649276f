"""Messages of cameras and IMUs read into samples that a pipeline may use."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.api import Clocks, ImuBlock, SensorFrame, StampCheck
from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_fusion.watching.cameras import IMPLAUSIBLE, CameraWatch
from pose_fusion.watching.stages import LatencyStages
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import SkeletonReader

COUNTS = ("malformed_skeletons", "frames_repeated", "joints_not_tracked", "imu_without_orientation")


@dataclass(frozen=True, kw_only=True)
class MessageTimes:
    """Times of a message [ns], on the host's clock."""

    published_ns: int
    received_ns: int
    taken_ns: int  # from its queue


class SampleReader:
    """Reads messages, checks their stamps, and notes what cannot be used.

    Args:
        sensors: The cameras' names; the first is the reference sensor.
        check: Its check of stamps; None to take all.
        counters: Counts by reason; :data:`COUNTS` are declared.
    """

    def __init__(
        self, sensors: Sequence[str], check: StampCheck | None, counters: Counters
    ) -> None:
        self.check, self.counters = check, counters
        self.watch = CameraWatch(sensors)
        self.oriented: dict[str, bool] = {}
        """Whether an IMU has sent an orientation, of those that have sent since it was cleared."""
        self.stages = LatencyStages()  # of the reference sensor's frames
        self._reference = sensors[0]
        self._readers = {sensor: SkeletonReader(sensor) for sensor in sensors}

    def frame(
        self, sensor: str, data: bytes, times: MessageTimes, clocks: Clocks
    ) -> SensorFrame | None:
        """The people in a camera's message; None if it is not to be used.

        Args:
            sensor: The camera.
            data: The serialised message.
            times: Of this message.
            clocks: Clocks that correct the stamps afterwards.

        Raises:
            InputError: If the message is malformed.
        """
        reader = self._readers[sensor]
        (persons,) = reader.read([data])
        if reader.fault:
            self.watch.note_fault(sensor, reader.fault)
        if isinstance(persons, InputError):
            self.counters.add("malformed_skeletons")
            self.watch.note_trouble(sensor, str(persons))
            raise persons
        if not self.watch.note_frame(sensor, persons):
            self.counters.add("frames_repeated")
            return None
        if not persons:
            return ()
        states = np.array([person.tracking_state for person in persons])
        self.counters.add("joints_not_tracked", states.size - int(np.count_nonzero(states)))
        if self.check is not None:
            checked = self.check.skeleton(persons[0], times.received_ns, clocks)
            if checked is None:
                self.watch.note_trouble(sensor, IMPLAUSIBLE)
                return None
            persons = [replace(person, stamp_ns=checked.stamp_ns) for person in persons]
        if sensor == self._reference:
            self.stages.note_taken(persons[0].stamp_ns, times.published_ns, times.taken_ns)
        return tuple(persons)

    def imus(
        self,
        datas: Mapping[str, Sequence[bytes]],
        arrivals_ns: int | NDArray[np.int64],
        clocks: Clocks,
    ) -> ImuBlock:
        """The IMUs' samples, in the order of their stamps.

        Args:
            datas: Serialised messages by segment.
            arrivals_ns: Times of arrival of all messages, in their order, or one for all [ns].
            clocks: Clocks that correct the stamps afterwards.
        """
        block, kept = _oriented(datas, self.counters)
        known = {block.segments[imu] for imu in set(block.imu.tolist())}
        self.oriented |= {s: s in known or self.oriented.get(s, False) for s in datas}
        if self.check is not None:
            every = np.broadcast_to(arrivals_ns, sum(map(len, datas.values())))
            block = self.check.imus(block, every[kept], clocks)
        return _in_order(block)


def read_imus(datas: Mapping[str, Sequence[bytes]], counters: Counters) -> ImuBlock:
    """The samples in serialised messages by segment, in the order of their stamps.

    Messages without an orientation are counted and left out.
    """
    return _in_order(_oriented(datas, counters)[0])


def _oriented(
    datas: Mapping[str, Sequence[bytes]], counters: Counters
) -> tuple[ImuBlock, NDArray[np.intp]]:
    """The samples, and the indices of their messages."""
    block, kept = imu_block(datas)
    counters.add("imu_without_orientation", sum(map(len, datas.values())) - len(kept))
    return block, kept


def _in_order(block: ImuBlock) -> ImuBlock:
    return block.rows(np.argsort(block.stamps_ns, kind="stable"))

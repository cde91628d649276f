"""Storage of the sensors' latest samples during a live calibration."""

from collections import deque

from pose_core.api import AlignedFrame, Clocks, SkeletonSample, TimeAligner, on_reference_clock

LONGEST = 4_000  # [samples] a minute of two sensors


class SampleMemory:
    """The last samples of all sensors, in the order of their arrival, by their own clocks."""

    def __init__(self) -> None:
        self._samples: deque[SkeletonSample] = deque(maxlen=LONGEST)

    def add(self, sample: SkeletonSample) -> None:
        """Store a sample."""
        self._samples.append(sample)

    def clear(self) -> None:
        """Drop all samples."""
        self._samples.clear()

    @property
    def newest_ns(self) -> int:
        """The latest stamp [ns]; 0 if there is none."""
        return max((sample.stamp_ns for sample in self._samples), default=0)

    def by_sensor(self) -> dict[str, list[SkeletonSample]]:
        """Each sensor's samples."""
        by_sensor: dict[str, list[SkeletonSample]] = {}
        for sample in self._samples:
            by_sensor.setdefault(sample.sensor, []).append(sample)
        return by_sensor

    def aligned(self, aligner: TimeAligner, clocks: Clocks) -> list[AlignedFrame]:
        """All samples aligned at common instants by these clocks."""
        corrected = [on_reference_clock(sample, clocks) for sample in self._samples]
        corrected.sort(key=lambda sample: sample.stamp_ns)
        return [frame for sample in corrected for frame in aligner.add(sample)]

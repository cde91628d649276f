"""The IMUs of one body, and the segment on which each is worn: its own, or an exchanged one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.filter.state import NO_COLUMN
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_alignment import SegmentAlignment
from pose_core.imu.sensor_to_segment import SensorToSegment

MAX_SETS = 100  # [-] of IMUs that had samples at one instant, which are remembered


@dataclass(kw_only=True)
class WornImu:
    """One IMU, with what is known of its alignment."""

    link: int
    use: ImuUse
    alignment: SegmentAlignment
    says_north: bool = False  # by its covariance
    last_ns: int | None = None
    slips: int = 0  # number of slips handled so far
    former_alignment: SensorToSegment | None = None  # alignment before a restart
    may_be_restrapped: bool = False  # since that alignment
    slipping_until_ns: int = 0  # [ns] it is known to slip before, and not used
    R_world_first: FloatArray | None = None  # (3, 3) its orientation when it was first heard

    @property
    def segment(self) -> str:
        """The segment on which it is worn."""
        return self.use.exchanged_with or self.use.segment

    def note_orientation(self, R_world_sensor: FloatArray) -> None:
        """Find out whether it moves."""
        if self.R_world_first is None:
            self.R_world_first = R_world_sensor.copy()
        self.use.note_orientation(self.R_world_first, R_world_sensor)

    def has_slipped(self, imus: ImuMeasurements) -> bool:
        """Whether it has slipped since its last realignment."""
        return imus.slips.get(self.use.segment, 0) > self.slips

    def require_motion(self) -> None:
        """Require that it moves again before it is aligned: it may have been put down."""
        self.use.has_moved, self.R_world_first = False, None


class WornImus:
    """Every IMU with samples, by the segment that it is named after.

    Args:
        model: The body model, which gives the segments' links.
        spine_bend: See :class:`pose_core.filter.tuning.ImuNoise`.
    """

    def __init__(self, model: BodyModel, spine_bend: Mapping[str, float]) -> None:
        self._model, self._spine_bend = model, spine_bend
        self._imus: dict[str, WornImu] = {}
        self._exchanged: dict[str, str] = {}  # where those are worn that are not on their own
        self._with_link: dict[tuple[str, ...], list[tuple[int, WornImu]]] = {}  # see with_link

    def __iter__(self) -> Iterator[WornImu]:
        """All of them, sorted by name."""
        return (self._imus[name] for name in sorted(self._imus))

    def with_link(self, segments: tuple[str, ...]) -> list[tuple[int, WornImu]]:
        """Index and IMU of each of these names, where the model has a link to wear it on."""
        found = self._with_link.get(segments)
        if found is None:
            if len(self._with_link) == MAX_SETS:
                self._with_link.clear()
            imus = [self._imus.setdefault(name, self._make(name)) for name in segments]
            found = [(row, imu) for row, imu in enumerate(imus) if imu.use.has_link]
            self._with_link[segments] = found
        return found

    def worn_by_name(self, segment: str) -> WornImu | None:
        """The IMU that is named after a segment; None if it has had no samples."""
        return self._imus.get(segment)

    def carriers(self, segments: Sequence[str]) -> tuple[str, ...]:
        """The segments on which the IMUs of these names are worn."""
        if not self._exchanged:
            return tuple(segments)
        return tuple(self._exchanged.get(name, name) for name in segments)

    def moving(self, segments: Sequence[str]) -> tuple[str, ...]:
        """The segments on which the IMUs of these names are worn; empty for one that rests."""
        carriers = self.carriers(segments)
        still = {imu.use.segment for imu in self._imus.values() if not imu.use.has_moved}
        if not still:
            return carriers
        names = zip(segments, carriers, strict=True)
        return tuple("" if name in still else there for name, there in names)

    def wear(self, segment: str, carrier: str) -> None:
        """Take an IMU to be worn on another segment from now on, or on its own again."""
        self._exchanged[segment] = carrier
        if carrier == segment:
            del self._exchanged[segment]
        if segment in self._imus:
            imu, there = self._imus[segment], self._make(segment)
            imu.link, imu.alignment = there.link, there.alignment
            imu.use.exchanged_with, imu.use.has_link = there.use.exchanged_with, there.use.has_link
            self._with_link.clear()

    def _make(self, segment: str) -> WornImu:
        other = self._exchanged.get(segment, "")
        name = self._model.segments.get(other or segment)
        return WornImu(
            link=NO_COLUMN if name is None else self._model.link_index[name],
            use=ImuUse(segment=segment, has_link=name is not None, exchanged_with=other),
            alignment=SegmentAlignment(
                is_arm=name is not None and name.endswith("arm"),
                bend=self._spine_bend.get(name or "", 0.0),
            ),
        )

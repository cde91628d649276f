"""All IMUs of one body: their recent past, their alignment, their reading at an instant."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_fusion.body_model import BodyModel
from pose_fusion.imu_alignment import ImuAlignment, SegmentReading
from pose_fusion.imu_track import ImuTrack
from pose_fusion.li2020 import Li2020Filter
from pose_fusion.samples import FloatArray, ImuSample

ALIVE_NS = 200_000_000  # an IMU silent for longer is not waited for
SWINGS = ("_flexion", "_abduction")  # the joint angles that cameras see


class ImuSet:
    """Knows what every strapped-on IMU says of its segment.

    Args:
        model: The body model: which link a segment is.
    """

    def __init__(self, model: BodyModel) -> None:
        self._model = model
        self._tracks: dict[str, ImuTrack] = {}
        self.alignment = ImuAlignment()
        self._swings = np.array(
            [
                model.dof_index[name]
                for name in model.angle_names
                if name.endswith(SWINGS) and not name.startswith(("neck", "waist"))
            ]
        )

    @property
    def segments(self) -> Sequence[str]:
        """Segments that an IMU has spoken for."""
        return list(self._tracks)

    def add(self, sample: ImuSample) -> bool:
        """Keep a sample; False if its stamp is not newer than the last one's."""
        return self._tracks.setdefault(sample.segment, ImuTrack()).add(sample)

    def has_reached(self, stamp_ns: int) -> bool:
        """Whether every IMU that is alive has a sample at or after an instant."""
        newest = [track.newest_ns for track in self._tracks.values()]
        return all(n is None or n >= stamp_ns or n < stamp_ns - ALIVE_NS for n in newest)

    def read(
        self, stamp_ns: int, filtered: Li2020Filter, tracking_state: NDArray[np.uint8]
    ) -> dict[str, SegmentReading]:
        """The aligned IMUs' readings; also learns the alignment from the cameras' pose.

        Args:
            stamp_ns: The instant of the filter's pose.
            filtered: The filter, just updated.
            tracking_state: Best state of each joint over the sensors, shape (15,).
        """
        states = {}
        for segment, track in self._tracks.items():
            state = track.at(stamp_ns)
            if state is not None:
                states[segment] = state
        if not states:
            return {}
        rotations = filtered.kinematics.pose(filtered.dof).rotations
        trunk = rotations[0]
        self.alignment.observe(
            stamp_ns,
            states,
            self._tracked_axes(rotations, tracking_state),
            filtered.dof[self._swings],
            float(np.arctan2(trunk[1, 0], trunk[0, 0])),
        )
        readings = {s: self.alignment.reading(s, state) for s, state in states.items()}
        return {s: reading for s, reading in readings.items() if reading is not None}

    def _tracked_axes(
        self, rotations: FloatArray, tracking_state: NDArray[np.uint8]
    ) -> dict[str, FloatArray]:
        """Long axes of the segments whose joints are all tracked."""
        axes = {}
        for segment in self._tracks:
            name = self._model.segments.get(segment)
            if name is None:
                continue
            joints = [j for j in JOINTS if self._model.joints[j].link == name]
            joint = self._model.links[name].joint
            joints += [joint] if joint else []
            if all(tracking_state[JOINT_INDEX[j]] == TrackingState.TRACKED for j in joints):
                axes[segment] = rotations[self._model.link_names.index(name)][:, 2]
        return axes

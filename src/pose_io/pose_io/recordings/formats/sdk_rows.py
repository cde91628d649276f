"""Rows of an SDK's joints, one per person and frame, as a recording of one sensor."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pose_core.errors import InputError
from pose_io.recordings.joint_maps import JointMap
from pose_io.recordings.recording import Recording, make_recording, make_stream

MAX_PEOPLE = 64  # in one frame


@dataclass
class SdkRows:
    """Rows collected by a reader; joints in the order of the joint map."""

    time_ns: list[int] = field(default_factory=list)  # capture [ns], on any clock
    person: list[str] = field(default_factory=list)  # empty: no person in that frame
    joints: list[Sequence[Sequence[float]]] = field(default_factory=list)  # x, y, z, confidence

    def add(self, time_ns: int, person: str, joints: Sequence[Sequence[float]]) -> None:
        """Add a person of a frame; NaN where something is missing.

        SDKs write a body that is not tracked with zeros: it is nobody.
        """
        places = np.nan_to_num([joint[:3] for joint in joints], posinf=0.0, neginf=0.0)
        self.time_ns.append(time_ns)
        self.person.append(person if places.any() else "")
        self.joints.append(joints)

    def add_nobody(self, time_ns: int, count: int) -> None:
        """Add a frame without persons, for a skeleton of ``count`` joints."""
        self.add(time_ns, "", [[np.nan] * 4] * count)

    def recording(self, path: Path, format_name: str, joint_map: JointMap) -> Recording:
        """Map the joints and group the rows into frames.

        Raises:
            InputError: If there are no rows.
        """
        if not self.joints:
            raise InputError(f"{path} holds no frames: record again")
        values = np.array(self.joints, dtype=np.float64)
        positions, state = joint_map.convert(values[..., :3], joint_map.states(values[..., 3]))
        stream = make_stream(
            path.name.split(".")[0],
            host_time_ns=self.time_ns,
            sensor_time_ns=None,
            person=self.person,
            positions=positions,
            tracking_state=state,
        )
        return make_recording(str(path), format_name, [stream])

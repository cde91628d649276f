"""Two real Kinects: estimates from one camera compared with the other camera's skeletons.

KinectMultiTrack (C.-J. Wu): two Kinect v2 record one person from directions 0 to 90 degrees apart.
There is no ground truth, but the other camera's errors are independent: an estimate from one camera
can be closer to the other camera only if it is closer to the person, not by smoothness or
overfitting. The raw view and the estimate are aligned with the other view by the same time shift
and rigid transform, those that fit the raw view best, so that a lag of the estimate increases its
error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_bench.one_camera import LEVEL_MOUNTING, RAW, run_one_camera, view_of_stream
from pose_bench.tables import method_table
from pose_core.api import best_rigid_transform, joint_angles, transformed
from pose_core.errors import InputError
from pose_core.finite_numbers import mean_known
from pose_evaluation.agreement import rms_differences_deg
from pose_evaluation.scores import known_joints
from pose_evaluation.table import Table
from pose_evaluation.time_shift import estimate_time_shift
from pose_io.recordings.formats import read_recording
from pose_io.recordings.recording import Recording

LAYOUTS = {"Kinect_0": "parallel", "Kinect_1": "45°", "Kinect_2": "90°"}


@dataclass(frozen=True, kw_only=True)
class OtherView:
    """Differences between one camera's result and the other camera's skeletons."""

    recording: str
    layout: str
    camera: str  # camera whose samples were used
    method: str  # RAW, or an estimator
    seconds: float  # [s] compared
    distance_cm: float  # [cm] mean over joints and instants
    angle_deg: float  # [deg] RMS difference, mean over the angles


def single_person_recordings(folder: Path) -> list[Recording]:
    """The recordings of two cameras and one person, by name.

    Raises:
        InputError: If there is none, or one is damaged.
    """
    found = []
    for path in sorted(folder.glob("*.csv*")):
        recording = read_recording(path, "kinectmultitrack")
        alone = all(len(stream.persons) == 1 for stream in recording.streams)
        if len(recording.streams) == 2 and alone:
            found.append(recording)
    if not found:
        raise InputError(
            f"found no KinectMultiTrack recording of two cameras and one person in {folder}"
        )
    return found


def compare_views(recording: Recording, fed: int, estimators: Sequence[str]) -> list[OtherView]:
    """Compare one camera's raw view and estimates from it with the other camera.

    Args:
        recording: A recording of two cameras and one person.
        fed: Index of the camera whose samples are used, 0 or 1.
        estimators: The estimators.
    """
    one, other = view_of_stream(recording.streams[fed]), view_of_stream(recording.streams[1 - fed])
    shift_s = estimate_time_shift(one.series, other.series)
    stamps_ns, seen = other.series.stamps_ns, other.series.positions
    T_camera_map = np.linalg.inv(LEVEL_MOUNTING)
    made = {RAW: one.series} | {
        name: run_one_camera(name, one.samples).series.transformed(T_camera_map)
        for name in estimators
    }
    views = {name: series.shifted(-shift_s).at(stamps_ns) for name, series in made.items()}
    # Only joints known to all methods are compared.
    known = known_joints(seen) & np.all([known_joints(view) for view in views.values()], axis=0)
    if known.sum() < 3:
        raise InputError(f"the two cameras share {known.sum()} joints: expected a common view")
    T_other_one = best_rigid_transform(views[RAW][known], seen[known])
    name = Path(recording.source).name
    period_s = float(np.median(np.diff(stamps_ns))) * 1e-9
    found = []
    for method, positions in views.items():
        moved = np.where(known[..., None], transformed(T_other_one, positions), np.nan)
        angles = rms_differences_deg(joint_angles(seen), joint_angles(moved))
        found.append(
            OtherView(
                recording=name.partition(".")[0],
                layout=next((text for key, text in LAYOUTS.items() if key in name), ""),
                camera=recording.streams[fed].name,
                method=method,
                seconds=period_s * float(np.sum(known.any(axis=1))),
                distance_cm=100.0 * mean_known(np.linalg.norm(moved - seen, axis=2)),
                angle_deg=mean_known([*angles.values()]),
            )
        )
    return found


def table(found: Sequence[OtherView]) -> Table:
    """A row per recording, both directions together, and the mean; a column per method."""
    layouts = {view.recording: view.layout for view in found}
    return method_table(
        "KinectMultiTrack: one Kinect v2 against what another saw",
        ("recording", "layout"),
        [
            (name.removeprefix("Study_"), layout, [v for v in found if v.recording == name])
            for name, layout in layouts.items()
        ],
        ("mean", ""),
        {"[cm]": ("distance_cm", 2), "[°]": ("angle_deg", 1)},
        "Real people, no truth. Mean distance of a joint, and RMS difference of the angles "
        "(mean over 12), from what the other camera saw; both directions. An estimate is laid on "
        "the other view as the raw view is.",
    )

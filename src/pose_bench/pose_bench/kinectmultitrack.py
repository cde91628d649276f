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
from pose_bench.tables import TextTable, number
from pose_core.api import ANGLES, best_rigid_transform, joint_angles, transformed, wrapped
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.finite_numbers import mean_known
from pose_evaluation.scores import known_joints
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
        found.append(
            OtherView(
                recording=name.partition(".")[0],
                layout=next((text for key, text in LAYOUTS.items() if key in name), ""),
                camera=recording.streams[fed].name,
                method=method,
                seconds=period_s * float(np.sum(known.any(axis=1))),
                distance_cm=100.0 * mean_known(np.linalg.norm(moved - seen, axis=2)),
                angle_deg=_angle_difference_deg(moved, seen),
            )
        )
    return found


def _angle_difference_deg(one: FloatArray, other: FloatArray) -> float:
    """RMS difference of each angle [deg], mean over the angles."""
    first, second = joint_angles(one), joint_angles(other)
    return mean_known(
        [
            float(np.degrees(np.sqrt(mean_known(wrapped(first[name] - second[name]) ** 2))))
            for name in ANGLES
        ]
    )


def table(found: Sequence[OtherView]) -> TextTable:
    """A row per recording, both directions together, and the mean; a column per method."""
    methods = list(dict.fromkeys(view.method for view in found))
    made = TextTable(
        title="KinectMultiTrack: one Kinect v2 against what another saw",
        header=(
            "recording",
            "layout",
            *(f"{method} [cm]" for method in methods),
            *(f"{method} [°]" for method in methods),
        ),
        note="Real people, no truth. Mean distance of a joint, and RMS difference of the angles "
        "(mean over 12), from what the other camera saw; both directions. An estimate is laid on "
        "the other view as the raw view is.",
    )
    layouts = {view.recording: view.layout for view in found}
    for recording, layout in layouts.items():
        own = [view for view in found if view.recording == recording]
        made.rows.append((recording.removeprefix("Study_"), layout, *_cells(own, methods)))
    made.rows.append(("mean", "", *_cells(found, methods)))
    return made


def _cells(views: Sequence[OtherView], methods: Sequence[str]) -> list[str]:
    def mean(method: str, figure: str) -> float:
        return mean_known([getattr(view, figure) for view in views if view.method == method])

    return [
        *(number(mean(method, "distance_cm"), 2) for method in methods),
        *(number(mean(method, "angle_deg"), 1) for method in methods),
    ]

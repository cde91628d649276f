"""The public recordings: which estimators see them, and their tables."""

from collections.abc import Sequence
from pathlib import Path

from pose_bench import kinectmultitrack, uiprmd
from pose_bench.kinectmultitrack import OtherView
from pose_bench.one_camera import RAW
from pose_bench.pool import Progress, run_all
from pose_bench.uiprmd import AngleAgreement

ESTIMATORS = ("joint_kf", "li2020", "default")
"""Those that are run on one camera, beside its raw view."""


def run_uiprmd(
    folder: Path, estimators: Sequence[str], *, jobs: int, progress: Progress
) -> tuple[list[AngleAgreement], dict[str, int]]:
    """Every repetition, raw and through each estimator; and the repetitions left out, by reason.

    Raises:
        InputError: If the folder holds no usable repetition, or one is damaged.
    """
    repetitions = uiprmd.read_repetitions(folder)
    subjects = dict.fromkeys(repetition.subject for repetition in repetitions.used)
    by_subject = [[r for r in repetitions.used if r.subject == subject] for subject in subjects]
    arguments = [(own, name) for name in (RAW, *estimators) for own in by_subject]
    found = run_all(uiprmd.compare_subject, arguments, jobs=jobs, progress=progress)
    return [each for agreements in found for each in agreements], repetitions.left_out.as_dict()


def run_kinectmultitrack(
    folder: Path, estimators: Sequence[str], *, jobs: int, progress: Progress
) -> list[OtherView]:
    """Every recording of one person: each camera's raw view and estimates against the other's.

    Raises:
        InputError: If the folder holds no usable recording, or one is damaged.
    """
    recordings = kinectmultitrack.single_person_recordings(folder)
    arguments = [(recording, fed, tuple(estimators)) for recording in recordings for fed in (0, 1)]
    found = run_all(kinectmultitrack.compare_views, arguments, jobs=jobs, progress=progress)
    return [view for views in found for view in views]

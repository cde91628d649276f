"""Cameras that do not show the subject are named, with the reason."""

import numpy as np
import pytest

from pose_core.joints import JOINTS
from pose_core.streams.repeated_frames import FROZEN_FRAMES, STILL_FRAMES
from pose_core.streams.samples import SkeletonSample
from pose_fusion.watching.cameras import MISSED_CHECKS, UNDECIDED, CameraWatch


def person(x, tracking_state=2):
    return SkeletonSample(
        stamp_ns=0,
        sensor="left",
        person="1",
        positions=np.full((len(JOINTS), 3), x),
        tracking_state=np.full(len(JOINTS), tracking_state, np.uint8),
    )


@pytest.fixture
def watch():
    """Both cameras have shown the subject once."""
    watch = CameraWatch(("left", "right"))
    watch.check({"left": 1, "right": 1})
    return watch


def looks(watch, note):
    for k in range(MISSED_CHECKS):
        assert not watch.missing
        note(k)
        watch.check({"left": 2 + k, "right": 1})
    return watch.missing


@pytest.mark.parametrize(
    ("note", "reason"),
    [
        (lambda watch, _: None, "silent"),
        (lambda watch, _: watch.note_trouble("right", "it has 3 bytes"), "3 bytes"),
        (lambda watch, _: watch.note_frame("right", []), "sees nobody"),
        (lambda watch, _: watch.note_frame("right", [person(np.nan, 0)]), "sees nobody"),
        (
            lambda watch, k: watch.note_frame("right", [person(1.0 + k)]),
            "at the subject's position",
        ),
    ],
    ids=["silent", "malformed", "nobody", "no joints", "somebody else"],
)
def test_a_camera_that_does_not_see_the_subject_is_reported_with_the_reason(watch, note, reason):
    missing = looks(watch, lambda k: note(watch, k))
    assert list(missing) == ["right"]
    assert reason in missing["right"]
    watch.check({"left": 9, "right": 2})
    assert not watch.missing


def test_a_frozen_camera_is_rejected_until_its_frames_change(watch):
    watch.note_frame("right", [person(1.0)])
    used = [watch.note_frame("right", [person(2.0)]) for _ in range(FROZEN_FRAMES + 2)]
    assert used == [True] * FROZEN_FRAMES + [False] * 2
    assert (
        "repeats one frame"
        in looks(watch, lambda _: watch.note_frame("right", [person(2.0)]))["right"]
    )
    assert watch.note_frame("right", [person(3.0)])


def test_a_camera_whose_joints_lose_their_positions_is_named_by_its_fault_and_not_as_frozen(watch):
    watch.note_frame("right", [person(1.0)])
    assert all(watch.note_frame("right", [person(np.nan, 0)]) for _ in range(FROZEN_FRAMES + 1))

    def note(_):
        watch.note_frame("right", [person(np.nan, 0)])
        watch.note_fault("right", "no joint has a position")

    assert looks(watch, note) == {"right": "no joint has a position"}
    assert not watch.faulty


def test_while_identities_are_undecided_no_pose_or_unit_is_blamed(watch):
    for k in range(MISSED_CHECKS):
        watch.note_frame("right", [person(1.0 + k)])
        watch.check({"left": 2 + k, "right": 1}, is_undecided=True)
    assert watch.missing == {"right": UNDECIDED}


def test_a_source_that_has_never_changed_is_not_a_frozen_camera(watch):
    assert all(watch.note_frame("right", [person(1.0)]) for _ in range(3 * FROZEN_FRAMES))


def test_a_source_that_has_never_changed_is_used_but_named_after_some_seconds(watch):
    for shown in (2, 3):
        assert all(watch.note_frame("right", [person(1.0)]) for _ in range(STILL_FRAMES + 1))
        watch.check({"left": shown, "right": shown})
    assert "alike" in watch.faulty["right"]


def test_a_camera_with_wrong_names_is_reported_though_it_never_showed_the_subject():
    watch = CameraWatch(("left", "right"))
    for shown in (1, 2):
        assert not watch.missing  # one frame in a check may be wrong
        watch.note_fault("right", "its frame_id is 'map'")
        watch.note_trouble("right", "it sees nobody")
        watch.check({"left": shown})
    assert watch.missing == {"right": "its frame_id is 'map'"}


def test_a_camera_that_never_showed_the_subject_is_reported_once_another_does():
    watch = CameraWatch(("left", "right"))
    for _ in range(3):
        watch.check({})
        assert not watch.missing
    watch.check({"left": 1})
    watch.check({"left": 2})
    assert watch.missing == {"right": "it is silent: check its node and its cable"}
    watch.check({"left": 2})
    assert not watch.faulty

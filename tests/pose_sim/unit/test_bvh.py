"""Captured motion from BVH files."""

import gzip

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_sim.captured.clip import RATE
from pose_sim.captured.clips import read_clip

FRAMES = 41
FRAME_S = 1.0 / 40.0


def bvh_text(names=lambda name: name, frames=FRAMES):
    """Somebody who stands, 1.7 m high in centimetres, and bends the left elbow at 60 degrees/s."""

    def joint(name, offset, *children, root=False):
        channels = "Zrotation Xrotation Yrotation"
        count = "6 Xposition Yposition Zposition" if root else "3"
        inside = "".join(children) or "End Site\n{\nOFFSET 0 10 0\n}\n"
        kind = "ROOT" if root else "JOINT"
        order.append(name)
        return (
            f"{kind} {names(name)}\n{{\nOFFSET {offset}\nCHANNELS {count} {channels}\n{inside}}}\n"
        )

    order: list[str] = []

    def limb(side, sign, first, second, third, start):
        x = 10 * sign
        end = joint(f"{side}{third}", "0 -40 0")
        middle = joint(f"{side}{second}", "0 -42 0", end)
        return joint(f"{side}{first}", f"{x} {start} 0", middle)

    legs = [limb(s, k, "UpLeg", "Leg", "Foot", 0) for s, k in (("Left", 1), ("Right", -1))]
    arms = [limb(s, k, "Arm", "ForeArm", "Hand", 0) for s, k in (("Left", 1), ("Right", -1))]
    neck = joint("Neck", "0 25 0", joint("Head", "0 10 0"))
    spine = joint("Spine", "0 25 0", neck, *arms)
    tree = joint("Hips", "0 0 0", *legs, spine, root=True)
    names_in_file = [
        "Hips",
        *(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot")),
        *("Spine", "Neck", "Head"),
        *(f"{side}{part}" for side in ("Left", "Right") for part in ("Arm", "ForeArm", "Hand")),
    ]
    rows = []
    for frame in range(frames):
        turns = {name: [0.0, 0.0, 0.0] for name in names_in_file}
        turns["LeftForeArm"][1] = -60.0 * frame * FRAME_S
        values = [0.0, 90.0, 10.0 * frame * FRAME_S]
        values += [number for name in names_in_file for number in turns[name]]
        rows.append(" ".join(f"{value:.6f}" for value in values))
    motion = f"MOTION\nFrames: {frames}\nFrame Time: {FRAME_S}\n" + "\n".join(rows)
    return f"HIERARCHY\n{tree}{motion}\n"


@pytest.fixture
def clip(tmp_path):
    path = tmp_path / "person.bvh.gz"
    path.write_bytes(gzip.compress(bvh_text().encode()))
    return read_clip(path)


def joint(clip, name):
    return clip.positions[:, JOINT_INDEX[name]]


def test_a_bvh_file_is_played_at_the_rate_of_all_clips(clip):
    assert len(clip) == round((FRAMES - 1) * FRAME_S * RATE) + 1


def test_centimetres_become_metres_with_z_up_and_the_persons_left_to_the_left(clip):
    thigh = joint(clip, "left_knee") - joint(clip, "left_hip")
    np.testing.assert_allclose(thigh, [[0.0, 0.0, -0.42]] * len(clip), atol=1e-5)
    across = joint(clip, "left_hip") - joint(clip, "right_hip")
    np.testing.assert_allclose(across, [[0.0, 0.2, 0.0]] * len(clip), atol=1e-5)
    forward = joint(clip, "neck")[-1] - joint(clip, "neck")[0]
    np.testing.assert_allclose(forward, [0.1, 0.0, 0.0], atol=1e-3)


def test_the_ankles_stand_on_the_floor(clip):
    assert np.min(joint(clip, "left_foot")[:, 2]) == pytest.approx(0.08, abs=1e-3)


def test_a_segment_turns_with_its_joint(clip):
    turn = clip.rotations["left_forearm"][0].inv() * clip.rotations["left_forearm"][-1]
    assert np.degrees(turn.magnitude()) == pytest.approx(60.0, abs=0.1)
    hand = joint(clip, "left_hand") - joint(clip, "left_elbow")
    assert hand[-1, 0] == pytest.approx(0.4 * np.sin(np.radians(60.0)), abs=1e-3)


def test_prefixes_and_other_spellings_of_joints_are_recognised(tmp_path):
    path = tmp_path / "other.bvh"
    spelt = {"LeftUpLeg": "mixamorig:Left_UpLeg", "RightForeArm": "rForeArm"}
    path.write_text(bvh_text(lambda name: spelt.get(name, name)))
    assert len(read_clip(path)) > 1


def test_a_file_without_a_joint_is_refused(tmp_path):
    path = tmp_path / "legless.bvh"
    path.write_text(bvh_text(lambda name: name.replace("LeftLeg", "Wheel")))
    with pytest.raises(InputError, match="has no joint leftleg"):
        read_clip(path)


def test_another_file_is_refused(tmp_path):
    path = tmp_path / "bad.bvh"
    path.write_text("nothing")
    with pytest.raises(InputError, match="is not a BVH file"):
        read_clip(path)

"""The 32 joints of Azure Kinect's body tracking, computed from the 15 of captured motion."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_INDEX, SIDES
from pose_io.recordings.joint_map_files import shipped_joint_map

MAP = "azure_kinect_ros"


def _mixtures() -> dict[str, dict[str, float]]:
    """Weights of the 15 joints, which add up to 1, by joint of the SDK."""
    hips = {"left_hip": 0.5, "right_hip": 0.5}
    mixed = {
        "PELVIS": hips,
        "SPINE_NAVEL": {"left_hip": 0.25, "right_hip": 0.25, "torso": 0.5},
        "SPINE_CHEST": {"torso": 1.0},
        "NECK": {"neck": 0.8, "head": 0.2},
        "HEAD": {"neck": 0.25, "head": 0.75},
        "NOSE": {"head": 1.0},
    }
    for side in SIDES:
        shoulder, elbow, hand = (f"{side}_{name}" for name in ("shoulder", "elbow", "hand"))
        hip, knee, foot = (f"{side}_{name}" for name in ("hip", "knee", "foot"))
        mixed |= {
            f"CLAVICLE_{side.upper()}": {"neck": 0.85, shoulder: 0.15},
            f"SHOULDER_{side.upper()}": {shoulder: 1.0},
            f"ELBOW_{side.upper()}": {elbow: 1.0},
            f"WRIST_{side.upper()}": {hand: 1.0},
            f"HAND_{side.upper()}": {elbow: -0.3, hand: 1.3},
            f"HANDTIP_{side.upper()}": {elbow: -0.6, hand: 1.6},
            f"THUMB_{side.upper()}": {elbow: -0.3, hand: 1.3},
            f"HIP_{side.upper()}": {hip: 1.0},
            f"KNEE_{side.upper()}": {knee: 1.0},
            f"ANKLE_{side.upper()}": {foot: 1.0},
            f"FOOT_{side.upper()}": {knee: -0.2, foot: 1.2},
            f"EYE_{side.upper()}": {"head": 1.0},
            # Ears lie 7 cm to the sides, as a shoulder lies 19 cm from the neck.
            f"EAR_{side.upper()}": {"head": 1.0, shoulder: 0.37, "neck": -0.37},
        }
    return mixed


_JOINTS = shipped_joint_map(MAP).joints
_WEIGHTS = np.zeros((len(_JOINTS), len(JOINT_INDEX)))
for _row, _name in enumerate(_JOINTS):
    for _joint, _weight in _mixtures()[_name].items():
        _WEIGHTS[_row, JOINT_INDEX[_joint]] = _weight
NEAREST = np.argmax(_WEIGHTS, axis=1)
"""Index of the nearest of the 15 joints to each of the 32."""


def azure_joints(positions: FloatArray) -> FloatArray:
    """Compute the 32 joints from the 15, (n, 15, 3) to (n, 32, 3) [m]."""
    return _WEIGHTS @ positions


def as_published(optical: FloatArray) -> FloatArray:
    """Map the 32 joints as ``kinect_bridge``'s source ``markers``, (n, 32, 3) to (n, 15, 3) [m]."""
    joint_map = shipped_joint_map(MAP)
    positions, _ = joint_map.convert(optical, joint_map.states(None)[None].repeat(len(optical), 0))
    return positions

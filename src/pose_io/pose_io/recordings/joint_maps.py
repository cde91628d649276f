"""Each SDK's joints and axes, and the 15 joints in a REP 103 optical frame made from them.

A position ``p_sdk`` in the SDK's axes and unit becomes
``p_optical = unit_m * R_optical_sdk @ p_sdk`` [m], x right, y down, z forward.

One of our joints is one of the SDK's, or the mean of two. Where an SDK offers a choice, the point
is taken that ends a rigid segment, so that bone lengths are constant and alike across sensors:

- ``hand`` is the wrist and ``foot`` the ankle: a bent wrist or ankle then changes neither the
  length of forearm and shank nor the angle of elbow and knee. The toes, for one, lie 9 cm in
  front of the ankle and would turn the shank by 12 degrees. NiTE2 has no such choice: its forearm
  ends in the palm and is about 7 cm longer.
- ``neck`` is the point between the shoulders where the arms hang, as NiTE2 has it and Kinect v1
  calls ``ShoulderCenter``; the ``Neck`` of Kinect v2 (7 cm) and Azure (4 cm) lies higher and
  moves with the head.
- ``head`` is the middle of the head: for Azure, whose ``HEAD`` is the skull's base, midway between
  the ears.
- ``torso`` is the spine joint nearest to the middle between neck and hips.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import JOINTS, SIDES, TrackingState

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.uint8]

# Columns: where the SDK's x, y and z point in the optical frame.
X_LEFT_Y_UP = np.diag([-1.0, -1.0, 1.0])
X_RIGHT_Y_DOWN = np.eye(3)
X_RIGHT_Y_UP = np.diag([1.0, -1.0, 1.0])  # left-handed


@dataclass(frozen=True, kw_only=True)
class JointMap:
    """How one SDK's skeleton becomes the 15 joints."""

    sensor: str
    joints: tuple[str, ...]  # the SDK's names, in the SDK's order
    sources: Mapping[str, tuple[str, ...]]  # one or two of them for each of the 15
    R_optical_sdk: FloatArray  # (3, 3) [-], a reflection if the SDK's axes are left-handed
    unit_m: float  # [m] per unit of the SDK

    def convert(
        self, positions: FloatArray, tracking_state: StateArray
    ) -> tuple[FloatArray, StateArray]:
        """Map an SDK's joints to the 15, in the optical frame.

        Args:
            positions: In the SDK's axes and unit, shape (..., n, 3) with the n joints of
                :attr:`joints`; NaN where missing.
            tracking_state: Values of ``TrackingState``, shape (..., n).

        Returns:
            Positions [m], shape (..., 15, 3), and states, shape (..., 15): a mean is tracked as
            badly as the worse of its sources, and NaN if one of them is missing.
        """
        index = {name: i for i, name in enumerate(self.joints)}
        first = [index[self.sources[name][0]] for name in JOINTS]
        second = [index[self.sources[name][-1]] for name in JOINTS]
        mean = 0.5 * (positions[..., first, :] + positions[..., second, :])
        state = np.minimum(tracking_state[..., first], tracking_state[..., second])
        return self.unit_m * mean @ self.R_optical_sdk.T, state


def _sided(pattern: Mapping[str, str], left: str, right: str) -> dict[str, tuple[str, ...]]:
    """Sources of the limbs' joints: ``{}`` in the SDK's name stands for its word for the side."""
    return {
        f"{side}_{ours}": (theirs.format(word),)
        for side, word in zip(SIDES, (left, right), strict=True)
        for ours, theirs in pattern.items()
    }


_KINECT_V1_V2_LIMBS = _sided(
    {
        "shoulder": "Shoulder{}",
        "elbow": "Elbow{}",
        "hand": "Wrist{}",
        "hip": "Hip{}",
        "knee": "Knee{}",
        "foot": "Ankle{}",
    },
    "Left",
    "Right",
)

KINECT_V1 = JointMap(
    sensor="Kinect v1",
    joints=(
        *("HipCenter", "Spine", "ShoulderCenter", "Head"),
        *("ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft"),
        *("ShoulderRight", "ElbowRight", "WristRight", "HandRight"),
        *("HipLeft", "KneeLeft", "AnkleLeft", "FootLeft"),
        *("HipRight", "KneeRight", "AnkleRight", "FootRight"),
    ),
    sources={
        "head": ("Head",),
        "neck": ("ShoulderCenter",),
        "torso": ("Spine",),
        **_KINECT_V1_V2_LIMBS,
    },
    R_optical_sdk=X_LEFT_Y_UP,
    unit_m=1.0,
)

KINECT_V2 = JointMap(
    sensor="Kinect v2",
    joints=(
        *("SpineBase", "SpineMid", "Neck", "Head"),
        *("ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft"),
        *("ShoulderRight", "ElbowRight", "WristRight", "HandRight"),
        *("HipLeft", "KneeLeft", "AnkleLeft", "FootLeft"),
        *("HipRight", "KneeRight", "AnkleRight", "FootRight"),
        *("SpineShoulder", "HandTipLeft", "ThumbLeft", "HandTipRight", "ThumbRight"),
    ),
    sources={
        "head": ("Head",),
        "neck": ("SpineShoulder",),
        "torso": ("SpineMid",),
        **_KINECT_V1_V2_LIMBS,
    },
    R_optical_sdk=X_LEFT_Y_UP,
    unit_m=1.0,
)

AZURE_KINECT = JointMap(
    sensor="Azure Kinect",
    joints=(
        *("PELVIS", "SPINE_NAVEL", "SPINE_CHEST", "NECK"),
        *("CLAVICLE_LEFT", "SHOULDER_LEFT", "ELBOW_LEFT", "WRIST_LEFT"),
        *("HAND_LEFT", "HANDTIP_LEFT", "THUMB_LEFT"),
        *("CLAVICLE_RIGHT", "SHOULDER_RIGHT", "ELBOW_RIGHT", "WRIST_RIGHT"),
        *("HAND_RIGHT", "HANDTIP_RIGHT", "THUMB_RIGHT"),
        *("HIP_LEFT", "KNEE_LEFT", "ANKLE_LEFT", "FOOT_LEFT"),
        *("HIP_RIGHT", "KNEE_RIGHT", "ANKLE_RIGHT", "FOOT_RIGHT"),
        *("HEAD", "NOSE", "EYE_LEFT", "EAR_LEFT", "EYE_RIGHT", "EAR_RIGHT"),
    ),
    sources={
        "head": ("EAR_LEFT", "EAR_RIGHT"),
        "neck": ("CLAVICLE_LEFT", "CLAVICLE_RIGHT"),
        "torso": ("SPINE_CHEST",),
        **_sided(
            {
                "shoulder": "SHOULDER_{}",
                "elbow": "ELBOW_{}",
                "hand": "WRIST_{}",
                "hip": "HIP_{}",
                "knee": "KNEE_{}",
                "foot": "ANKLE_{}",
            },
            "LEFT",
            "RIGHT",
        ),
    },
    R_optical_sdk=X_RIGHT_Y_DOWN,
    unit_m=0.001,
)

NITE2 = JointMap(
    sensor="NiTE2",
    joints=(
        *("HEAD", "NECK", "LEFT_SHOULDER", "RIGHT_SHOULDER", "LEFT_ELBOW", "RIGHT_ELBOW"),
        *("LEFT_HAND", "RIGHT_HAND", "TORSO", "LEFT_HIP", "RIGHT_HIP"),
        *("LEFT_KNEE", "RIGHT_KNEE", "LEFT_FOOT", "RIGHT_FOOT"),
    ),
    sources={name: (name.upper(),) for name in JOINTS},
    R_optical_sdk=X_RIGHT_Y_UP,
    unit_m=0.001,
)

JOINT_MAPS = {
    joint_map.sensor: joint_map for joint_map in (KINECT_V1, KINECT_V2, AZURE_KINECT, NITE2)
}


def mark_missing(positions: FloatArray, tracking_state: StateArray) -> None:
    """Make positions and states agree, in place: a joint that lacks one has neither.

    Args:
        positions: Shape (..., 3).
        tracking_state: Shape (...).
    """
    missing = ~np.isfinite(positions).all(axis=-1)
    missing |= tracking_state == TrackingState.NOT_TRACKED
    positions[missing] = np.nan
    tracking_state[missing] = TrackingState.NOT_TRACKED


def markdown_table() -> str:
    """The README's table of joints."""
    lines = [
        "| joint | " + " | ".join(f"{m.sensor} ({len(m.joints)})" for m in JOINT_MAPS.values()),
        "|---" * (1 + len(JOINT_MAPS)),
    ]
    for name in JOINTS:
        cells = [
            " + ".join(f"`{source}`" for source in joint_map.sources[name])
            for joint_map in JOINT_MAPS.values()
        ]
        lines.append(f"| `{name}` | " + " | ".join(cells))
    return "".join(f"{line} |\n" if line[-1] != "-" else f"{line}|\n" for line in lines)

"""Reading captured motion from BVH files: 15 joints and the segments' rotations.

The joint names of CMU, Mixamo and most other conversions are known (``LeftUpLeg``, ``LeftHip``,
``mixamorig:LeftArm`` …). The unit is the one for which the leg's length is nearest to a person's. A
BVH file's y points up and its z forward: ``(x, y, z)_map = (z, x, y)_bvh``.
"""

import gzip
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINTS, SIDES
from pose_io.references.markers import plain
from pose_sim.body import PROXIMAL_JOINTS
from pose_sim.captured.clip import Clip, resampled

if TYPE_CHECKING:
    import bvhio

UNITS_M = (1.0, 0.01, 0.001, 0.0254, 0.0564444)  # [m] m, cm, mm, inch, CMU's skeletons (ASF)
LEG_M = 0.83  # [m] thigh and shank of an adult
ANKLE_HEIGHT = 0.08  # [m] of the lowest one in the whole clip
MAX_STEP = 0.1  # [m] first frames with a larger distance to the next are rest poses
PLACES = {
    "hip": ("upleg", "hip", "thigh", "upperleg"),
    "knee": ("leg", "knee", "shin", "lowerleg", "calf"),
    "foot": ("foot", "ankle"),
    "shoulder": ("arm", "uparm", "upperarm", "shoulder"),
    "elbow": ("forearm", "elbow", "lowarm", "lowerarm"),
    "hand": ("hand", "wrist"),
}
"""Names of each joint in files, without the side, the most common first."""
ROOTS, NECKS, HEADS = ("hips", "hip", "pelvis", "root"), ("neck", "neck1"), ("head",)
R_MAP_BVH = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def is_bvh(path: Path) -> bool:
    """Whether a file's name is that of a BVH file, compressed or not."""
    return path.name.removesuffix(".gz").endswith(".bvh")


def read_bvh(path: Path) -> Clip:
    """Read a BVH file (``.bvh`` or ``.bvh.gz``).

    Raises:
        InputError: If it is not a BVH file, or lacks a joint.
    """
    skeleton = _Skeleton(path)
    positions = skeleton.joints()
    names = skeleton.segments()
    scale = _unit(positions)
    positions = np.asarray(scale * positions @ R_MAP_BVH.T, np.float64)
    rotations = {
        name: R_MAP_BVH @ skeleton.rotations[joint] @ R_MAP_BVH.T for name, joint in names.items()
    }
    first = _first_of_motion(positions)
    positions = positions[first:]
    ankles = positions[:, [JOINTS.index(f"{side}_foot") for side in SIDES], 2]
    positions[..., 2] += ANKLE_HEIGHT - np.percentile(ankles, 1.0)
    return resampled(
        path.name.partition(".")[0],
        skeleton.frame_s * np.arange(len(positions), dtype=np.float64),
        positions,
        {name: Rotation.from_matrix(each[first:]) for name, each in rotations.items()},
    )


class _Skeleton:
    """A file's joints: rotations and positions in its own axes and unit, n frames."""

    def __init__(self, path: Path) -> None:
        self._path = path
        container = _parsed(path)
        self.frame_s = float(container.FrameTime)
        self.rotations: dict[str, FloatArray] = {}  # (n, 3, 3) by name
        self._positions: dict[str, FloatArray] = {}  # (n, 3)
        self._ends: dict[str, FloatArray] = {}  # (3,) of joints without children
        self._parent: dict[str, str] = {}
        if container.FrameCount < 2:
            raise InputError(f"{path} holds {container.FrameCount} frames: expected a motion")
        self._add(container.Root, None)

    def _add(self, joint: "bvhio.BvhJoint", parent: str | None) -> None:
        """Forward kinematics of a joint and its descendants."""
        quaternions = np.array([[*each.Rotation] for each in joint.Keyframes])  # w first
        turn = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix()
        place = np.array([[*each.Position] for each in joint.Keyframes])
        if parent is not None:
            above = self.rotations[parent]
            place = self._positions[parent] + np.einsum("nij,nj->ni", above, place)
            turn = above @ turn
            self._parent[joint.Name] = parent
        self.rotations[joint.Name], self._positions[joint.Name] = turn, place
        if not joint.Children:
            self._ends[joint.Name] = np.array([*joint.EndSite])
        for child in joint.Children:
            self._add(child, joint.Name)

    def joints(self) -> FloatArray:
        """The 15 joints, (n, 15, 3)."""
        neck, head = self._named("", NECKS), self._named("", HEADS)
        found = {
            f"{side}_{joint}": self._positions[self._named(side, names)]
            for side in SIDES
            for joint, names in PLACES.items()
        }
        found["neck"] = self._positions[neck]
        # The middle of the head, if the file has the head's end.
        reach = 0.5 * self._ends.get(head, np.zeros(3))
        found["head"] = self._positions[head] + self.rotations[head] @ reach
        middle = 0.25 * (found["left_hip"] + found["right_hip"]) + 0.5 * found["neck"]
        spine = [self._positions[name] for name in self._spine(neck)]
        off = [np.median(np.linalg.norm(each - middle, axis=1)) for each in spine]
        found["torso"] = spine[int(np.argmin(off))]
        return np.stack([found[name] for name in JOINTS], axis=1)

    def segments(self) -> dict[str, str]:
        """The file's joint that rotates each segment."""
        neck = self._named("", NECKS)
        return {
            "pelvis": self._named("", ROOTS),
            "torso": self._parent.get(neck, neck),
            "head": self._named("", HEADS),
        } | {
            f"{side}_{segment}": self._named(side, PLACES[joint])
            for side in SIDES
            for segment, joint in PROXIMAL_JOINTS.items()
        }

    def _spine(self, neck: str) -> list[str]:
        """Joints between the root and the neck."""
        names = [neck]
        while (parent := self._parent.get(names[-1])) is not None:
            names.append(parent)
        return names[1:]

    def _named(self, side: str, wanted: Sequence[str]) -> str:
        known = {plain(name): name for name in reversed(self.rotations)}
        for name in wanted:
            for spelt in (side + name, side[:1] + name, name + side, f"{name}{side[:1]}"):
                if spelt in known:
                    return known[spelt]
        raise InputError(
            f"{self._path} has no joint {side}{wanted[0]}: it has {', '.join(self.rotations)}"
        )


def _parsed(path: Path) -> "bvhio.BvhContainer":
    import bvhio  # imported here: only BVH files need it and glm

    try:
        raw = path.read_bytes()
        text = gzip.decompress(raw) if path.name.endswith(".gz") else raw
        with tempfile.NamedTemporaryFile(suffix=".bvh") as plain:
            plain.write(text)
            plain.flush()
            return bvhio.readAsBvh(plain.name)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (SyntaxError, ValueError, IndexError, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a BVH file: {error}") from error


def _unit(positions: FloatArray) -> float:
    """The file's unit [m]."""
    chain = [JOINTS.index(f"left_{name}") for name in ("hip", "knee", "foot")]
    leg = np.linalg.norm(np.diff(positions[:, chain], axis=1), axis=2).sum(axis=1)
    return min(UNITS_M, key=lambda unit: abs(np.log(unit * np.median(leg) / LEG_M)))


def _first_of_motion(positions: FloatArray) -> int:
    """Index of the first frame after the rest poses at the beginning of some files."""
    step = np.linalg.norm(np.diff(positions[:5], axis=0), axis=2).max(axis=1)
    jumps = np.flatnonzero(step > MAX_STEP)
    return int(jumps[-1]) + 1 if len(jumps) else 0

"""Conversion of joint angles to REP 155's human model: its joints, signs and frames.

The model is that of ROS4HRI's package ``human_description`` (``urdf/human-tpl.xacro``): 20
revolute joints named ``<joint>_<id>``. Where its rotation axes differ, angles are computed from
the segment's rotation matrix: shoulders by z, x, z; hips by z, x, y; the head by x, z, y. Lateral
bending and rotation of the waist, for which it has no joint, are left out. Its limits are too
narrow for a squat; the published URDF has wider ones.
"""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_core.joints import SIDES

SIGNS = {side[0]: sign for side, sign in zip(SIDES, (1, -1), strict=True)}
"""Sign of the lateral axis by the first letter of a side."""
HANGING = 0.02  # [rad] abduction of a shoulder below which its two rotations are not separable
PI = float(np.pi)
MAX_EFFORT = 1000.0  # [N m] required by URDF
MAX_RATE = 50.0  # [rad/s] required by URDF


def joint_axes() -> dict[str, tuple[int, int, int]]:
    """Axis of each joint by its name without the id, in the model's order."""
    axes = {"waist": (0, 1, 0), "r_head": (1, 0, 0), "y_head": (0, 0, 1), "p_head": (0, -1, 0)}
    for letter, s in SIGNS.items():
        axes[f"{letter}_y_shoulder"] = (0, 0, -s)
        axes[f"{letter}_p_shoulder"] = (s, 0, 0)
        axes[f"{letter}_r_shoulder"] = (0, 0, s)
        axes[f"{letter}_elbow"] = (0, -1, 0)
    for letter, s in SIGNS.items():
        axes[f"{letter}_y_hip"] = (0, 0, -1)
        axes[f"{letter}_p_hip"] = (s, 0, 0)
        axes[f"{letter}_r_hip"] = (0, -1, 0)
        axes[f"{letter}_knee"] = (0, -1, 0)
    return axes


class HumanAngles:
    """Joint angles of the model, continuous: of two solutions, the one nearer to the previous."""

    def __init__(self) -> None:
        self._before: dict[str, FloatArray] = {}

    def convert(self, angles: Mapping[str, float]) -> dict[str, float]:
        """Compute the 20 angles [rad], in the model's order, from joint angles [rad] by name."""
        found = {"waist": angles.get("waist_flexion", 0.0), **self._head(angles)}
        for side in SIDES:
            letter = side[0]
            found.update(self._shoulder(letter, _limb(angles, side, "shoulder")))
            found[f"{letter}_elbow"] = angles[f"{side}_elbow_flexion"]
            found.update(self._hip(letter, _limb(angles, side, "hip")))
            found[f"{letter}_knee"] = -angles[f"{side}_knee_flexion"]
        return {name: float(found[name]) for name in joint_axes()}

    def _head(self, angles: Mapping[str, float]) -> dict[str, float]:
        flexion, bending = angles["neck_flexion"], angles["neck_lateral_bending"]
        R = Rotation.from_euler("YX", [flexion, bending])
        x, z, y = self._nearest("head", _euler("XZY", R))
        return {"r_head": x, "y_head": z, "p_head": -y}

    def _shoulder(self, letter: str, R: Rotation) -> dict[str, float]:
        s, name = SIGNS[letter], f"{letter}_shoulder"
        z1, x, z2 = self._nearest(name, self._zxz(name, R, s))
        return {
            f"{letter}_y_shoulder": -s * z1,
            f"{letter}_p_shoulder": s * x,
            f"{letter}_r_shoulder": s * z2,
        }

    def _hip(self, letter: str, R: Rotation) -> dict[str, float]:
        s, name = SIGNS[letter], f"{letter}_hip"
        z, x, y = self._nearest(name, _euler("ZXY", R))
        return {f"{letter}_y_hip": -z, f"{letter}_p_hip": s * x, f"{letter}_r_hip": -y}

    def _zxz(self, name: str, R: Rotation, s: float) -> list[FloatArray]:
        """Both solutions; for a hanging arm, the one with the previous first rotation."""
        M = R.as_matrix()
        middle = float(np.arccos(np.clip(M[2, 2], -1.0, 1.0)))
        if middle < HANGING:
            first = self._before[name][0] if name in self._before else -s * PI / 2.0
            whole = np.arctan2(M[1, 0], M[0, 0])
            return [np.array([first, s * middle, whole - first])]
        first, last = np.arctan2(M[0, 2], -M[1, 2]), np.arctan2(M[2, 0], M[2, 1])
        return [np.array([first, middle, last]), np.array([first + PI, -middle, last + PI])]

    def _nearest(self, name: str, solutions: list[FloatArray]) -> FloatArray:
        """The solution, with multiples of 2π, nearest to the previous one, at first to zero."""
        before = self._before.get(name, np.zeros(3))
        unrolled = [each - 2.0 * PI * np.round((each - before) / (2.0 * PI)) for each in solutions]
        if name in self._before:
            best = min(unrolled, key=lambda each: float(np.abs(each - before).sum()))
        else:
            # REP 155 counts abduction as positive.
            s = SIGNS[name[0]] if "shoulder" in name else 0  # 0: any solution
            outward = [each for each in unrolled if s * each[1] >= 0.0]
            best = min(outward or unrolled, key=lambda each: float(np.abs(each).sum()))
        self._before[name] = best
        return best


def _euler(order: str, R: Rotation) -> list[FloatArray]:
    a, b, c = R.as_euler(order)
    return [np.array([a, b, c]), np.array([a + PI, PI - b, c + PI])]


def _limb(angles: Mapping[str, float], side: str, joint: str) -> Rotation:
    """Rotation of a limb in its parent: R_y(−flexion) R_x(±abduction) R_z(∓rotation)."""
    s = SIGNS[side[0]]
    flexion, abduction, rotation = (
        angles[f"{side}_{joint}_{each}"] for each in ("flexion", "abduction", "rotation")
    )
    return Rotation.from_euler("YXZ", [-flexion, s * abduction, -s * rotation])


def human_urdf(offsets: Mapping[str, FloatArray], body: str) -> str:
    """The model as URDF, with a person's body measures.

    Args:
        offsets: Positions of joints in their parents' axes [m], by the names of ``joint_offsets``.
        body: The body's id, with which all names end.
    """
    robot = ElementTree.Element("robot", name=f"human_{body}")
    ElementTree.SubElement(robot, "link", name=f"body_{body}")
    axes, zero = joint_axes(), np.zeros(3)

    def add(joint: str, parent: str, child: str, origin: FloatArray) -> str:
        kind = "revolute" if joint in axes else "fixed"
        ElementTree.SubElement(robot, "link", name=f"{child}_{body}")
        found = ElementTree.SubElement(robot, "joint", name=f"{joint}_{body}", type=kind)
        ElementTree.SubElement(found, "parent", link=f"{parent}_{body}")
        ElementTree.SubElement(found, "child", link=f"{child}_{body}")
        ElementTree.SubElement(found, "origin", xyz=" ".join(f"{x:.5g}" for x in origin))
        if kind == "revolute":
            ElementTree.SubElement(found, "axis", xyz=" ".join(map(str, axes[joint])))
            turn = {"lower": f"{-2 * PI:.5f}", "upper": f"{2 * PI:.5f}"}
            most = {"effort": f"{MAX_EFFORT:g}", "velocity": f"{MAX_RATE:g}"}
            ElementTree.SubElement(found, "limit", turn | most)
        return child

    def chain(parent: str, origin: FloatArray, *links: tuple[str, str]) -> str:
        for joint, child in links:
            parent, origin = add(joint, parent, child, origin), zero
        return parent

    waist = chain("body", offsets["torso"], ("waist", "waist"))
    torso = chain(waist, offsets["neck"], ("torso", "torso"))
    head = [(f"{axis}_head", f"{axis}_head") for axis in "ryp"]
    chain(torso, zero, *head, ("head", "head"))
    for side in SIDES:
        a = side[0]
        arm = [(f"{a}_{axis}_shoulder", f"{a}_{axis}_shoulder") for axis in "yp"]
        shoulder = offsets[f"{side}_shoulder"] - offsets["neck"]  # the torso's frame is at the neck
        link = chain(torso, shoulder, *arm, (f"{a}_r_shoulder", f"{a}_shoulder"))
        link = chain(link, offsets[f"{side}_elbow"], (f"{a}_elbow", f"{a}_elbow"))
        chain(link, offsets[f"{side}_hand"], (f"{a}_wrist", f"{a}_wrist"))
        leg = [(f"{a}_{axis}_hip", f"{a}_{axis}_hip") for axis in "yp"]
        link = chain("body", offsets[f"{side}_hip"], *leg, (f"{a}_r_hip", f"{a}_hip"))
        link = chain(link, offsets[f"{side}_knee"], (f"{a}_knee", f"{a}_knee"))
        chain(link, offsets[f"{side}_foot"], (f"{a}_ankle", f"{a}_ankle"))
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def joint_offsets(urdf: str, subject: str) -> dict[str, FloatArray]:
    """Positions of the joints in their parents [m], from the URDF published by the fusion."""
    root = ElementTree.fromstring(urdf)
    origins = {}
    for element in root.findall("joint"):
        origin = element.find("origin")
        xyz = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
        origins[element.get("name", "")] = np.array(xyz.split(), float)
    zero = np.zeros(3)
    found = {
        "torso": origins.get("waist_flexion", zero),  # a body without a waist has none
        "neck": origins["neck_flexion"],
    }
    for side in SIDES:
        for joint in ("shoulder", "elbow", "hip", "knee"):
            found[f"{side}_{joint}"] = origins[f"{side}_{joint}_flexion"]
        for joint in ("hand", "foot"):
            found[f"{side}_{joint}"] = origins[f"{side}_{joint}_joint_{subject}"]
    return found

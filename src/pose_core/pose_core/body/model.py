"""A kinematic tree as data: links, joints, degrees of freedom, read from YAML.

The bundled models are in ``body_models/``. A user's own model is another file of the same form,
selected by its path. ``docs/extending/body_model.md`` lists what it may change; anything that the
arithmetic does not support, above all other axes, is refused.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SEGMENTS, SIDES
from pose_core.kernels.forward_kinematics import ROOT_DOF as ROOT_DOF
from pose_core.plain_yaml import parse_yaml

DOF_COUNTS = {
    "pelvis": (0,),
    "trunk": (0, 3),
    "head": (2, 3),
    "upper_arm": (3,),
    "thigh": (3,),
    "forearm": (1,),
    "shank": (1,),
}
"""Links that a model may have, without their side, and the numbers of degrees of freedom."""
BALLS, OUTWARD = ("shoulder", "hip"), (("left", 1), ("right", -1))
AXES = {
    "waist_flexion": (0, 1, 0),
    "waist_lateral_bending": (1, 0, 0),
    "waist_rotation": (0, 0, 1),
    "neck_flexion": (0, 1, 0),
    "neck_lateral_bending": (1, 0, 0),
    "neck_rotation": (0, 0, 1),
    **{f"{side}_{ball}_flexion": (0, -1, 0) for side in SIDES for ball in BALLS},
    **{f"{side}_{ball}_abduction": (out, 0, 0) for side, out in OUTWARD for ball in BALLS},
    **{f"{side}_{ball}_rotation": (0, 0, -out) for side, out in OUTWARD for ball in BALLS},
    **{f"{side}_elbow_flexion": (0, -1, 0) for side in SIDES},
    **{f"{side}_knee_flexion": (0, 1, 0) for side in SIDES},
}
"""Axis of each degree of freedom in its link's axes, by ``docs/conventions.md``."""


@dataclass(frozen=True, kw_only=True)
class Dof:
    """One rotational degree of freedom of a link."""

    name: str
    axis: tuple[float, float, float]  # unit, in the link's axes
    lower: float  # [rad]
    upper: float  # [rad]


@dataclass(frozen=True, kw_only=True)
class Link:
    """A rigid part of the body; the root has no parent and no joint."""

    name: str
    parent: str | None
    joint: str | None  # about which it rotates
    dof: tuple[Dof, ...]


@dataclass(frozen=True, kw_only=True)
class JointPlace:
    """Position of one of the 15 joints in its link."""

    link: str
    direction: tuple[float, float, float] | None  # unit; None: measured in the trunk


@dataclass(frozen=True, kw_only=True)
class BodyModel:
    """The tree of one person's body.

    The state's positions are the root's position [m], its rotation vector [rad], then the joint
    angles [rad] in ``angle_names``' order.
    """

    name: str
    links: Mapping[str, Link]  # parents before children
    joints: Mapping[str, JointPlace]
    angle_names: tuple[str, ...]
    segments: Mapping[str, str]  # segment -> link
    sliding: tuple[str, ...]  # joints that slide in their link by some centimetres

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """All degrees of freedom, in the state's order."""
        axes = ("x", "y", "z")
        return (
            *(f"pelvis_{axis}" for axis in axes),
            *(f"pelvis_rotation_{axis}" for axis in axes),
            *self.angle_names,
        )

    @cached_property
    def dof_index(self) -> dict[str, int]:
        """Index in the state of each degree of freedom."""
        return {name: index for index, name in enumerate(self.dof_names)}

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return len(self.dof_names)

    @cached_property
    def link_names(self) -> tuple[str, ...]:
        """The links, parents before children."""
        return tuple(self.links)

    @cached_property
    def link_index(self) -> dict[str, int]:
        """Index of each link."""
        return {name: index for index, name in enumerate(self.links)}

    @cached_property
    def parents(self) -> NDArray[np.int64]:
        """Index of each link's parent; −1 for the root."""
        parents = [link.parent for link in self.links.values()]
        return np.array([-1 if name is None else self.link_index[name] for name in parents])

    @cached_property
    def link_joints(self) -> NDArray[np.int64]:
        """Index of the joint that each link rotates about; −1 for the root."""
        joints = [link.joint for link in self.links.values()]
        return np.array([-1 if joint is None else JOINT_INDEX[joint] for joint in joints], np.int64)

    @cached_property
    def link_of_dof(self) -> dict[str, str]:
        """The link that each joint angle rotates."""
        return {dof.name: link.name for link in self.links.values() for dof in link.dof}

    def ends(self, link_name: str) -> tuple[str, str]:
        """The joints at both ends of a link: its own joint and the first joint fixed in it."""
        joint = self.links[link_name].joint
        if joint is None:
            return "left_hip", "neck"
        return joint, next(j for j in JOINTS if self.joints[j].link == link_name)

    @cached_property
    def limits(self) -> FloatArray:
        """Lower and upper limit of each joint angle, shape (angles, 2) [rad]."""
        dof = {each.name: each for link in self.links.values() for each in link.dof}
        return np.array([[dof[name].lower, dof[name].upper] for name in self.angle_names])


def available_models() -> list[str]:
    """Names of the bundled body models."""
    folder = resources.files("pose_core.body") / "body_models"
    return sorted(path.name[:-5] for path in folder.iterdir() if path.name.endswith(".yaml"))


def load_body_model(name: str) -> BodyModel:
    """Read and check a model.

    Args:
        name: Name of a bundled model, or the path of a YAML file (``….yaml``).

    Raises:
        InputError: If there is no such model, or its tree is broken or not supported.
    """
    is_path = name.endswith((".yaml", ".yml"))
    bundled = resources.files("pose_core.body") / "body_models" / f"{name}.yaml"
    try:
        text = (Path(name).expanduser() if is_path else bundled).read_text("utf-8")
    except OSError as error:
        raise InputError(
            f"found no body model '{name}': expected one of {', '.join(available_models())}, "
            "or the path of a YAML file"
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f"{name} is not YAML: it is not UTF-8 text") from error
    try:
        model = parse_body_model(parse_yaml(text, name))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"body model {name} lacks a field or has a wrong one ({type(error).__name__}: "
            f"{error}): expected the form of pose_core/body/body_models/default.yaml"
        ) from error
    if is_path and model.name in available_models():
        raise InputError(f"body model {name} is named '{model.name}' as a bundled one: rename it")
    return model


def parse_body_model(document: dict[str, Any]) -> BodyModel:
    """Build a model from its YAML document.

    Raises:
        InputError: If a parent, joint, segment or degree of freedom does not fit.
    """
    name = str(document["name"])
    links = {key: _parse_link(key, value) for key, value in document["links"].items()}
    joints = {
        key: JointPlace(
            link=value["link"],
            direction=None if value["direction"] == "measured" else tuple(value["direction"]),
        )
        for key, value in document["joints"].items()
    }
    model = BodyModel(
        name=name,
        links=links,
        joints=joints,
        angle_names=tuple(document["order"]),
        segments=document["segments"],
        sliding=tuple(document.get("sliding", ())),
    )
    _check(model)
    return model


def _parse_link(name: str, value: dict[str, Any]) -> Link:
    dof = tuple(
        Dof(
            name=dof_name,
            axis=tuple(axis),
            lower=float(np.radians(lower)),
            upper=float(np.radians(upper)),
        )
        for dof_name, axis, lower, upper in value["dof"]
    )
    return Link(name=name, parent=value["parent"], joint=value["joint"], dof=dof)


def _check(model: BodyModel) -> None:
    def fail(found: str, expected: str) -> NoReturn:
        raise InputError(f"body model '{model.name}': {found}: expected {expected}")

    if set(model.joints) != set(JOINTS):
        fail(f"joints {sorted(set(model.joints) ^ set(JOINTS))}", "exactly the 15 joints")
    seen: set[str] = set()
    for link in model.links.values():
        if (link.parent is None) != (not seen) or (link.parent and link.parent not in seen):
            fail(f"link '{link.name}' has parent {link.parent}", "one root, parents first")
        if link.joint is not None and model.joints[link.joint].link != link.parent:
            fail(
                f"link '{link.name}' hangs on {link.joint}", f"a joint of its parent {link.parent}"
            )
        seen.add(link.name)
    if sorted(model.angle_names) != sorted(model.link_of_dof):
        fail("'order' differs from the links' degrees of freedom", "each exactly once")
    if not re.fullmatch(r"[A-Za-z]\w*", model.name, re.ASCII):
        fail(f"the name is {model.name!r}", "letters, digits and underscores")
    _check_dof(model, fail)
    if unknown := set(model.sliding) - set(JOINTS):
        fail(f"sliding joints {sorted(unknown)}", "some of the 15 joints")
    for segment, link_name in model.segments.items():
        if segment not in SEGMENTS or link_name not in model.links:
            fail(f"segment '{segment}' on link '{link_name}'", "a known segment and link")


def _check_dof(model: BodyModel, fail: Callable[[str, str], NoReturn]) -> None:
    """Refuse degrees of freedom that forward kinematics or angle extraction do not support."""
    for link in model.links.values():
        kind = re.sub("^(left|right)_", "", link.name)
        counts = (0,) if link.parent is None else DOF_COUNTS.get(kind, ())
        if kind not in DOF_COUNTS:
            fail(f"link '{link.name}'", f"one of {', '.join(DOF_COUNTS)}, with left_ or right_")
        if len(link.dof) not in counts or (link.parent is not None and not link.dof):
            expected = " or ".join(str(count) for count in counts if count or not link.parent)
            fail(f"link '{link.name}' has {len(link.dof)} degrees of freedom", expected)
        for dof, letter in zip(link.dof, "yxz", strict=False):
            if dof.name not in AXES:
                fail(f"degree of freedom '{dof.name}'", f"one of {', '.join(AXES)}")
            if dof.axis != AXES[dof.name]:
                fail(f"{dof.name} turns about {list(dof.axis)}", f"{list(AXES[dof.name])}")
            if not dof.axis["xyz".index(letter)]:
                fail(f"link '{link.name}' turns in another order", "about y, then x, then z")
            if not dof.lower < dof.upper:
                found = f"{np.degrees(dof.lower):g} to {np.degrees(dof.upper):g}"
                fail(f"{dof.name} is limited to {found} degrees", "the lower limit first")
    for name, place in model.joints.items():
        direction = place.direction
        if direction is not None and (*direction[:2], abs(direction[2])) != (0, 0, 1):
            found = f"the bone to {name} points along {list(direction)}"
            fail(found, "[0, 0, 1] or [0, 0, -1]")

"""A kinematic tree as data: links, joints, degrees of freedom, read from YAML.

The bundled models are in ``body_models/``. A user's own model is another file of the same form,
selected by its path. ``docs/extending/body_model.md`` lists what it may change. All else has to
be as in the bundled model with the same root, because the arithmetic relies on it.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SEGMENTS, SIDES
from pose_core.kernels.forward_kinematics import ROOT_DOF as ROOT_DOF
from pose_core.kernels.joint_angle_extraction import FULL_TURN
from pose_core.plain_yaml import parse_yaml

FREE_DOF = {"head": (("neck_rotation", (0, 0, 1)),)}
"""Degrees of freedom that a link may have beyond those of a bundled model, and their axes."""
SEGMENT_LINKS = {
    "pelvis": ("pelvis", "trunk"),
    "torso": ("pelvis", "trunk"),
    **{f"{side}_hand": (f"{side}_forearm",) for side in SIDES},
    **{f"{side}_foot": (f"{side}_shank",) for side in SIDES},
}
"""Links that an IMU on a segment may measure; on every other segment: the link of its name."""
KEYS = ("name", "links", "order", "joints", "sliding", "segments")


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
        InputError: If the arithmetic does not support it.
    """
    model = _built(document)
    _check(model, _bundled("default" if "pelvis" in model.links else "li2020"))
    return model


@cache
def _bundled(name: str) -> BodyModel:
    text = (resources.files("pose_core.body") / "body_models" / f"{name}.yaml").read_text("utf-8")
    return _built(parse_yaml(text, name))


def _built(document: dict[str, Any]) -> BodyModel:
    where = f"body model '{document['name']}'"
    _refuse_unknown(where, document, KEYS)
    for name, value in document["links"].items():
        _refuse_unknown(f"{where}: link '{name}'", value, ("parent", "joint", "dof"))
    for name, value in document["joints"].items():
        _refuse_unknown(f"{where}: joint '{name}'", value, ("link", "direction"))
    return BodyModel(
        name=str(document["name"]),
        links={key: _parse_link(key, value) for key, value in document["links"].items()},
        joints={
            key: JointPlace(
                link=value["link"],
                direction=None if value["direction"] == "measured" else tuple(value["direction"]),
            )
            for key, value in document["joints"].items()
        },
        angle_names=tuple(document["order"]),
        segments=document["segments"],
        sliding=tuple(document.get("sliding", ())),
    )


def _refuse_unknown(where: str, section: Mapping[str, Any], known: tuple[str, ...]) -> None:
    if unknown := sorted(map(str, section.keys() - set(known))):
        raise InputError(f"{where} has {', '.join(unknown)}: expected some of {', '.join(known)}")


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


def _check(model: BodyModel, supported: BodyModel) -> None:
    """Refuse what differs from a bundled model in anything that the arithmetic relies on."""

    def fail(found: str, expected: str) -> NoReturn:
        raise InputError(f"body model '{model.name}': {found}: expected {expected}")

    if not re.fullmatch(r"[A-Za-z]\w*", model.name, re.ASCII):
        fail(f"the name is {model.name!r}", "letters, digits and underscores")
    if others := set(model.links) ^ set(supported.links):
        fail(f"links {sorted(others)}", f"exactly {', '.join(supported.links)}")
    if others := set(model.joints) ^ set(JOINTS):
        fail(f"joints {sorted(others)}", "exactly the 15 joints")
    for what, found, expected in _fixed(model, supported):
        if found != expected:
            fail(f"{what} {found}", str(expected))
    seen: set[str | None] = {None}
    for link in model.links.values():
        if link.parent not in seen:
            fail(f"link '{link.name}' comes before {link.parent}", "parents first")
        seen.add(link.name)
        for dof in link.dof:
            if not (dof.lower < dof.upper < dof.lower + FULL_TURN and abs(dof.lower) < FULL_TURN):
                found = f"{np.degrees(dof.lower):g} to {np.degrees(dof.upper):g} degrees"
                fail(f"{dof.name} is limited to {found}", "the lower limit first, within 360")
    if sorted(model.angle_names) != sorted(model.link_of_dof):
        fail("'order' differs from the links' degrees of freedom", "each exactly once")
    if unknown := set(model.sliding) - set(JOINTS):
        fail(f"sliding joints {sorted(unknown)}", "some of the 15 joints")
    for segment, name in model.segments.items():
        links = SEGMENT_LINKS.get(segment, (segment,))
        if segment not in SEGMENTS or name not in links or name not in model.links:
            fail(f"segment '{segment}' on link '{name}'", "a known segment on its own link")


def _fixed(model: BodyModel, supported: BodyModel) -> Iterator[tuple[str, Any, Any]]:
    """What a model may not change: its name in a message, as found and as expected."""
    for name, link in model.links.items():
        own = supported.links[name]
        yield f"link '{name}' has parent", link.parent, own.parent
        yield f"link '{name}' hangs on", link.joint, own.joint
        turns = [(dof.name, dof.axis) for dof in own.dof]
        if len(link.dof) > len(turns):
            turns += FREE_DOF.get(name, ())
        yield f"link '{name}' turns by", [(dof.name, dof.axis) for dof in link.dof], turns
    for name, place in model.joints.items():
        fixed = supported.joints[name]
        yield f"joint {name} is in link", place.link, fixed.link
        bone, own_bone = (each.direction or "measured" for each in (place, fixed))
        yield f"the bone to {name} points along", bone, own_bone

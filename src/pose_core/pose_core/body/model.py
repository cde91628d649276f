"""A kinematic tree as data: links, joints, degrees of freedom, read from YAML.

The models lie beside this module in ``body_models/``; each file explains its own fields.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SEGMENTS
from pose_core.streams.samples import FloatArray

ROOT_DOF = 6  # position [m], then rotation vector [rad]


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
    joint: str | None  # about which it turns
    dof: tuple[Dof, ...]


@dataclass(frozen=True, kw_only=True)
class JointPlace:
    """Where one of the 15 joints is fixed."""

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
    sliding: tuple[str, ...]  # joints that leave their place in their link by some centimetres

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
    def link_joints(self) -> NDArray[np.int64]:
        """Number of the joint that each link turns about; −1 of the root: none."""
        joints = [link.joint for link in self.links.values()]
        return np.array([-1 if joint is None else JOINT_INDEX[joint] for joint in joints], np.int64)

    @cached_property
    def link_of_dof(self) -> dict[str, str]:
        """The link that each joint angle turns."""
        return {dof.name: link.name for link in self.links.values() for dof in link.dof}

    def ends(self, link_name: str) -> tuple[str, str]:
        """The joints that show a link's direction: where it begins, and the first fixed in it."""
        joint = self.links[link_name].joint
        if joint is None:
            return "left_hip", "neck"
        return joint, next(j for j in JOINTS if self.joints[j].link == link_name)

    @cached_property
    def limits(self) -> FloatArray:
        """Lower and upper limit of each joint angle, shape (angles, 2) [rad]."""
        by_name = {
            dof.name: (dof.lower, dof.upper) for link in self.links.values() for dof in link.dof
        }
        return np.array([by_name[name] for name in self.angle_names])


def available_models() -> list[str]:
    """Names of the body models that come with the package."""
    folder = resources.files("pose_core.body") / "body_models"
    return sorted(path.name[:-5] for path in folder.iterdir() if path.name.endswith(".yaml"))


def load_body_model(name: str) -> BodyModel:
    """Read and check a model that comes with the package.

    Raises:
        InputError: If there is no such model or its tree is broken.
    """
    path = resources.files("pose_core.body") / "body_models" / f"{name}.yaml"
    try:
        document = yaml.safe_load(path.read_text())
    except OSError as error:
        raise InputError(
            f"found no body model '{name}': expected one of {', '.join(available_models())}"
        ) from error
    return parse_body_model(document)


def parse_body_model(document: dict[str, Any]) -> BodyModel:
    """Build a model from its YAML document.

    Raises:
        InputError: If a parent, joint, segment or degree of freedom does not fit.
    """
    name = document["name"]
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
    def fail(found: str, expected: str) -> None:
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
    if unknown := set(model.sliding) - set(JOINTS):
        fail(f"sliding joints {sorted(unknown)}", "some of the 15 joints")
    for segment, link_name in model.segments.items():
        if segment not in SEGMENTS or link_name not in model.links:
            fail(f"segment '{segment}' on link '{link_name}'", "a known segment and link")

"""Robot files: assignment of a URDF's joints to a person's arm; ``robots/*.yaml`` or a user's."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pose_core.errors import InputError
from pose_core.joints import SIDE_SIGNS
from pose_teleop.extras import in_package

Vector = tuple[float, ...]
_FOLDER = Path(__file__).with_name("robots")
_REQUIRED = ("urdf", "joints", "shoulder", "elbow", "tool", "rest")


@dataclass(frozen=True, kw_only=True)
class JointRule:
    """``robot angle = scale * person's angle + offset`` [rad]."""

    joint: str
    angle: str  # angle of the person's arm, without its side
    scale: float
    offset: float


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Description of a robot's arm of one side; n joints."""

    name: str
    urdf: Path
    joints: tuple[str, ...]
    shoulder: str  # frames
    elbow: str
    tool: str
    tool_axis: Vector  # in the tool's frame, out of the forearm
    mount: Vector  # [rad] roll, pitch, yaw of the robot's root in the person's trunk
    rest: Vector  # [rad] (n,)
    rules: tuple[JointRule, ...]
    max_velocity: float  # [rad/s] 0: only the URDF's limit
    max_acceleration: float  # [rad/s2]


def shipped_robots() -> tuple[str, ...]:
    """The names of the bundled robots."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


def load_robot(name: str, side: str, urdf: str = "") -> RobotFile:
    """Load a bundled robot by its name, or a user's by the path of its YAML file.

    Args:
        name: Name or path.
        side: The robot's side: ``left`` or ``right``.
        urdf: Another URDF than the file's, if not empty.

    Raises:
        InputError: If there is no such robot, or its file is invalid.
    """
    shipped = shipped_robots()
    path = _FOLDER / f"{name}.yaml" if name in shipped else Path(name).expanduser()
    if not path.is_file():
        known = ", ".join(shipped)
        raise InputError(f"found no robot '{name}': expected one of {known}, or a YAML file")
    try:
        content = yaml.safe_load(path.read_text("utf-8"))
    except yaml.YAMLError as error:
        raise InputError(f"{name} is not YAML: {str(error).splitlines()[0]}") from error
    missing = [key for key in _REQUIRED if key not in (content or {})]
    if missing:
        raise InputError(f"robot {name} lacks {', '.join(missing)}: see robots/g1.yaml")
    try:
        return _robot(path.stem, content, side, urdf)
    except (TypeError, ValueError, KeyError, AttributeError, IndexError) as error:
        raise InputError(f"robot {name} is not as robots/g1.yaml: {error!r}") from error


def _robot(name: str, content: dict[str, Any], side: str, urdf: str) -> RobotFile:
    sign = SIDE_SIGNS[side]
    rest = np.array(content["rest"], float)
    rest[content.get("rest_flips", [])] *= sign
    mounts = content.get("mount", {})
    return RobotFile(
        name=name,
        urdf=in_package(urdf or content["urdf"]),
        joints=tuple(joint.format(side=side) for joint in content["joints"]),
        **{frame: content[frame].format(side=side) for frame in ("shoulder", "elbow", "tool")},
        tool_axis=tuple(map(float, content.get("tool_axis", (0, 0, 1)))),
        mount=tuple(map(float, mounts.get(side, (0, 0, 0)))),
        rest=tuple(rest.tolist()),
        rules=tuple(
            JointRule(
                joint=joint.format(side=side),
                angle=rule["of"],
                scale=float(rule.get("scale", 1.0)) * (sign if rule.get("flips") else 1.0),
                offset=float(rule.get("offset", 0.0)),
            )
            for joint, rule in content.get("map", {}).items()
        ),
        max_velocity=float(content.get("max_velocity", 0.0)),
        max_acceleration=float(content.get("max_acceleration", 10.0)),
    )

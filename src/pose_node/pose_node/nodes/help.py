"""A node's answer to ``--help`` and to arguments that ROS does not know."""

import inspect
import sys
import textwrap
from pathlib import Path

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from pose_core.parameters import ParameterSpec, specs

RCLError = rclpy_implementation.RCLError
WIDTH = 100  # [columns]


def help_text(program: str, about: str, parameters: type) -> str:
    """Half a page: what the node does, how to set a parameter, and which there are.

    Args:
        program: The executable's name.
        about: One sentence.
        parameters: The dataclass that declares the node's parameters.
    """
    known = specs(parameters)
    names = {name: f"{name}:={_shown(default)}" for name, (default, _) in known.items()}
    width = min(max(map(len, names.values()), default=0), WIDTH // 2)
    rows = [f"  {names[name]:{width}}  {_explained(spec)}" for name, (_, spec) in known.items()]
    lines = [
        f"usage: {program} [--ros-args -p NAME:=VALUE … --params-file FILE -r FROM:=TO …]",
        *textwrap.wrap(about, WIDTH),
        "",
        "parameters, with their defaults (in full: the package's README):",
        *(row if len(row) <= WIDTH else f"{row[: WIDTH - 2].rstrip()} …" for row in rows),
    ]
    return "\n".join(lines)


def answer_arguments(make_node: object, parameters: type) -> None:
    """Print the help and exit if requested; refuse arguments that ROS would ignore."""
    try:
        program, *rest = remove_ros_args(sys.argv)
    except RCLError:
        return  # it will be said when ROS starts
    if "--help" in rest or "-h" in rest:
        about = (inspect.getdoc(inspect.getmodule(make_node)) or "").partition("\n\n")[0]
        print(help_text(Path(program).name, about.replace("`", ""), parameters))
        sys.exit(0)
    if rest:
        print(
            f"error: {Path(program).name} does not know '{rest[0]}': parameters go as"
            " '--ros-args -p name:=value'; --help lists them",
            file=sys.stderr,
        )
        sys.exit(2)


def _shown(default: object) -> str:
    if isinstance(default, tuple):
        return f"[{','.join(default)}]"
    return str(default).lower() if isinstance(default, bool) else str(default) or "''"


def _explained(spec: ParameterSpec) -> str:
    unit = "" if spec.unit == "-" else f" [{spec.unit}]"
    allowed = f" ({spec.range_text})" if spec.range_text and spec.choices is None else ""
    return f"{spec.doc.replace('`', '')}{unit}{allowed}"

"""Tables in READMEs that are generated from the code."""

import re
from collections.abc import Iterable
from pathlib import Path

from pose_core.joints import JOINTS
from pose_core.parameters import specs, type_name
from pose_io.recordings.joint_maps import JointMap

SRC = Path(__file__).parents[2] / "src"


def generated_part(package: str, name: str) -> str:
    """The part of a package's README between the comments of that name."""
    readme = (SRC / package / "README.md").read_text()
    found = re.search(rf"<!-- {name} -->\n(.*?)<!-- /{name} -->", readme, re.DOTALL)
    assert found, f"no <!-- {name} --> in the README of {package}"
    return found[1]


def markdown_table(parameters: type) -> str:
    """The README's table of parameters."""
    lines = ["| name | type | default | unit | range | meaning |", "|---|---|---|---|---|---|"]
    for name, (default, spec) in specs(parameters).items():
        shown = ", ".join(default) if isinstance(default, tuple) else default
        lines.append(
            f"| `{name}` | {type_name(default)} | {shown} | {spec.unit} "
            f"| {spec.range_text} | {spec.doc} |"
        )
    return "\n".join(lines) + "\n"


def joints_table(joint_maps: Iterable[JointMap]) -> str:
    """The README's table of joints."""
    maps = list(joint_maps)
    lines = [
        "| joint | " + " | ".join(f"{m.sensor} ({len(m.joints)})" for m in maps),
        "|---" * (1 + len(maps)),
    ]
    for name in JOINTS:
        cells = [
            " + ".join(f"`{source}`" for source in joint_map.sources[name]) for joint_map in maps
        ]
        lines.append(f"| `{name}` | " + " | ".join(cells))
    return "".join(f"{line} |\n" if line[-1] != "-" else f"{line}|\n" for line in lines)

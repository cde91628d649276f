"""Tables in READMEs that are generated from the code."""

from collections.abc import Iterable

from pose_core.joints import JOINTS
from pose_core.parameters import specs, type_name
from pose_io.recordings.joint_maps import JointMap


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

"""Grammar of the YAML front end of ROS 2 Jazzy's ``launch`` and ``launch_ros``, as data.

Apart from our launcher, so that one holds the other. A kind is ``str``, ``bool``, ``float`` (an
integer is none, nor is a quoted number), a list of parts (their attributes), or ``object``.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

PAIR = {"name": str, "value": str}
PARAM: dict[str, Any] = {"from": str, "name": str, "value": object, "type": str}
PARAM["param"] = [PARAM]
PROCESS = {
    "cwd": str,
    "env": [PAIR],
    "launch-prefix": str,
    "output": str,
    "respawn": (str, bool),
    "respawn_delay": float,
    "shell": bool,
    "on_exit": str,
}
ACTIONS: dict[str, dict[str, Any]] = {
    "arg": {"name": str, "default": str, "description": str, "choice": [{"value": str}]},
    "let": PAIR,
    "set_env": PAIR,
    "push_ros_namespace": {"namespace": str},
    "include": {"file": str, "arg": [PAIR]},
    "group": {"scoped": bool, "forwarding": bool, "keep": [PAIR]},
    "log": {"message": str},
    "executable": {"cmd": str, "name": str, **PROCESS},
    "node": {
        "pkg": str,
        "exec": str,
        "name": str,
        "namespace": str,
        "args": str,
        "ros_args": str,
        "param": [PARAM],
        "remap": [{"from": str, "to": str}],
        **PROCESS,
    },
}
REQUIRED = {
    "arg": {"name"},
    "let": set(PAIR),
    "set_env": set(PAIR),
    "push_ros_namespace": {"namespace"},
    "include": {"file"},
    "log": {"message"},
    "executable": {"cmd"},
    "node": {"pkg", "exec"},
}
SUBSTITUTIONS = frozenset(
    [
        "var",
        "env",
        "find-pkg-share",
        "find-pkg-prefix",
        "command",
        "equals",
        "not-equals",
        "and",
        "or",
        "not",
    ]
)
"""Those that mean the same wherever they stand: ``dirname`` does not, after an include."""


def complaints(file: Path) -> list[str]:
    """What ``ros2 launch`` would refuse, or take for something else, in a launch file."""
    document = yaml.safe_load(file.read_text())
    if not isinstance(document, dict) or set(document) != {"launch"}:
        return ["expected 'launch' alone at the top"]
    return list(_of_actions(document["launch"]))


def _of_actions(actions: Any) -> Iterator[str]:
    if not isinstance(actions, list):
        yield f"{actions!r} is no list of actions"
        return
    for action in actions:
        if not isinstance(action, dict) or len(action) != 1:
            yield f"{action!r} is not one action"
            continue
        ((kind, element),) = action.items()
        if kind not in ACTIONS:
            yield f"there is no action '{kind}'"
        elif kind == "group":
            yield from _of_group(element)
        else:
            yield from _of_attributes(kind, element, {"if": str, "unless": str, **ACTIONS[kind]})
            yield from (f"'{kind}' lacks '{name}'" for name in REQUIRED[kind] - set(element))


def _of_group(element: Any) -> Iterator[str]:
    if isinstance(element, dict):
        attributes = {name: value for name, value in element.items() if name != "children"}
        known = {"if": str, "unless": str, **ACTIONS["group"]}
        yield from _of_attributes("group", attributes, known)
        element = element.get("children")
    yield from _of_actions(element)


def _of_attributes(where: str, element: Any, known: dict[str, Any]) -> Iterator[str]:
    if not isinstance(element, dict):
        yield f"'{where}' holds {element!r}, not attributes"
        return
    for name, value in element.items():
        kind = known.get(name)
        if kind is None:
            yield f"'{where}' has no attribute '{name}'"
        elif isinstance(kind, list):
            if not isinstance(value, list) or not value:
                yield f"'{name}' of '{where}' is no list of parts"
                continue
            for part in value:
                yield from _of_attributes(name, part, kind[0])
        elif not isinstance(value, kind):
            yield f"'{name}' of '{where}' is {value!r}"
        elif isinstance(value, str):
            yield from _of_text(value)
    if str(element.get("type")).startswith("list_of_") and not isinstance(element["value"], list):
        yield f"'value' of '{where}' is {element['value']!r}, not a list"


def _of_text(text: str) -> Iterator[str]:
    if re.search(r"""\$\(.* (''|"")""", text):
        yield f"an empty argument, which is the text [], in {text!r}"
    for name in re.findall(r"\$\(\s*([^\s)]*)", text):
        if name not in SUBSTITUTIONS:
            yield f"$({name} …) in {text!r}"

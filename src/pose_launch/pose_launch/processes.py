"""Processes of a graph, and the ROS arguments of nodes."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pose_core.plain_yaml import dump_yaml

ParameterSource = Path | Mapping[str, Any]
"""A parameter file, or values by name (nested names with dots)."""


@dataclass(frozen=True, kw_only=True)
class Process:
    """One process to run."""

    name: str  # prefix of its output, unique in the graph
    command: tuple[str, ...]  # program and arguments, without ROS arguments
    is_node: bool = False  # whether it accepts ROS arguments
    node_name: str | None = None  # if the launch file gives one
    namespace: str | None = None
    parameters: tuple[ParameterSource, ...] = ()  # later ones override
    remappings: tuple[tuple[str, str], ...] = ()  # pairs of names
    respawn: bool = False  # whether to restart it when it ends
    respawn_delay_s: float = 0.0  # [s]
    ends_graph: bool = False  # whether the graph is stopped when it ends

    def full_command(self, parameter_folder: Path) -> list[str]:
        """The command with ROS arguments; values are written to files in ``parameter_folder``."""
        parameters = []
        for index, source in enumerate(self.parameters):
            if not isinstance(source, Path):
                path = parameter_folder / f"{self.name}.{index}.yaml"
                path.write_text(dump_yaml({self._key(): {"ros__parameters": dict(source)}}))
                source = path
            parameters += ["--params-file", str(source)]
        return self._with(parameters)

    def shown(self) -> str:
        """An equivalent shell command, with values as ``-p``."""
        parameters = []
        for source in self.parameters:
            if isinstance(source, Path):
                parameters += ["--params-file", str(source)]
                continue
            for name, value in source.items():
                text = dump_yaml(value, default_flow_style=True, width=10**6)
                parameters += ["-p", f"{name}:={text.removesuffix('...' + chr(10)).strip()}"]
        return shlex.join(self._with(parameters))

    def _with(self, parameters: list[str]) -> list[str]:
        """The command with the names and these arguments for parameters."""
        if not self.is_node:
            return list(self.command)
        names = (("__node", self.node_name), ("__ns", self.namespace), *self.remappings)
        command = [*self.command, "--ros-args"]
        for source, target in names:
            command += [] if target is None else ["-r", f"{source}:={target}"]
        return command + parameters

    def _key(self) -> str:
        """The node's key in a parameter file."""
        if self.node_name is None or self.namespace is None:
            return "/**"
        return f"{self.namespace.rstrip('/')}/{self.node_name}"

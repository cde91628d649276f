"""Evaluates the actions of a launch file to processes, in order, like ``ros2 launch``.

The package's README lists the differences.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pose_core.errors import InputError
from pose_launch import node_parameters
from pose_launch.document import Entity, read_launch_file
from pose_launch.errors import LaunchError, located
from pose_launch.processes import Process
from pose_launch.substitutions import Scope, condition, resolve, split_command_line
from pose_node import child_process

DEEPEST_INCLUDE = 20


@dataclass(frozen=True, kw_only=True)
class Argument:
    """An argument that a launch file declares."""

    name: str
    default: str | None  # as written; None: required
    description: str


@dataclass(frozen=True, kw_only=True)
class Graph:
    """Result of evaluating a launch file."""

    arguments: tuple[Argument, ...]
    processes: tuple[Process, ...]


class LaunchEvaluation:
    """One pass over a launch file and its includes.

    Args:
        given: Arguments from the command line.
        describe: Only collect the arguments: missing ones are empty, commands of substitutions
            are not run, executables need not exist.
    """

    def __init__(self, given: Mapping[str, str], *, describe: bool = False) -> None:
        self._given = dict(given)
        self._describe = describe
        self._variables = dict(given)
        self._passed: frozenset[str] | None = None  # arguments passed by the include, if in one
        self._depth = 0  # of includes
        self._arguments: dict[str, Argument] = {}
        self._settled: set[str] = set()  # arguments set by an include
        self._processes: list[Process] = []
        self._actions: dict[str, Callable[[Entity], None]] = {
            "arg": self._arg,
            "let": self._let,
            "node": self._node,
            "executable": self._executable,
            "include": self._include,
            "group": self._group,
            "push_ros_namespace": self._push_namespace,
        }
        self._namespace = ""  # of the nodes that follow in this group; empty: the root

    def run(self, file: Path) -> Graph:
        """Evaluate a file.

        Raises:
            PoseError: If something in it is invalid, missing or not supported.
        """
        self._evaluate_file(file)
        unknown = sorted(set(self._given) - set(self._arguments))
        if unknown:
            raise InputError(
                f"{file.name} has no argument '{unknown[0]}':"
                f" there are {', '.join(self._arguments) or 'none'}"
            )
        return Graph(arguments=tuple(self._arguments.values()), processes=tuple(self._processes))

    # -- plumbing -------------------------------------------------------------------------------

    def _scope(self) -> Scope:
        return Scope(variables=self._variables, run_commands=not self._describe)

    def _text(self, entity: Entity, name: str) -> str:
        with located(entity.place_of(name)):
            return resolve(entity.required_text(name), self._scope())

    def _optional_text(self, entity: Entity, name: str) -> str | None:
        text = entity.text(name)
        with located(entity.place_of(name)):
            return None if text is None else resolve(text, self._scope())

    def _condition(self, entity: Entity, name: str, *, default: bool) -> bool:
        text = entity.text(name)
        with located(entity.place_of(name)):
            return default if text is None else condition(text, self._scope())

    def _evaluate_file(self, file: Path, passed: frozenset[str] | None = None) -> None:
        if self._depth > DEEPEST_INCLUDE:
            raise InputError(f"{file} includes itself")
        before = self._passed
        self._passed = passed
        self._depth += 1
        self._evaluate(read_launch_file(file))
        self._passed = before
        self._depth -= 1

    def _evaluate(self, parent: Entity) -> None:
        for entity in parent.children():
            action = self._actions.get(entity.kind)
            if action is None:
                raise LaunchError(
                    entity.place,
                    f"the action '{entity.kind}' is not supported:"
                    f" there are {', '.join(self._actions)}",
                )
            is_wanted = self._condition(entity, "if", default=True)
            if is_wanted and not self._condition(entity, "unless", default=False):
                action(entity)
                entity.finish()

    # -- actions --------------------------------------------------------------------------------

    def _arg(self, entity: Entity) -> None:
        name = entity.required_text("name")
        default = entity.text("default")
        description = entity.text("description") or ""
        if name not in self._settled:
            argument = Argument(name=name, default=default, description=description)
            self._arguments.setdefault(name, argument)
        passed = self._passed
        if default is None and passed is not None and name not in passed:
            raise LaunchError(
                entity.place,
                f"the argument '{name}' has no default: a file that includes this one has to pass"
                " it ('ros2 launch' requires it)",
            )
        if name not in self._variables:
            if default is None and not self._describe:
                about = f" ({description})" if description else ""
                raise LaunchError(
                    entity.place, f"the argument '{name}'{about} must be given: {name}:=VALUE"
                )
            self._variables[name] = self._optional_text(entity, "default") or ""

    def _let(self, entity: Entity) -> None:
        self._variables[self._text(entity, "name")] = self._text(entity, "value")

    def _group(self, entity: Entity) -> None:
        variables, namespace = self._variables, self._namespace
        self._variables = dict(variables)
        self._evaluate(entity)
        self._variables, self._namespace = variables, namespace

    def _push_namespace(self, entity: Entity) -> None:
        self._namespace = self._within(self._text(entity, "namespace"))

    def _within(self, namespace: str) -> str:
        """A namespace within the group's, unless it is absolute."""
        if namespace.startswith("/"):
            return "/" + namespace.strip("/")
        return f"{self._namespace}/{namespace.strip('/')}".rstrip("/")

    def _include(self, entity: Entity) -> None:
        file = Path(self._text(entity, "file"))
        arguments = [
            (self._text(argument, "name"), self._text(argument, "value"))
            for argument in entity.parts("arg")
        ]
        self._variables.update(arguments)
        names = frozenset(name for name, _ in arguments)
        self._settled |= names
        if file.is_file():
            self._evaluate_file(file, names)
        elif not self._describe:
            raise LaunchError(entity.place_of("file"), f"found no launch file {file}")

    def _node(self, entity: Entity) -> None:
        package, executable = self._text(entity, "pkg"), self._text(entity, "exec")
        program = executable
        if not self._describe:
            with located(entity.place_of("exec")):
                program = str(child_process.executable(package, executable))
        namespace = self._optional_text(entity, "namespace")
        name = self._optional_text(entity, "name")
        process = self._process(entity, name or executable, (program, *self._words(entity, "args")))
        self._processes.append(
            replace(
                process,
                is_node=True,
                node_name=name,
                namespace=self._namespace or None
                if namespace is None
                else self._within(namespace) or "/",
                parameters=node_parameters.sources(entity.parts("param"), self._scope()),
                remappings=tuple(
                    (self._text(remap, "from"), self._text(remap, "to"))
                    for remap in entity.parts("remap")
                ),
            )
        )

    def _executable(self, entity: Entity) -> None:
        words = self._words(entity, "cmd")
        if not words:
            raise LaunchError(entity.place, "'executable' lacks 'cmd'")
        name = self._optional_text(entity, "name") or Path(words[0]).name
        self._processes.append(self._process(entity, name, words))

    def _words(self, entity: Entity, attribute: str) -> tuple[str, ...]:
        with located(entity.place_of(attribute)):
            return tuple(split_command_line(entity.text(attribute) or "", self._scope()))

    def _process(self, entity: Entity, name: str, command: tuple[str, ...]) -> Process:
        """Create a process from the attributes common to nodes and other executables."""
        entity.text("output")  # accepted and ignored: all output is shown
        on_exit = entity.text("on_exit")
        if on_exit not in (None, "shutdown"):
            raise LaunchError(
                entity.place_of("on_exit"), f"on_exit is '{on_exit}', expected 'shutdown'"
            )
        delay_s = entity.number("respawn_delay") or 0.0
        if delay_s < 0.0:
            raise LaunchError(entity.place_of("respawn_delay"), f"{delay_s} s is negative")
        return Process(
            name=self._unique_name(name),
            command=command,
            respawn=self._condition(entity, "respawn", default=False),
            respawn_delay_s=delay_s,
            ends_graph=on_exit == "shutdown",
        )

    def _unique_name(self, name: str) -> str:
        used = {process.name for process in self._processes}
        candidates = (name if count == 1 else f"{name}-{count}" for count in range(1, 10**6))
        return next(candidate for candidate in candidates if candidate not in used)

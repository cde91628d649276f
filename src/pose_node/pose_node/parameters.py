"""The parameters that every managed node has, declared once."""

from dataclasses import dataclass

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ManagedParameters:
    """What the user of any managed node can set."""

    autostart: bool = parameter(
        True, doc="configure and activate at the start; false: wait for lifecycle transitions"
    )


@dataclass(frozen=True, kw_only=True)
class BringUpParameters:
    """What the user of ``bring_up`` can set."""

    nodes: tuple[str, ...] = parameter((), doc="the managed nodes, in the order of their start")
    period: float = parameter(
        0.5, unit="s", doc="period of checking the nodes", limits=(0.05, 60.0)
    )

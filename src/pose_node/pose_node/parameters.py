"""Parameters of every managed node, declared once."""

from dataclasses import dataclass

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ManagedParameters:
    """Parameters of any managed node."""

    autostart: bool = parameter(
        True, doc="configure and activate at the start; false: wait for lifecycle transitions"
    )


@dataclass(frozen=True, kw_only=True)
class BringUpParameters:
    """Parameters of ``bring_up``."""

    nodes: tuple[str, ...] = parameter((), doc="the managed nodes, in the order of their start")
    period: float = parameter(
        0.5, unit="s", doc="period of checking the nodes", limits=(0.05, 60.0)
    )

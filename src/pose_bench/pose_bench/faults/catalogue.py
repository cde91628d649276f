"""All faults."""

from pose_bench.faults import cameras, graph, imus, stamps
from pose_bench.faults.fault import Fault
from pose_core.errors import InputError

FAULTS: tuple[Fault, ...] = (*stamps.FAULTS, *cameras.FAULTS, *imus.FAULTS, *graph.FAULTS)


def chosen(only: str, tenth: int | None) -> tuple[Fault, ...]:
    """The faults whose name contains a text, or every tenth of them.

    Raises:
        InputError: If there are none.
    """
    faults = [fault for fault in FAULTS if only in fault.name]
    if tenth is not None:
        faults = faults[tenth % 10 :: 10]
    if not faults:
        raise InputError(f"no fault's name contains '{only}': see --list")
    return tuple(faults)

"""Parameters of the player."""

import math
from dataclasses import dataclass

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class PlayerParameters:
    """What is played, and how."""

    bag: str = parameter("", doc="the bag: a rosbag2 folder, or an .mcap or .db3 file")
    topics: tuple[str, ...] = parameter((), doc="topics to play; all if empty")
    rate: float = parameter(
        1.0,
        doc="how many times faster than it was recorded; may change meanwhile",
        limits=(0.01, 100.0),
    )
    start_offset: float = parameter(
        0.0,
        unit="s",
        doc="where in the bag to begin; set meanwhile, it goes on there",
        limits=(0.0, math.inf),
    )
    clock: bool = parameter(
        False, doc="publish the bag's time on `/clock`, for nodes with `use_sim_time`"
    )
    loop: bool = parameter(False, doc="begin anew at the end")
    start_paused: bool = parameter(False, doc="wait for the service `~/resume` before beginning")
    pause_at_end: bool = parameter(False, doc="stay at the end instead of exiting")
    wait_for_subscribers: float = parameter(
        0.0, unit="s", doc="how long to wait for a subscriber on every topic", limits=(0.0, 3600.0)
    )

"""Parameters of the player and of the recorder."""

import math
from dataclasses import dataclass

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class PlayerParameters:
    """What is played, and how."""

    bag: str = parameter("", doc="the bag: a rosbag2 folder, or an .mcap or .db3 file")
    topics: tuple[str, ...] = parameter((), doc="topics to play; empty: all")
    rate: float = parameter(
        1.0,
        doc="speed relative to the recording; may be changed during playback",
        limits=(0.01, 100.0),
    )
    start_offset: float = parameter(
        0.0,
        unit="s",
        doc="position in the bag at which to start; when changed during playback, it "
        "continues there",
        limits=(0.0, math.inf),
    )
    clock: bool = parameter(
        False, doc="publish the bag's time on `/clock`, for nodes with `use_sim_time`"
    )
    loop: bool = parameter(False, doc="restart at the end")
    start_paused: bool = parameter(False, doc="wait for the service `~/resume` before starting")
    pause_at_end: bool = parameter(False, doc="keep running at the end instead of exiting")
    wait_for_subscribers: float = parameter(
        0.0, unit="s", doc="longest wait for a subscriber on every topic", limits=(0.0, 3600.0)
    )


@dataclass(frozen=True, kw_only=True)
class RecorderParameters:
    """What is recorded, and where to."""

    output: str = parameter(
        "", doc="folder of the bag; if it exists, the first of -2, -3, …; empty: dated, in `out`"
    )
    topics: tuple[str, ...] = parameter((), doc="topics to record; empty: all that appear")
    all: bool = parameter(False, doc="record every topic that appears, as with empty `topics`")
    start_paused: bool = parameter(
        False, doc="wait for the service `~/start` before recording into `output`"
    )
    storage: str = parameter("mcap", doc="file format", choices=("mcap", "sqlite3"))
    depth: int = parameter(
        1000, doc="messages of a topic that may wait to be written", limits=(1, 100_000)
    )
    split_size: float = parameter(
        0.0,
        unit="MB",
        doc="size after which a new bag is started; 0: never",
        limits=(0.0, math.inf),
    )
    split_duration: float = parameter(
        0.0, unit="s", doc="time after which a new bag is started; 0: never", limits=(0.0, math.inf)
    )
    least_free_space: float = parameter(
        100.0,
        unit="MB",
        doc="free space on the disk at which the recording ends",
        limits=(0.0, math.inf),
    )

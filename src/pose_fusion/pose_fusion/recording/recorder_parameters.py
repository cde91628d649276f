"""Parameters of the recorder."""

from dataclasses import dataclass

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class RecorderParameters:
    """What is recorded, and where to."""

    output: str = parameter("", doc="the folder to make; it must not exist")
    topics: tuple[str, ...] = parameter((), doc="topics to record")
    all: bool = parameter(False, doc="record every topic that appears, instead of `topics`")
    start_paused: bool = parameter(
        False, doc="wait for the service `~/start` before recording into `output`"
    )
    storage: str = parameter("mcap", doc="file format", choices=("mcap", "sqlite3"))
    depth: int = parameter(
        1000, doc="messages of a topic that may wait to be written", low=1, high=100_000
    )
    least_free_space: float = parameter(
        100.0, unit="MB", doc="the recording ends before less of the disk is free", low=0.0
    )

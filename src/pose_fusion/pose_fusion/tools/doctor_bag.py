"""``./pose doctor BAG``: what is wrong with a recording, and a whole one made of it."""

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from pose_core.errors import InputError
from pose_io.bag_repair import Condition, examine, mcap_file, repair
from pose_io.bags import open_bag


def doctor_bag(bag: Path, output: Path | None) -> int:
    """Say what a bag lacks, and write it anew if somewhere to write it to is given.

    Args:
        bag: A rosbag2 folder or an ``.mcap`` file; it stays as it is.
        output: The folder to make.

    Returns:
        The exit code: 0 if the bag is whole, or has been mended.

    Raises:
        InputError: If there is no such bag, nothing can be saved, or it cannot be written.
    """
    if not bag.exists():
        raise InputError(f"found no bag at {bag}: expected a rosbag2 folder or an .mcap file")
    file = mcap_file(bag)
    condition = examine(file)
    lacks_metadata = bag.is_dir() and not (bag / "metadata.yaml").exists()
    for line in findings(file, condition, lacks_metadata):
        print(line)
    is_whole = condition.is_whole and not lacks_metadata
    if output is None:
        if is_whole:
            _describe(bag)
        else:
            print(f"→ ./pose doctor {bag} --output MENDED writes what is whole as a new bag")
        return 0 if is_whole else 1
    columns = (TextColumn("mending"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("mending", total=1.0)
        repair(file, condition, output, lambda share: progress.update(task, completed=share))
    _describe(output)
    return 0


def findings(file: Path, condition: Condition, lacks_metadata: bool) -> list[str]:
    """What is wrong with a bag, one line a finding."""
    lines = []
    if not condition.ends:
        lost = condition.size - condition.whole
        lines.append(
            f"{file} is cut short or damaged: {condition.whole} of its {condition.size} bytes are"
            f" whole, the last {lost} are not ({condition.problem})"
        )
    elif not condition.has_index:
        lines.append(f"{file} has no index: its recording was cut off; every byte of it is whole")
    if lacks_metadata:
        lines.append(f"{file.parent} has no metadata.yaml: its recording was cut off")
    return lines


def _describe(path: Path) -> None:
    with open_bag(path) as bag:
        print(
            f"{path}: {len(bag.topics)} topics, {bag.message_count} messages,"
            f" {bag.duration_s:.1f} s, whole"
        )

"""Running independent calls in several processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from itertools import starmap
from multiprocessing import get_context
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import MofNCompleteColumn, TimeRemainingColumn

from pose_node.plain_console import progress_bar

T = TypeVar("T")


def run_all(
    work: Callable[..., T], arguments: Sequence[tuple[Any, ...]], *, jobs: int, name: str
) -> list[T]:
    """Call a function with each of many arguments, and show the number of finished calls.

    Args:
        work: A module-level function, which can be pickled.
        arguments: Its arguments, call by call.
        jobs: Number of parallel processes; 1 runs in this process.
        name: Name of the calls in the progress bar.

    Returns:
        The results in the order of the arguments, whatever the number of jobs.
    """
    columns = MofNCompleteColumn(), TimeRemainingColumn()
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(Console(stderr=True), *columns))
        found: Iterator[T] = starmap(work, arguments)
        if min(jobs, len(arguments)) > 1:
            # Forked processes would inherit the progress bar's thread and its locks.
            context = get_context("spawn")
            pool = stack.enter_context(ProcessPoolExecutor(jobs, mp_context=context))
            found = pool.map(work, *zip(*arguments, strict=True))
        return list(bar.track(found, total=len(arguments), description=name))

"""Running independent calls in several processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from itertools import starmap
from multiprocessing import get_context
from typing import Any, TypeVar

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the number of finished calls, and of all calls."""


def run_all(
    work: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    *,
    jobs: int,
    progress: Progress = lambda _done, _total: None,
) -> list[T]:
    """Call a function with each of many arguments.

    Args:
        work: A module-level function, which can be pickled.
        arguments: Its arguments, call by call.
        jobs: Number of parallel processes; 1 runs in this process.
        progress: Called before the first call and after each.

    Returns:
        The results in the order of the arguments, whatever the number of jobs.
    """
    results: list[T] = []
    progress(0, len(arguments))
    with ExitStack() as stack:
        found: Iterator[T] = starmap(work, arguments)
        if min(jobs, len(arguments)) > 1:
            # Forked processes would inherit the progress bar's thread and its locks.
            context = get_context("spawn")
            pool = stack.enter_context(ProcessPoolExecutor(jobs, mp_context=context))
            found = pool.map(work, *zip(*arguments, strict=True))
        for result in found:
            results.append(result)
            progress(len(results), len(arguments))
    return results

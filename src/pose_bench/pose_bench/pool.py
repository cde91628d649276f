"""Running independent calls in several processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any, TypeVar

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the number of finished calls, and of all calls."""


def ignored(done: int, total: int) -> None:
    """Show no progress."""


def run_all(
    work: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    *,
    jobs: int,
    progress: Progress = ignored,
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
    results: dict[int, T] = {}
    progress(0, len(arguments))
    for index, result in _in_any_order(work, arguments, min(jobs, len(arguments))):
        results[index] = result
        progress(len(results), len(arguments))
    return [results[index] for index in range(len(arguments))]


def _in_any_order(
    work: Callable[..., T], arguments: Sequence[tuple[Any, ...]], jobs: int
) -> Iterator[tuple[int, T]]:
    if jobs <= 1:
        for index, each in enumerate(arguments):
            yield index, work(*each)
        return
    # Forked processes would inherit the progress bar's thread and its locks.
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(work, *each): index for index, each in enumerate(arguments)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise

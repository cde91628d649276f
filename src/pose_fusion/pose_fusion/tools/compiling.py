"""Progress of the estimator's compilation at the first start."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from pose_core.api import BodyModel, warm_up
from pose_core.kernels.compiling import COMPILED_FOLDER

LOOK_S = 0.5  # [s] between updates of the progress


def prepare_visibly(estimator: str, model: BodyModel, console: Console) -> None:
    """Load an estimator's kernels; show progress if they are compiled first."""
    if _compiled():
        warm_up(estimator, model)
        return
    with _progress(console):
        warm_up(estimator, model)


def _compiled() -> int:
    """Number of kernels in the cache, compiled for this machine."""
    return sum(1 for _ in COMPILED_FOLDER.rglob("*.nbi"))


@contextmanager
def _progress(console: Console) -> Iterator[None]:
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    is_done = threading.Event()
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("compiling", total=None)

        def look() -> None:
            while not is_done.wait(LOOK_S):
                text = f"compiling the estimator for this machine: {_compiled()} functions"
                progress.update(task, description=text)

        watcher = threading.Thread(target=look, daemon=True)
        watcher.start()
        try:
            yield
        finally:
            is_done.set()
            watcher.join()

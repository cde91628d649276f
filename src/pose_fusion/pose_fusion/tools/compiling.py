"""Progress of the estimator's compilation at the first start."""

from rich.console import Console
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TimeElapsedColumn
from rich.text import Text

from pose_core.api import BodyModel, warm_up
from pose_core.kernels.compiling import COMPILED_FOLDER


class CompiledColumn(ProgressColumn):
    """Number of kernels that are compiled so far."""

    max_refresh = 0.5  # [s]

    def render(self, task: Task) -> Text:
        """The line beside the spinner."""
        return Text(f"compiling the estimator for this machine: {_compiled()} functions")


def prepare_visibly(estimator: str, model: BodyModel, console: Console) -> None:
    """Load an estimator's kernels; show progress if they are compiled first."""
    columns = (SpinnerColumn(), CompiledColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=_compiled() > 0) as progress:
        progress.add_task("", total=None)
        warm_up(estimator, model)


def _compiled() -> int:
    """Number of kernels in the cache, compiled for this machine."""
    return sum(1 for _ in COMPILED_FOLDER.rglob("*.nbi"))

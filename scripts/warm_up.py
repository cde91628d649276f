"""Compiles the default estimator's kernels once, before several processes need them.

Two processes share the work: one begins with the measurement updates, the other with all the rest.
"""

import sys
from math import nan
from multiprocessing import Process
from typing import Any

from pose_core.api import load_body_model, warm_up
from pose_core.estimators.default import DefaultEstimator
from pose_core.filter.step import StepResult
from pose_core.fusion.warm_up import run_once
from pose_io.preparing import prepare_reading


class WithoutUpdates(DefaultEstimator):
    """A filter that only predicts."""

    def _update_filter(self, *_: Any) -> StepResult:
        return StepResult(True, 0, nan, nan)


def compile_the_rest() -> None:
    """Compile everything but the updates."""
    run_once("default", load_body_model("default"), WithoutUpdates)
    prepare_reading()


if __name__ == "__main__":
    rest = Process(target=compile_the_rest)
    rest.start()
    warm_up("default", load_body_model("default"))
    rest.join()
    sys.exit(rest.exitcode)

"""Compiles the default estimator's kernels once, before several processes need them.

Two processes share the work: one compiles the update with a camera's frame, which takes about half
of the time, the other all the rest.
"""

import sys
from collections.abc import Sequence
from multiprocessing import Process

from pose_core.api import load_body_model, warm_up
from pose_core.estimators.default import DefaultEstimator
from pose_core.fusion.warm_up import run_once
from pose_io.preparing import prepare_reading


class WithoutCameras(DefaultEstimator):
    """A filter without updates by cameras' frames."""

    def _uses_cameras(self, segments: Sequence[str]) -> bool:
        return False


def compile_the_rest() -> None:
    """Compile everything but the update with a camera's frame."""
    run_once("default", load_body_model("default"), WithoutCameras)
    prepare_reading()


if __name__ == "__main__":
    rest = Process(target=compile_the_rest)
    rest.start()
    run_once("default", load_body_model("default"), imus=False)
    rest.join()
    warm_up("default", load_body_model("default"))
    sys.exit(rest.exitcode)

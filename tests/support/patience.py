"""Time limits of tests, for slow and busy machines too."""

import os

import pytest

PATIENCE_S = 240.0  # [s] what comes sooner is not waited for; kernels may have to be compiled

MAX_LOAD = 4.0  # [-] processes that want to run, for each core


def skip_if_overloaded() -> None:
    """Skip a test of what arrives in time where hardly anything does."""
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    if load > MAX_LOAD:
        pytest.skip(f"the machine is overloaded: {load:.0f} processes for each core")

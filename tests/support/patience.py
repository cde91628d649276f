"""Time limits of tests, for slow and busy machines too."""

import os
import time
from collections.abc import Callable
from typing import Any

import pytest

PATIENCE_S = 240.0  # [s] what comes sooner is not waited for; kernels may have to be compiled
POLL_S = 0.02  # [s] between looks at what is waited for
MAX_LOAD = 4.0  # [-] processes that want to run, for each core


def skip_if_overloaded() -> None:
    """Skip a test of what arrives in time where hardly anything does."""
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    if load > MAX_LOAD:
        pytest.skip(f"the machine is overloaded: {load:.0f} processes for each core")


def wait_until(condition: Callable[[], Any], timeout_s: float = PATIENCE_S, what: str = "") -> None:
    """Wait until the condition holds; an AssertionError after the deadline."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {timeout_s:g} s in vain for {what or 'the condition'}")
        time.sleep(POLL_S)

"""A function in a process of its own."""

import os
import signal
from multiprocessing import active_children

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_fusion.worker_process import UNDER_WAY, WorkerLostError, WorkerProcess


class Sum:
    """Keeps a state."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, request):
        self.sum += request
        return self.sum


class UnpicklableError(Exception):
    def __init__(self, one, other):
        super().__init__(f"{one} and {other}")


def answers(process, requests):
    """All answers, as many requests under way as may be."""
    found = []
    for request in requests:
        if process.is_full:
            found.append(process.get())
        process.put(request)
    while process.under_way:
        found.append(process.get())
    return found


def fail(request):
    if request < 0:
        raise InputError(f"{request} is negative")
    return request


def test_answers_come_in_the_order_of_requests_and_the_state_stays():
    with WorkerProcess(Sum(), "adding") as process:
        assert answers(process, range(20)) == list(np.cumsum(np.arange(20.0)))


@pytest.mark.parametrize("rows", [2**17, 2**22])
def test_large_requests_and_large_answers_do_not_wait_for_each_other(rows):
    """Also answers of 32 MB, which are too large for the memory that is shared."""
    with WorkerProcess(lambda request: np.full(rows, request[-1]), "repeating") as process:
        found = answers(process, [np.full(2**17, n) for n in range(3 * UNDER_WAY)])
    assert [each[-1] for each in found] == list(range(3 * UNDER_WAY))


def test_more_requests_than_may_be_under_way_are_refused():
    with WorkerProcess(Sum(), "adding") as process:
        for _ in range(UNDER_WAY):
            process.put(1.0)
        assert process.is_full
        with pytest.raises(ValueError, match="take an answer first"):
            process.put(1.0)


def test_a_request_that_might_have_to_be_waited_for_is_refused():
    with (
        WorkerProcess(len, "counting") as process,
        pytest.raises(ValueError, match="beside its arrays is too large"),
    ):
        process.put(list(range(10_000)))


def test_an_error_arrives_as_it_was_raised_after_the_answers_before_it():
    with WorkerProcess(fail, "failing") as process:
        for request in (1, -2, 3):
            process.put(request)
        assert process.get() == 1
        with pytest.raises(InputError, match=r"^-2 is negative$") as caught:
            process.get()
    assert "in fail" in str(caught.value.__cause__)


def test_an_error_that_cannot_be_sent_is_told_all_the_same():
    def fail_oddly(_):
        raise UnpicklableError("this", "that")

    with WorkerProcess(fail_oddly, "failing") as process:
        process.put(0)
        with pytest.raises(RuntimeError, match="UnpicklableError: this and that"):
            process.get()


def kill_oneself(_):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_is_killed_is_told_in_one_line_to_who_waits():
    with WorkerProcess(kill_oneself, "the estimator") as process:
        process.put(0)
        with pytest.raises(
            WorkerLostError, match="of the estimator was ended by SIGKILL, "
        ) as told:
            process.get()
    assert "\n" not in str(told.value)


def test_a_process_that_is_killed_is_told_to_who_asks_more():
    with WorkerProcess(kill_oneself, "the estimator") as process:
        process.put(0)
        (child,) = active_children()
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        with pytest.raises(WorkerLostError, match="of the estimator was ended by SIGKILL, "):
            process.put(0)


def test_no_process_is_left():
    with WorkerProcess(lambda _: os.getpid(), "telling") as process:
        process.put(0)
        pid = process.get()
        process.put(0)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_ctrl_c_is_left_to_the_parent():
    with WorkerProcess(lambda _: os.getpid(), "telling") as process:
        process.put(0)
        pid = process.get()
        os.kill(pid, signal.SIGINT)
        process.put(0)
        assert process.get() == pid

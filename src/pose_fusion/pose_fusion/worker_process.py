"""A function that is run in a process of its own, beside its caller, on one thing after another."""

import gc
import pickle
import signal
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

from pose_core.errors import PoseError
from pose_fusion.shared_slots import SharedSlots

Q = TypeVar("Q")
A = TypeVar("A")

UNDER_WAY = 4  # [requests] at most
SLOT_SIZE = 2**24  # [bytes] of a request's or an answer's arrays; see SharedSlots
LARGEST_REQUEST = 2**14  # [bytes] beside its arrays: UNDER_WAY of them fit any socket's buffer


class WorkerLostError(PoseError):
    """The process has ended before its time."""


@dataclass(frozen=True, kw_only=True)
class _Failure:
    error: Exception
    account: str  # where it was raised


class WorkerProcess(Generic[Q, A]):
    """Has a function called in a process that is forked here and shares what is loaded.

    Requests are answered in their order, and a few may be under way. What a caller sends is small,
    so that it never waits in :meth:`put`: answers may be of any size, for nobody who could read
    them waits for the process to read. The process ends with :meth:`close`, or by itself when its
    parent has ended.

    To be made before other threads are: a child would inherit the locks that they hold.

    Args:
        function: Called with each request; it may keep a state. What it raises, :meth:`get` does.
        name: What it does, for people.
    """

    def __init__(self, function: Callable[[Q], A], name: str) -> None:
        self._name = name
        self._requests = SharedSlots(UNDER_WAY, SLOT_SIZE)
        self._answers = SharedSlots(UNDER_WAY, SLOT_SIZE)
        self._put = self._got = 0
        context = get_context("fork")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(
            target=self._serve, args=(function, theirs), name=name, daemon=True
        )
        # Neither looks for garbage in what both have: pages that are touched are copied.
        gc.freeze()
        # Ctrl-C is its parent's matter, from the beginning.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        self._process.start()
        theirs.close()
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        except BaseException:  # it came meanwhile
            self.close()
            raise

    @property
    def is_full(self) -> bool:
        """Whether an answer must be taken before the next request."""
        return self.under_way == UNDER_WAY

    @property
    def under_way(self) -> int:
        """How many answers are still to come."""
        return self._put - self._got

    def put(self, request: Q) -> None:
        """Have the function called; not while :attr:`is_full`.

        Raises:
            WorkerLostError: If the process has ended.
        """
        if self.is_full:
            raise ValueError(f"{self.under_way} requests are under way: take an answer first")
        parcel = self._requests.pack(self._put, request)
        if len(parcel.data) > LARGEST_REQUEST:
            raise ValueError(
                f"a request of {len(parcel.data)} bytes beside its arrays is too large: "
                f"at most {LARGEST_REQUEST}, and {SLOT_SIZE} of arrays"
            )
        try:
            self._connection.send(parcel)
        except OSError as error:
            raise self._lost() from error
        self._put += 1

    def get(self) -> A:
        """Wait for the next answer.

        Raises:
            WorkerLostError: If the process has ended.
        """
        try:
            parcel = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(parcel, _Failure):
            raise parcel.error from RuntimeError(parcel.account)
        answer: A = self._answers.unpack(self._got, parcel)
        self._got += 1
        return answer

    def close(self) -> None:
        """End the process, whatever it does."""
        self._connection.close()
        self._process.kill()
        self._process.join()
        gc.unfreeze()

    def __enter__(self) -> "WorkerProcess[Q, A]":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lost(self) -> WorkerLostError:
        self._process.join()
        code = self._process.exitcode or 0
        how = f"by {signal.Signals(-code).name}" if code < 0 else f"with status {code}"
        return WorkerLostError(
            f"the process of {self._name} was ended {how}, maybe for want of memory: "
            "close other programs and run again"
        )

    def _serve(self, function: Callable[[Q], A], connection: Connection) -> None:
        """In the child: answer until nobody asks any more."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        self._connection.close()
        number = 0
        with suppress(EOFError, OSError):  # the parent has ended
            while True:
                request = self._requests.unpack(number, connection.recv())
                try:
                    answer = self._answers.pack(number, function(request))
                except Exception as error:
                    connection.send(_failure(error))
                    break
                connection.send(answer)
                number += 1
            while True:  # what was asked before the error is known
                connection.recv()


def _failure(error: Exception) -> _Failure:
    """The error and where it was raised; one that cannot be pickled as another."""
    account = "".join(traceback.format_exception(error))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    return _Failure(error=error, account=account)

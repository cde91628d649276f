"""Tracking in a process of its own, for recordings: the chain's other parts work beside it.

What goes there and back are blocks of a hundred observations or poses.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.observation_block import (
    Observation,
    ObservationBlock,
    block_of_observations,
)
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock
from pose_core.fusion.preparing import prepare
from pose_core.fusion.telling import Telling
from pose_core.fusion.tracking import Tracking, tracking_counters
from pose_fusion.worker_process import WorkerProcess

AT_ONCE = 100  # [observations]


@dataclass(frozen=True, kw_only=True)
class _End:
    newest_ns: int  # [ns] see Tracking.flush


@dataclass(frozen=True, kw_only=True)
class _Request:
    block: ObservationBlock | _End
    new_shape: BodyShape | None  # another body's, from this block on


@dataclass(frozen=True, kw_only=True)
class _Answer:
    poses: PoseBlock | None
    counts: dict[str, int]  # since the last


class EstimationProcess:
    """As ``Estimation``, but estimates come later: at the latest with :meth:`flush`.

    To be closed, and to be made before other threads are; see :class:`WorkerProcess`.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :func:`tracking_counters`.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters, counters: Counters) -> None:
        self._counters = counters
        self._waiting: list[Observation] = []
        self._shape: BodyShape | None = None  # of the last block that was sent
        self._asked: deque[BodyShape | None] = deque()  # whose poses are to come
        self._telling = Telling(model, parameters)
        answering = _Answering(model, parameters)
        prepare(parameters.estimator, model.name)  # once for both processes
        self._process = WorkerProcess[_Request, _Answer](answering, "the estimator")

    def take(self, observations: Iterable[Observation]) -> list[EstimateBlock]:
        """Hand observations over; the estimates that have come back meanwhile.

        Raises:
            WorkerLostError: If the process has ended.
            Exception: What the estimator raised.
        """
        estimates: list[EstimateBlock] = []
        for observation in observations:
            waiting = self._waiting
            if waiting and (len(waiting) == AT_ONCE or waiting[0].shape is not observation.shape):
                estimates += self._send_waiting()
            self._waiting.append(observation)
        return estimates

    def flush(self, newest_ns: int) -> list[EstimateBlock]:
        """All that is left, when nothing comes any more; raises as :meth:`take`.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        estimates = self._send_waiting() if self._waiting else []
        estimates += self._send(_Request(block=_End(newest_ns=newest_ns), new_shape=None))
        while self._process.under_way:
            estimates += self._receive()
        return estimates

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def __enter__(self) -> "EstimationProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _send_waiting(self) -> list[EstimateBlock]:
        waiting, self._waiting = self._waiting, []
        shape = waiting[0].shape
        is_new, self._shape = shape is not self._shape, shape
        block = block_of_observations(waiting)
        return self._send(_Request(block=block, new_shape=shape if is_new else None))

    def _send(self, request: _Request) -> list[EstimateBlock]:
        """Send a request; what had to be received before."""
        estimates = self._receive() if self._process.is_full else []
        self._process.put(request)
        self._asked.append(self._shape)
        return estimates

    def _receive(self) -> list[EstimateBlock]:
        answer, shape = self._process.get(), self._asked.popleft()
        for name, count in answer.counts.items():
            self._counters.add(name, count)
        if answer.poses is None or shape is None:
            return []
        return [self._telling.tell(answer.poses, shape)]


class _Answering:
    """What the process does with a request."""

    def __init__(self, model: BodyModel, parameters: FusionParameters) -> None:
        self._counters = Counters(*tracking_counters(parameters))
        self._tracking = Tracking(model, parameters, self._counters)
        self._shape: BodyShape | None = None

    def __call__(self, request: _Request) -> _Answer:
        before = self._counters.as_dict()
        self._shape = request.new_shape or self._shape
        block = request.block
        if isinstance(block, _End):
            poses = self._tracking.flush(block.newest_ns)
        else:
            assert self._shape is not None
            poses = self._tracking.take(block, self._shape)
        counts = {name: n - before[name] for name, n in self._counters.as_dict().items()}
        return _Answer(poses=poses, counts=counts)

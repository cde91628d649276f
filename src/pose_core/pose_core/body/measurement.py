"""Measurement of a body's bone lengths from the samples before the first pose."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape, BodyShapeError, estimate_body_shape
from pose_core.joints import TrackingState
from pose_core.stamps import NS_PER_S

MAX_SAMPLES = 2000
PATIENCE_S = 10.0  # [s] after which joints that are never seen are assumed


class BodyMeasurement:
    """Collects samples of all sensors until they determine the bone lengths.

    Args:
        model: The body model.
        duration_s: Least length of the stretch [s].
    """

    def __init__(self, model: BodyModel, duration_s: float) -> None:
        self._model = model
        self._duration_ns = round(duration_s * NS_PER_S)
        self._samples: deque[FloatArray] = deque(maxlen=MAX_SAMPLES)
        self._since_ns: int | None = None
        self._measured_ns = 0
        self.status = "measuring the body"

    def add(self, stamp_ns: int, positions: FloatArray, tracking_state: NDArray[np.uint8]) -> None:
        """Add all sensors' joints at one instant.

        Args:
            stamp_ns: The instant.
            positions: Shape (sensors, 15, 3) [m], in any frame.
            tracking_state: Shape (sensors, 15); only tracked joints are measured.
        """
        if self._since_ns is None or stamp_ns < self._since_ns:
            self._since_ns = stamp_ns
            self._samples.clear()
        tracked = tracking_state == TrackingState.TRACKED
        sees = tracked.any(axis=1)
        self._samples.extend(np.where(tracked[..., None], positions, np.nan)[sees])
        self._measured_ns = stamp_ns - self._since_ns

    def shape(self) -> BodyShape | None:
        """The body measures, once the stretch is long enough and every joint was seen often enough.

        After :data:`PATIENCE_S`, joints that were not are assumed.
        """
        late_ns = self._measured_ns - self._duration_ns
        if late_ns < 0 or not self._samples:
            return None
        is_late = late_ns > PATIENCE_S * NS_PER_S
        try:
            return estimate_body_shape(self._model, np.stack(self._samples), assume_unseen=is_late)
        except BodyShapeError as error:
            self.status = f"measuring the body: {error}"
            return None

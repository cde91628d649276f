"""Measurement of a body's bone lengths from the first samples of a session."""

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
        duration_s: Length of the stretch [s].
    """

    def __init__(self, model: BodyModel, duration_s: float) -> None:
        self._model = model
        self._duration_ns = round(duration_s * NS_PER_S)
        self._samples: deque[FloatArray] = deque(maxlen=MAX_SAMPLES)
        self._since_ns: int | None = None
        self.status = "measuring the body"

    def add(
        self, stamp_ns: int, positions: FloatArray, tracking_state: NDArray[np.uint8]
    ) -> BodyShape | None:
        """Add all sensors' joints at one instant.

        Args:
            stamp_ns: The instant.
            positions: Shape (sensors, 15, 3) [m], in any frame.
            tracking_state: Shape (sensors, 15); only tracked joints are measured.

        Returns:
            The body measures, once the stretch is long enough and every joint was seen often
            enough; after :data:`PATIENCE_S`, joints that were not are assumed.
        """
        if self._since_ns is None or stamp_ns < self._since_ns:
            self._since_ns = stamp_ns
            self._samples.clear()
        tracked = tracking_state == TrackingState.TRACKED
        self._samples.extend(np.where(tracked[..., None], positions, np.nan))
        measured_ns = stamp_ns - self._since_ns
        if measured_ns < self._duration_ns:
            return None
        is_late = measured_ns > self._duration_ns + PATIENCE_S * NS_PER_S
        try:
            return estimate_body_shape(self._model, np.stack(self._samples), assume_unseen=is_late)
        except BodyShapeError as error:
            self.status = f"measuring the body: {error}"
            return None

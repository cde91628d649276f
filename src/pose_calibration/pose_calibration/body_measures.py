"""The person's body measures from the sensors' skeletons."""

from collections.abc import Sequence

import numpy as np

from pose_core.api import (
    BodyShapeError,
    SessionBody,
    SkeletonSample,
    estimate_body_shape,
    load_body_model,
)

MODEL = "default"  # body model that a calibration measures
MAX_SAMPLES = 4000  # [-] used for the measures


def measure_body(
    samples: Sequence[SkeletonSample], *, assume_unseen: bool = False
) -> SessionBody | None:
    """The person's body shape from a whole session: many postures determine it better than one.

    Args:
        samples: Of all sensors.
        assume_unseen: See :func:`pose_core.body.shape.estimate_body_shape`.

    Returns:
        The measures; None if a joint was tracked too rarely.
    """
    model = load_body_model(MODEL)
    tracked = [one.tracked for one in samples[:: max(1, len(samples) // MAX_SAMPLES)]]
    if not tracked:
        return None
    try:
        shape = estimate_body_shape(model, np.stack(tracked), assume_unseen=assume_unseen)
    except BodyShapeError:
        return None
    return SessionBody(model=model.name, shape=shape)

"""The person's body measures from the sensors' skeletons."""

from collections.abc import Iterable, Mapping

import numpy as np

from pose_core.api import (
    AlignedFrame,
    BodyShapeError,
    FloatArray,
    SessionBody,
    estimate_body_shape,
    load_body_model,
)
from pose_core.joints import JOINTS, TrackingState

MODEL = "default"  # body model that a calibration measures
MOST_FRAMES = 2000  # [-] used for the measures


def measure_body(
    frames: Iterable[AlignedFrame], T_map_sensor: Mapping[str, FloatArray]
) -> SessionBody | None:
    """The person's body shape from all frames: many postures determine it better than one.

    Args:
        frames: Frames of all sensors, in the order of time.
        T_map_sensor: Poses of the sensors, (4, 4) by sensor.

    Returns:
        The measures; None if a joint was tracked too rarely.
    """
    model = load_body_model(MODEL)
    tracked: list[FloatArray] = []
    for frame in frames:
        positions = np.full((len(T_map_sensor), len(JOINTS), 3), np.nan)
        state = np.zeros((len(T_map_sensor), len(JOINTS)), np.uint8)
        for index, (name, T) in enumerate(T_map_sensor.items()):
            sample = frame.samples.get(name)
            if sample is not None:
                positions[index] = sample.positions @ T[:3, :3].T + T[:3, 3]
                state[index] = sample.tracking_state
        tracked.append(np.where((state == TrackingState.TRACKED)[..., None], positions, np.nan))
    if not tracked:
        return None
    step = max(1, len(tracked) // MOST_FRAMES)
    try:
        shape = estimate_body_shape(model, np.concatenate(tracked[::step]))
    except BodyShapeError:
        return None
    return SessionBody(model=model.name, shape=shape)

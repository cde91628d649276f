"""The methods in a bag: each raw sensor, their mean, and the fused result."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import replace
from operator import attrgetter

import numpy as np

from pose_core.api import (
    AlignedFrame,
    Extrinsics,
    FloatArray,
    SkeletonSample,
    SkeletonSeries,
    TimeAligner,
    extrinsics_from_map,
    series_from_samples,
    series_on_reference_clock,
)
from pose_core.finite_numbers import nan_mean
from pose_io.bag_samples import read_body_series, read_extrinsics, read_sensor_series
from pose_io.bags import BagReader
from pose_io.clock_messages import read_clocks
from pose_io.topics import body_topic, sensor_topics

MEAN = "mean"
FUSED = "fused"


def methods_of_bag(
    bag: BagReader, person: str = "", body: str = "", extrinsics: Extrinsics | None = None
) -> dict[str, SkeletonSeries]:
    """Every method's joints by its name, in the order of the tables.

    Each raw sensor under its own name and in its own frame; ``mean`` of all sensors and ``fused``
    in ``map``. ``mean`` is absent if the bag does not hold all sensors' extrinsics, or holds one
    sensor only; ``fused`` if it holds no fused skeleton.

    Args:
        bag: An open bag.
        person: The person to select; see ``./pose fuse --person``.
        body: The id of the fused body; the first one if empty.
        extrinsics: Poses and clocks of the sensors; those in the bag if None.

    Raises:
        InputError: If the bag holds neither a sensor's skeletons nor a fused one.
    """
    names = sensor_topics(bag)
    clocks = read_clocks(bag) if extrinsics is None else extrinsics.clocks
    placed = read_extrinsics(bag)
    if extrinsics is None and names and set(names) <= set(placed):
        known = extrinsics_from_map({name: placed[name] for name in names})
        extrinsics = replace(known, clocks=clocks)
    has_body = body_topic(bag, "skeleton", body) is not None
    raw = {} if has_body and not names else read_sensor_series(bag, person, extrinsics)
    sensors = {
        name: series_on_reference_clock(series, clocks.get(name)) for name, series in raw.items()
    }
    methods = dict(sensors)
    if len(sensors) > 1 and extrinsics is not None:
        methods[MEAN] = mean_series(
            sensors, {name: extrinsics.T_map_sensor(name) for name in names}
        )
    if has_body:
        methods[FUSED] = read_body_series(bag, body)
    return methods


def mean_series(
    sensors: Mapping[str, SkeletonSeries], T_map_sensor: Mapping[str, FloatArray]
) -> SkeletonSeries:
    """The mean of the sensors' skeletons in ``map``, without filtering.

    Aligned in time by li2020 (2); a joint not tracked by some sensors is the mean of the others.

    Args:
        sensors: Each sensor's skeletons, in its own frame.
        T_map_sensor: Each sensor's (4, 4) extrinsics.
    """
    in_map = {name: each.transformed(T_map_sensor[name]) for name, each in sensors.items()}
    return series_from_samples(map(_mean, aligned_frames(in_map)))


def aligned_frames(sensors: Mapping[str, SkeletonSeries]) -> Iterator[AlignedFrame]:
    """The sensors' samples at common instants."""
    aligner = TimeAligner(list(sensors))
    streams = [_samples(name, series) for name, series in sensors.items()]
    for sample in heapq.merge(*streams, key=attrgetter("stamp_ns")):
        yield from aligner.add(sample)
    yield from aligner.flush()


def _samples(sensor: str, series: SkeletonSeries) -> Iterator[SkeletonSample]:
    for index, stamp_ns in enumerate(series.stamps_ns):
        yield SkeletonSample(
            stamp_ns=int(stamp_ns),
            sensor=sensor,
            person="",
            positions=series.positions[index],
            tracking_state=series.tracking_state[index],
        )


def _mean(frame: AlignedFrame) -> SkeletonSample:
    views = list(frame.samples.values())
    return SkeletonSample(
        stamp_ns=frame.stamp_ns,
        sensor="",
        person="",
        positions=nan_mean(np.stack([view.positions for view in views])),
        tracking_state=np.max([view.tracking_state for view in views], axis=0),
    )

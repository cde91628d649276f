"""A session of the synthetic subject: the motion, and the measurements of every virtual sensor."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_core.parameters import from_mapping
from pose_core.plain_yaml import read_yaml
from pose_core.stamps import NS_PER_S
from pose_sim import imu_noise, kinect_noise
from pose_sim.body import Body
from pose_sim.choreography import compose
from pose_sim.imu_noise import ImuParameters
from pose_sim.kinect_noise import KinectParameters
from pose_sim.motion import Motion
from pose_sim.scene import SceneParameters, sensor_poses, subject_place
from pose_sim.timeline import Variation
from pose_sim.virtual_imu import ImuFrames, WornNode, earth_field, measure, mount, to_frames
from pose_sim.virtual_kinect import KinectFrames, draw_body_bias, observe

T = TypeVar("T")
NOISE_PRESETS = tuple(kinect_noise.PRESETS)
KINECT_STREAM, IMU_STREAM = 2, 3  # indices of the seed's random streams


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of the subject, the scene and the sensors' errors."""

    noise: str  # name of the preset
    scene: SceneParameters
    variation: Variation
    kinect: KinectParameters
    imu: ImuParameters


def settings_of(preset: str = "typical", overrides: Mapping[str, Any] | None = None) -> Settings:
    """A preset's settings with some values replaced.

    Args:
        preset: One of :data:`NOISE_PRESETS`.
        overrides: Values by section (``scene``, ``variation``, ``kinect``, ``imu``) and name.

    Raises:
        InputError: If there is no such preset or section.
        ParameterError: If a value is unknown, of the wrong type or out of its range.
    """
    if preset not in NOISE_PRESETS:
        raise InputError(f"unknown noise '{preset}': expected {', '.join(NOISE_PRESETS)}")
    given = dict(overrides or {})

    def section(name: str, base: T) -> T:
        values = given.pop(name, None) or {}
        if not isinstance(values, Mapping):
            raise InputError(f"section '{name}' is {values!r}: expected 'parameter: value' lines")
        return from_mapping(type(base), {**asdict(base), **values})  # type: ignore[call-overload]

    settings = Settings(
        noise=preset,
        scene=section("scene", SceneParameters()),
        variation=section("variation", Variation()),
        kinect=section("kinect", kinect_noise.PRESETS[preset]),
        imu=section("imu", imu_noise.PRESETS[preset]),
    )
    if given:
        raise InputError(
            f"unknown section {', '.join(map(repr, given))}: expected scene, variation, kinect, imu"
        )
    if settings.imu.misalignment_min > settings.imu.misalignment_max:
        raise InputError(
            f"misalignment_min = {settings.imu.misalignment_min:g} deg is above "
            f"misalignment_max = {settings.imu.misalignment_max:g} deg: lower it"
        )
    return settings


def read_overrides(path: Path) -> dict[str, Any]:
    """Read overrides from a YAML file.

    Raises:
        InputError: If it cannot be read or is not a mapping.
    """
    document = read_yaml(path, "the settings")
    if not isinstance(document, dict):
        raise InputError(f"{path} holds no sections: expected 'kinect: {{PARAMETER: VALUE}}' or so")
    return document


@dataclass(frozen=True, kw_only=True)
class Session:
    """A motion and the sensors' measurements of it."""

    choreography: str
    duration: float  # [s]
    seed: int
    settings: Settings
    motion: Motion
    sensor_poses: Mapping[str, FloatArray]  # T_map_kinect_<name>_optical_frame, (4, 4)
    kinects: Mapping[str, KinectFrames]
    heading_enu_map: float  # [rad] about z, from east to map's x
    nodes: Mapping[int, WornNode]  # by IMU node id
    imus: ImuFrames
    is_captured: bool = False  # whether the motion is captured


def make_session(
    choreography: str,
    duration: float,
    seed: int,
    settings: Settings,
    captured: Motion | None = None,
) -> Session:
    """Simulate a choreography with its Kinect and IMU measurements.

    Args:
        choreography: One of :data:`pose_sim.choreography.CHOREOGRAPHIES`, or the captured
            motion's name.
        duration: Duration [s].
        seed: Random seed; the same seed gives the same session.
        settings: The scene and the errors.
        captured: Captured motion to use instead.

    Raises:
        InputError: If the choreography is unknown, or the duration too short.
    """
    place, heading = subject_place(settings.scene)
    body = Body(settings.scene.body_height)
    motion = captured or compose(
        choreography,
        duration,
        seed,
        height=body.height,
        variation=settings.variation,
        place=place,
        heading=heading,
    )
    poses = sensor_poses(settings.scene)
    imu_rng = np.random.default_rng([seed, IMU_STREAM])
    heading_enu_map = float(imu_rng.uniform(-np.pi, np.pi))
    nodes = mount(body, settings.imu, imu_rng)
    return Session(
        choreography=choreography,
        duration=duration,
        seed=seed,
        settings=settings,
        motion=motion,
        is_captured=captured is not None,
        sensor_poses=poses,
        kinects=_watch(motion, poses, settings, seed),
        heading_enu_map=heading_enu_map,
        nodes=nodes,
        imus=_wear(motion, nodes, heading_enu_map, settings.imu, imu_rng),
    )


def _watch(
    motion: Motion, poses: Mapping[str, FloatArray], settings: Settings, seed: int
) -> dict[str, KinectFrames]:
    body_rng, *sensor_rngs = np.random.default_rng([seed, KINECT_STREAM]).spawn(1 + len(poses))
    body_bias = draw_body_bias(body_rng)
    common_lags = body_rng.uniform(-0.5, 0.5, len(JOINTS))
    frames = {
        name: observe(
            motion,
            pose,
            settings.kinect,
            body_height=settings.scene.body_height,
            body_bias=body_bias,
            common_lags=common_lags,
            rng=rng,
        )
        for (name, pose), rng in zip(poses.items(), sensor_rngs, strict=True)
    }
    offset_ns = round(settings.kinect.clock_offset * NS_PER_S)
    # A recording's sensors are ordered by their first frames: the first sensor starts first.
    first_name, *others = frames
    first_ns = int(frames[first_name].host_time_ns[0])
    return frames | {name: frames[name].late(offset_ns, first_ns) for name in others}


def _wear(
    motion: Motion,
    nodes: Mapping[int, WornNode],
    heading_enu_map: float,
    parameters: ImuParameters,
    rng: np.random.Generator,
) -> ImuFrames:
    field = earth_field(parameters, heading_enu_map)
    radio_rng, *node_rngs = rng.spawn(1 + len(nodes))
    measurements = {
        node_id: measure(motion, node, field, parameters, node_rng)
        for (node_id, node), node_rng in zip(nodes.items(), node_rngs, strict=True)
    }
    return to_frames(measurements, parameters, radio_rng)

"""Clips of captured motion: reading, concatenating to sessions, adding quick turns.

A clip is a ``.npz`` file: ``t`` (n,) [s] at 60 Hz, ``joints`` (15 names), ``positions``
(n, 15, 3) [m], ``segments`` (s names) and ``rotations`` (n, s, 4) quaternions x y z w, world from
segment, in a right-handed world with z up; or a BVH file. The bundled ones are listed in
``clips/README.md``.
"""

from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from zipfile import BadZipFile, is_zipfile

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, LIMB_ENDS
from pose_sim.captured.bvh import is_bvh, read_bvh
from pose_sim.captured.clip import RATE, Clip

BLEND_S = 0.5  # [s] between two clips
MIN_DURATION_S = 0.5  # [s] shortest clip that is used
SPINS_DEG = (90.0, 180.0, 270.0, 360.0)
SPIN_S = (0.8, 2.0)  # [s] duration of a spin
REST_S = (1.5, 5.0)  # [s] between two spins


def read_clip(path: Path) -> Clip:
    """Read a clip, ``.npz``, ``.bvh`` or ``.bvh.gz``.

    Raises:
        InputError: If the file is not a clip.
    """
    if is_bvh(path):
        return read_bvh(path)
    try:
        with np.load(path, allow_pickle=False) as data:
            names = [str(name) for name in data["joints"]]
            order = [names.index(joint) for joint in JOINTS]
            positions = data["positions"][:, order].astype(float)
            quaternions = data["rotations"].astype(float)
            segments = [str(name) for name in data["segments"]]
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (KeyError, ValueError, EOFError, BadZipFile) as error:
        # Of other files, numpy says misleading things.
        why = f" ({error})" if is_zipfile(path) else ""
        raise InputError(
            f"{path} is not a clip of captured motion{why}: expected a BVH file, or an .npz with "
            "joints, positions, segments and rotations"
        ) from error
    rotations = {name: Rotation.from_quat(quaternions[:, i]) for i, name in enumerate(segments)}
    return Clip(name=path.stem, positions=positions, rotations=rotations)


def clips_in(folder: Path) -> list[Path]:
    """The clips of a folder, by name."""
    return sorted(each for each in folder.iterdir() if each.suffix == ".npz" or is_bvh(each))


def bundled_clips() -> list[Path]:
    """The clips that come with the package."""
    return clips_in(Path(str(resources.files("pose_sim.captured") / "clips")))


def chain(clips: Sequence[Clip], duration_s: float) -> Clip:
    """Concatenate clips: each is rotated and moved to the end of the previous one.

    Args:
        clips: One or more; :data:`BLEND_S` seconds between them are interpolated.
        duration_s: Largest duration [s]; the result is centred about the origin.
    """
    whole = clips[0]
    for clip in clips[1:]:
        if len(whole) >= duration_s * RATE:
            break
        if len(clip) >= MIN_DURATION_S * RATE:
            whole = _joined(whole, clip)
    count = min(len(whole), round(duration_s * RATE))
    positions = whole.positions[:count].copy()
    positions[..., :2] -= positions[..., :2].reshape(-1, 2).mean(axis=0)
    rotations = {name: each[:count] for name, each in whole.rotations.items()}
    return Clip(name=whole.name, positions=positions, rotations=rotations)


def _joined(first: Clip, second: Clip) -> Clip:
    turn = Rotation.from_euler("z", heading(first.positions[-1]) - heading(second.positions[0]))
    positions = turn.apply(second.positions.reshape(-1, 3)).reshape(second.positions.shape)
    shift = mid_hip(first.positions[-1]) - mid_hip(positions[0])
    positions += shift * [1.0, 1.0, 0.0]
    count = round(BLEND_S * RATE)
    share = np.linspace(0.0, 1.0, count + 2)[1:-1]
    share = share**2 * (3.0 - 2.0 * share)
    weights = share[:, None, None]
    bridge = (1.0 - weights) * first.positions[-1] + weights * positions[0]
    rotations = {}
    for name in first.rotations.keys() & second.rotations.keys():
        before, after = first.rotations[name], turn * second.rotations[name]
        between = Slerp([0.0, 1.0], Rotation.concatenate([before[-1], after[0]]))(share)
        rotations[name] = Rotation.concatenate([before, between, after])
    for name, (start, end) in LIMB_ENDS.items():  # bones turn and keep their lengths, upper first
        row = slice(len(first), len(first) + count)
        bridge[:, JOINT_INDEX[end]] = bridge[:, JOINT_INDEX[start]] + rotations[name][row].apply(
            (1.0 - share)[:, None] * _bone(first, name, -1)
            + share[:, None] * _bone(second, name, 0)
        )
    return Clip(
        name=first.name,
        positions=np.concatenate([first.positions, bridge, positions]),
        rotations=rotations,
    )


def _bone(clip: Clip, name: str, row: int) -> FloatArray:
    """A limb's bone in its segment's axes, (3,) [m]."""
    start, end = (clip.positions[row, JOINT_INDEX[joint]] for joint in LIMB_ENDS[name])
    return np.asarray(clip.rotations[name][row].inv().apply(end - start))


def spun(clip: Clip, rng: np.random.Generator) -> Clip:
    """The same motion with occasional spins about the vertical."""
    count = len(clip)
    yaw = np.zeros(count)
    at = round(4.0 * RATE)
    while at < count - 3 * RATE:
        length = round(rng.uniform(*SPIN_S) * RATE)
        angle = rng.choice([-1.0, 1.0]) * np.radians(rng.choice(SPINS_DEG))
        w = np.linspace(0.0, 1.0, length)
        yaw[at : at + length] += angle * w**3 * (10.0 - 15.0 * w + 6.0 * w**2)  # minimum jerk
        yaw[at + length :] += angle
        at += length + round(rng.uniform(*REST_S) * RATE)
    turn = Rotation.from_euler("z", yaw[:, None])
    centre = gaussian_filter1d(mid_hip(clip.positions) * [1.0, 1.0, 0.0], 20.0, axis=0)
    joints = range(clip.positions.shape[1])
    positions = [turn.apply(clip.positions[:, j] - centre) + centre for j in joints]
    rotations = {name: turn * each for name, each in clip.rotations.items()}
    return Clip(name=clip.name, positions=np.stack(positions, axis=1), rotations=rotations)


def mid_hip(positions: FloatArray) -> FloatArray:
    """Middle of the hips, (…, 15, 3) to (…, 3) [m]."""
    left, right = JOINT_INDEX["left_hip"], JOINT_INDEX["right_hip"]
    return 0.5 * (positions[..., left, :] + positions[..., right, :])


def heading(positions: FloatArray) -> FloatArray:
    """Heading of the pelvis about z, (…, 15, 3) [m] to (…) [rad]."""
    left, right = JOINT_INDEX["left_hip"], JOINT_INDEX["right_hip"]
    lateral = positions[..., left, :] - positions[..., right, :]
    return np.arctan2(-lateral[..., 0], lateral[..., 1])

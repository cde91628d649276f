r"""Accuracy of the IMUs' orientation filters against optical or simulated truth.

The error of an orientation is a rotation in the world, :math:`R\,R_\text{true}^{-1}`, as a
quaternion :math:`(x, y, z, w)`:

.. math:: e = 2 \arccos |w|, \quad e_\text{heading} = 2 \arctan |z / w|, \quad
   e_\text{inclination} = 2 \arccos \sqrt{w^2 + z^2}

and their root mean squares over the motion are reported. Without a magnetometer the heading is
unobservable: the mean heading error is then removed first.

References:
    Laidig, Caruso, Cereatti, Seel (2021), Data 6(7), doi:10.3390/data6070072: BROAD, the errors.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError
from scipy.spatial.transform import Rotation

from imu_bridge.filters import FILTERS
from imu_bridge.filters.orientation_filter import SampleRound
from imu_bridge.parameters import ImuBridgeParameters
from pose_bench.imu_samples import processed
from pose_bench.sessions import EVALUATED_FROM_S
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.arrays import BoolArray
from pose_sim.session import make_session, settings_of
from pose_sim.virtual_imu import NODES

Track = Callable[[Iterable[int]], Iterable[int]]
"""Function that shows the progress of an iteration."""

DURATION_S, SEED = 60.0, 101  # [s], [-] of the synthetic sessions
BROAD_KEYS = ("imu_gyr", "imu_acc", "imu_mag", "opt_quat", "movement", "sampling_rate")


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A filter with its settings."""

    name: str
    parameters: ImuBridgeParameters

    @property
    def knows_heading(self) -> bool:
        """Whether it uses the magnetometer."""
        return self.parameters.magnetometer != "off"


VARIANTS = (
    Variant(name="vqf", parameters=ImuBridgeParameters(filter="vqf")),
    Variant(
        name="vqf, its authors' tuning",
        parameters=ImuBridgeParameters(filter="vqf", acceleration_tau=3.0, magnetometer_tau=9.0),
    ),
    Variant(name="imufusion", parameters=ImuBridgeParameters(filter="imufusion")),
    Variant(name="madgwick", parameters=ImuBridgeParameters(filter="madgwick")),
    Variant(
        name="madgwick, the paper's",
        parameters=ImuBridgeParameters(
            filter="madgwick", magnetometer="on", beta=0.12, gyro_bias_window=0.0
        ),
    ),
    Variant(
        name="vqf, no magnetometer",
        parameters=ImuBridgeParameters(filter="vqf", magnetometer="off"),
    ),
)
"""Compared variants; ``the paper's`` has the gain of BROAD's authors and no bias estimation."""


KINDS = ("total", "heading", "inclination")
"""Kinds of errors."""


def errors(orientation: FloatArray, truth: FloatArray, *, knows_heading: bool = True) -> FloatArray:
    """Root mean square errors [deg] of :data:`KINDS`, defined in the module's docstring.

    Args:
        orientation: Quaternions (x, y, z, w), shape (n, 4).
        truth: True quaternions, shape (n, 4).
        knows_heading: If False, the mean heading error is removed.
    """
    error = Rotation.from_quat(orientation) * Rotation.from_quat(truth).inv()
    if not knows_heading:
        _, _, z, w = error.as_quat().T
        mean = np.angle(np.mean(np.exp(2j * np.arctan2(z, w))))
        error = Rotation.from_euler("z", -mean) * error
    x, y, z, w = error.as_quat().T

    angles = [
        2.0 * np.arctan2(np.sqrt(x * x + y * y + z * z), np.abs(w)),
        2.0 * np.arctan2(np.abs(z), np.abs(w)),
        2.0 * np.arctan2(np.hypot(x, y), np.hypot(z, w)),
    ]
    return np.degrees(np.sqrt(np.mean(np.square(angles), axis=1)))


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A recording of one IMU with its true orientation.

    Attributes:
        name: Name of the file.
        period_s: Sampling period [s].
        angular_velocity: [rad/s], shape (n, 3).
        acceleration: [m/s^2], shape (n, 3).
        magnetic_field: [uT], shape (n, 3).
        truth: Quaternions (x, y, z, w), shape (n, 4); NaN where unknown.
        judged: Mask of the evaluated samples: motion with known truth, shape (n,).
    """

    name: str
    period_s: float
    angular_velocity: FloatArray
    acceleration: FloatArray
    magnetic_field: FloatArray
    truth: FloatArray
    judged: BoolArray


def read_broad(folder: Path) -> list[Trial]:
    """The trials of a folder of BROAD's ``.mat`` files.

    Raises:
        InputError: If there is none, or a file is not a trial.
    """
    paths = sorted(folder.glob("*.mat"))
    if not paths:
        raise InputError(f"found no .mat file in {folder}: give BROAD's folder data_mat")
    return [_read_trial(path) for path in paths]


def _read_trial(path: Path) -> Trial:
    try:
        content = loadmat(path, squeeze_me=True, variable_names=BROAD_KEYS)
        rate, acceleration, magnetic, optical = (
            np.asarray(content[key], dtype=float) for key in BROAD_KEYS[:4]
        )
        truth = optical[:, [1, 2, 3, 0]]  # BROAD's quaternions are (w, x, y, z)
        moving = np.asarray(content["movement"], dtype=bool)
        period_s = 1.0 / float(content["sampling_rate"])
    except (OSError, KeyError, ValueError, IndexError, NotImplementedError, MatReadError) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path} is not a trial of BROAD ({reason}): expected {', '.join(BROAD_KEYS)}"
        ) from error
    return Trial(
        name=path.stem,
        period_s=period_s,
        angular_velocity=rate,
        acceleration=acceleration,
        magnetic_field=magnetic,
        truth=truth,
        judged=moving & ~np.isnan(truth).any(axis=1),
    )


def filtered(trials: Sequence[Trial], variant: Variant, track: Track) -> list[FloatArray]:
    """Orientations of a filter for each trial, processed in parallel, shape (n, 4) each."""
    filter_ = FILTERS[variant.parameters.filter](len(trials), variant.parameters)
    lengths = np.array([len(trial.judged) for trial in trials])
    periods = np.array([trial.period_s for trial in trials])
    results = [np.empty((length, 4)) for length in lengths]
    for k in track(range(int(lengths.max()))):
        index = np.flatnonzero(k < lengths)
        running = [trials[i] for i in index.tolist()]
        orientation = filter_.update(
            SampleRound(
                index=index,
                dt=periods[index] if k else np.zeros(len(index)),
                angular_velocity=np.array([trial.angular_velocity[k] for trial in running]),
                acceleration=np.array([trial.acceleration[k] for trial in running]),
                magnetic_field=np.array([trial.magnetic_field[k] for trial in running]),
                device_orientation=np.full((len(index), 4), np.nan),
            )
        )
        for i, q in zip(index.tolist(), orientation, strict=True):
            results[i][k] = q
    return results


def trial_errors(trials: Sequence[Trial], variant: Variant, track: Track) -> list[FloatArray]:
    """The errors of a filter on each trial."""
    found = zip(trials, filtered(trials, variant, track), strict=True)
    knows_heading = variant.knows_heading
    return [errors(q[t.judged], t.truth[t.judged], knows_heading=knows_heading) for t, q in found]


def synthetic_errors(choreography: str, level: str, variant: Variant) -> FloatArray:
    """The errors of a filter over all nodes of the synthetic subject.

    The nodes' bytes are processed as by ``imu_bridge``, including the stamps.
    """
    session = make_session(choreography, DURATION_S, SEED, settings_of(level))
    batch = processed(session, variant.parameters)
    # The link's minimum delay is part of the stamps; it is known here and removed.
    times = np.array(batch.stamp_ns) / NS_PER_S - session.settings.imu.radio_latency
    judged = (times >= EVALUATED_FROM_S) & (times <= DURATION_S)
    R_enu_map = Rotation.from_euler("z", session.heading_enu_map)
    found = []
    for i, node_id in enumerate(NODES):
        node = session.nodes[node_id]
        own = judged & (batch.node == i)
        path = session.motion.segment(node.segment, node.place)
        truth = R_enu_map * path.rotation(times[own]) * node.R_segment_sensor
        found.append(
            errors(batch.orientation[own], truth.as_quat(), knows_heading=variant.knows_heading)
        )
    return np.sqrt(np.mean(np.square(found), axis=0))

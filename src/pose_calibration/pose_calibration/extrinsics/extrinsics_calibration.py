"""Extrinsics from simultaneous skeletons of several sensors (li2020 (1)).

The paper estimates ``R`` and ``T`` between its two depth cameras with a board that both see; here
the person's joints replace the board. Any two sensors with common frames are linked; all sensors
are then estimated together, with the offsets of their trackers' joints (:mod:`joint_refinement`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pose_calibration.extrinsics.frame_memory import FrameMemory
from pose_calibration.extrinsics.joint_refinement import JointRefinement, Refinement
from pose_calibration.extrinsics.pair_fits import spanning_transforms
from pose_calibration.extrinsics.parameters import CalibrationParameters
from pose_calibration.floor.floor import estimate_floor
from pose_calibration.floor.gravity import Gravity
from pose_calibration.geometry.rigid_transform import CalibrationError, spread
from pose_core.api import AlignedFrame, Extrinsics, FloatArray, PairResiduals, inverse, transformed
from pose_core.errors import ParameterError
from pose_core.finite_numbers import are_known
from pose_core.joints import JOINTS

MIN_INLIERS = 0.5  # [-] share of a pair's joints
FARTHEST = 5.0  # [-] distance, relative to the median one, of joints by which scales are compared


class ExtrinsicsCalibrator:
    """Collects skeletons of one person from several sensors and estimates their extrinsics.

    Args:
        sensors: The sensors' names, the reference first. With a single one, only the floor is
            estimated.
        parameters: Quality that the calibration must reach, known tilt and height of the reference.

    Raises:
        ParameterError: If there is no sensor, or a name occurs twice.
    """

    def __init__(
        self, sensors: Sequence[str], parameters: CalibrationParameters | None = None
    ) -> None:
        if not sensors or len(set(sensors)) != len(sensors):
            raise ParameterError(f"sensors = {list(sensors)}: expected one or more different names")
        self.sensors = tuple(sensors)
        self.memory = FrameMemory(sensors)
        self._parameters = parameters or CalibrationParameters()
        self._mounting = self._parameters.known_mounting
        self._in_reference = np.empty((0, len(JOINTS), 3))  # all joints of the last solution [m]

    @property
    def frames_with(self) -> dict[str, int]:
        """Largest number of common frames with another sensor, for each but the reference."""
        shared = self.memory.shared_frames * (1 - np.eye(len(self.sensors), dtype=int))
        return {name: int(shared[i].max()) for i, name in enumerate(self.sensors) if i > 0}

    def add(self, frame: AlignedFrame) -> None:
        """Add the skeletons of all sensors at one instant."""
        self.memory.add(frame)

    def solve(self, *, allow_missing: bool = False, gravity: Gravity | None = None) -> Extrinsics:
        """Estimate the extrinsics.

        Args:
            allow_missing: Leave out sensors without a chain of links to the reference, as long as
                one is linked.
            gravity: The vertical in the reference's frame, if measured independently of the person.

        Raises:
            CalibrationError: If the frames do not determine it; the message says why.
        """
        frames = self.memory.frames()
        if not frames:
            raise CalibrationError(self._too_few_frames(self.sensors[-1]))
        positions = np.stack([frame.positions for frame in frames])
        speeds = np.stack([frame.speeds for frame in frames])
        placed, partner, positions = spanning_transforms(
            positions, self.memory.shared_frames, self._parameters.minimum_frames
        )
        missing = [name for i, name in enumerate(self.sensors) if i not in placed]
        if missing and (not allow_missing or len(placed) == 1):
            raise CalibrationError(self._too_few_frames(missing[-1]))
        chosen = sorted(placed)
        T_reference_sensor = np.stack([placed[i] for i in chosen])
        positions, names = positions[:, chosen], [self.sensors[i] for i in chosen]
        residuals: dict[str, PairResiduals] = {}
        offsets: dict[str, FloatArray] = {}
        if len(chosen) > 1:
            refinement = JointRefinement(positions, speeds, T_reference_sensor).solve()
            T_reference_sensor = refinement.T_reference_sensor
            offsets = dict(zip(names, refinement.offsets, strict=True))
            for i in range(1, len(chosen)):
                pair = self._residuals(positions, refinement, chosen, i, partner[chosen[i]])
                residuals[names[i]] = pair
                self._check(pair, names[i])
        in_reference = np.stack(
            [transformed(T, positions[:, i]) for i, T in enumerate(T_reference_sensor)]
        )
        self._in_reference = in_reference
        floor = estimate_floor(in_reference, self._mounting, gravity)
        return Extrinsics(
            reference=self.sensors[0],
            T_reference_sensor=dict(zip(names, T_reference_sensor, strict=True)),
            T_map_reference=floor.T_map_reference,
            residuals=residuals,
            floor=floor,
            view_offsets=offsets,
        )

    def leveled(self, extrinsics: Extrinsics, gravity: Gravity) -> Extrinsics:
        """The last solution with a vertical that was estimated afterwards.

        Args:
            extrinsics: The last result of :meth:`solve`, possibly with clocks.
            gravity: The vertical in the reference's frame.
        """
        floor = estimate_floor(self._in_reference, self._mounting, gravity)
        return replace(extrinsics, T_map_reference=floor.T_map_reference, floor=floor)

    def _too_few_frames(self, name: str) -> str:
        if len(self.sensors) == 1:
            return f"'{name}' never tracked the person: let it see the person and calibrate again"
        shared = self.memory.shared_frames[self.sensors.index(name)].copy()
        shared[self.sensors.index(name)] = -1
        other = self.sensors[int(np.argmax(shared))]
        return (
            f"found {shared.max()} frames in which both '{other}' and '{name}' track the person, "
            f"expected {self._parameters.minimum_frames} or more: stay longer where both see the "
            "whole person"
        )

    def _residuals(
        self,
        positions: FloatArray,
        refinement: Refinement,
        chosen: Sequence[int],
        index: int,
        partner_sensor: int,
    ) -> PairResiduals:
        """Residuals of the sensor ``chosen[index]`` against its partner."""
        T, partner = refinement.T_reference_sensor, chosen.index(partner_sensor)
        T_partner_sensor = inverse(T[partner]) @ T[index]
        shared = are_known(positions[:, partner] + positions[:, index])
        source, target = positions[:, index][shared], positions[:, partner][shared]
        distance = np.linalg.norm(target - transformed(T_partner_sensor, source), axis=1)
        raw = np.linalg.norm(source - target, axis=1)
        inlier = refinement.weights[:, index][shared] > 0.0
        joints = np.broadcast_to(np.arange(len(JOINTS)), shared.shape)[shared]
        extents = spread(target)
        # A joint that leaps about is believed to be fast, and its error is expected.
        is_near = inlier & (distance <= FARTHEST * np.median(distance))
        return PairResiduals(
            partner=self.sensors[partner_sensor],
            frames=int(self.memory.shared_frames[partner_sensor, chosen[index]]),
            raw_median=float(np.median(raw)),
            raw_rms=_rms(raw),
            median=float(np.median(distance)),
            rms=_rms(distance),
            inlier_rms=_rms(distance[inlier]),
            inlier_share={
                JOINTS[joint]: float(inlier[joints == joint].mean()) for joint in np.unique(joints)
            },
            rotation_noise=float(refinement.rotation_stddev[index]),
            position_noise=float(refinement.position_stddev[index]),
            distance=float(np.median(np.linalg.norm(source, axis=1))),
            spread=(float(extents[0]), float(extents[1]), float(extents[2])),
            scale=relative_scale(source[is_near], target[is_near]),
        )

    def _check(self, pair: PairResiduals, name: str) -> None:
        limits = self._parameters
        if pair.median > limits.median_residual or pair.all_inlier_share < MIN_INLIERS:
            raise CalibrationError(
                f"'{pair.partner}' and '{name}' disagree even after calibration: median "
                f"{pair.median:.3f} m, {pair.all_inlier_share:.0%} inliers; expected at most "
                f"{limits.median_residual:.3f} m and at least {MIN_INLIERS:.0%}: let both "
                "see the same single person, check that their clocks agree, and that neither was "
                "moved meanwhile"
            )
        if pair.rotation_noise > limits.rotation_stddev:
            raise CalibrationError(
                f"too little motion between '{pair.partner}' and '{name}': it leaves the rotation "
                f"uncertain by {np.degrees(pair.rotation_noise):.2f} deg, expected at most "
                f"{np.degrees(limits.rotation_stddev):.2f} deg (spread of the joints "
                + ", ".join(f"{extent:.2f}" for extent in pair.spread)
                + " m): raise the arms sideways and walk about, or use a single sensor"
            )


def relative_scale(source: FloatArray, target: FloatArray) -> float:
    """How much larger the same points are in one view than in another, both (n, 3) [-]."""
    size, other = (np.linalg.norm(each - each.mean(axis=0)) for each in (source, target))
    return float(size / other) if len(source) and other > 0.0 else 1.0


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0

"""A person's recorded motion: degrees of freedom, joints and links at increasing instants."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from pose_core.api import (
    MAX_GAP_S,
    ROOT_DOF,
    BodyModel,
    BodyPose,
    ForwardKinematics,
    IntArray,
    SkeletonSample,
    SkeletonSeries,
    available_models,
    load_body_model,
)
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_io.arrays import BoolArray
from pose_io.bags import BagReader, Progress
from pose_io.names import BODIES
from pose_io.skeleton_messages import skeleton_sample
from pose_io.topics import body_topic, body_topics

SNAP_NS = 10_000  # [ns] a limb moves less than 0.1 mm in it
COMPARED = ("_kinect", "_imu")  # suffixes of bodies fused from one kind of sensor


@dataclass(frozen=True, kw_only=True)
class BodyMotion:
    """One person's motion; n instants, d degrees of freedom."""

    body: str  # the person's id
    model: BodyModel
    stamps_ns: IntArray  # (n,) [ns], strictly increasing
    dof: FloatArray  # (n, d) [m] or [rad], the root's rotation as vector of R_map_body
    stddev: FloatArray  # (n, d) [m] or [rad]
    joints: FloatArray  # (n, 15, 3) [m] in map; NaN where unknown
    is_gap: BoolArray  # (n,) whether dof is interpolated across a long gap
    is_unknown: BoolArray  # (n, d) whether the fusion does not know dof, which is interpolated
    offsets: FloatArray  # (15, 3) [m] each joint in the axes of the link it is fixed in

    def __len__(self) -> int:
        return len(self.stamps_ns)

    @property
    def times_s(self) -> FloatArray:
        """Time since the first instant [s], shape (n,)."""
        return (self.stamps_ns - self.stamps_ns[0]) * 1e-9

    @cached_property
    def pose(self) -> BodyPose:
        """Links and joints of the rigid body model at the degrees of freedom."""
        return ForwardKinematics(self.model, self.offsets).pose(self.dof)

    @cached_property
    def is_turn_unknown(self) -> BoolArray:
        """Whether a link's rotation depends on an unknown angle, shape (n, links)."""
        columns: dict[str | None, BoolArray] = {None: np.zeros(len(self), bool)}
        for name, link in self.model.links.items():  # parents first
            own = [self.model.dof_index[dof.name] for dof in link.dof]
            columns[name] = columns[link.parent] | self.is_unknown[:, own].any(axis=1)
        return np.stack([columns[name] for name in self.model.link_names], axis=1)

    @property
    def mean_rate(self) -> float:
        """Mean rate of the instants [Hz], without gaps."""
        steps_ns = np.diff(self.stamps_ns)
        usual = steps_ns <= MAX_GAP_S * NS_PER_S
        return NS_PER_S / float(np.mean(steps_ns[usual] if usual.any() else steps_ns))

    @property
    def rigid_residuals(self) -> tuple[float, float]:
        """Median and largest distance [m] between a joint and its position in the rigid body."""
        distance = np.linalg.norm(self.pose.positions - self.joints, axis=2)
        known = distance[np.isfinite(distance)]
        return (float(np.median(known)), float(known.max())) if len(known) else (0.0, 0.0)

    def _neighbours(self, stamps_ns: IntArray) -> IntArray:
        """The recorded instants before and after others, shape (2, n)."""
        after = np.clip(np.searchsorted(self.stamps_ns, stamps_ns), 1, len(self) - 1)
        return np.stack([self.stamps_ns[after - 1], self.stamps_ns[after]])

    def _snapped(self, stamps_ns: IntArray) -> IntArray:
        """Move instants within 10 µs of a recorded one onto it."""
        near = self._neighbours(stamps_ns)
        distance = np.abs(near - stamps_ns)
        nearest = np.where(distance[0] < distance[1], near[0], near[1])
        return np.where(distance.min(axis=0) <= SNAP_NS, nearest, stamps_ns)

    def at_rate(self, rate: float) -> "BodyMotion":
        """The motion at a constant rate [Hz], from the first instant to the last.

        Joints are NaN in gaps of more than 0.15 s; degrees of freedom are interpolated across
        them and marked, for formats that cannot represent missing frames.
        """
        step_ns = NS_PER_S / rate
        count = int((self.stamps_ns[-1] - self.stamps_ns[0]) / step_ns + 1e-6) + 1
        stamps_ns = self.stamps_ns[0] + np.round(np.arange(count) * step_ns).astype(np.int64)
        stamps_ns = self._snapped(np.minimum(stamps_ns, self.stamps_ns[-1]))
        old, new = self.times_s, (stamps_ns - self.stamps_ns[0]) * 1e-9
        dof, stddev, unknown = (
            np.stack([np.interp(new, old, column) for column in columns.T], axis=1)
            for columns in (self.dof, self.stddev, self.is_unknown.astype(float))
        )
        turn = Slerp(old, Rotation.from_rotvec(self.dof[:, 3:ROOT_DOF]))
        dof[:, 3:ROOT_DOF] = turn(new).as_rotvec()
        state = np.full(self.joints.shape[:2], TrackingState.TRACKED, np.uint8)
        series = SkeletonSeries(
            stamps_ns=self.stamps_ns, positions=self.joints, tracking_state=state
        )
        before_ns, after_ns = self._neighbours(stamps_ns)
        return replace(
            self,
            stamps_ns=stamps_ns,
            dof=dof,
            stddev=stddev,
            joints=series.at(stamps_ns),
            is_gap=(before_ns < stamps_ns)
            & (stamps_ns < after_ns)
            & (after_ns - before_ns > MAX_GAP_S * NS_PER_S),
            is_unknown=unknown > 0.0,
        )


def read_motion(
    bag: BagReader, body: str = "", progress: Progress | None = None, model: BodyModel | None = None
) -> BodyMotion:
    """The fused motion of a bag.

    Args:
        bag: An open bag with ``estimate`` and ``skeleton`` of a person.
        body: The person's id; the only one if empty.
        progress: Called from time to time with the fraction read, 0 to 1.
        model: The body model; if None the bundled one with the bag's joint angles.

    Raises:
        InputError: If the bag lacks either, holds several persons, or no body model fits.
    """
    body = chosen_body(bag, body)
    topics = {leaf: body_topic(bag, leaf, body) for leaf in ("estimate", "skeleton")}
    missing = [f"{BODIES}{body}/{leaf}" for leaf, topic in topics.items() if topic is None]
    if missing:
        raise InputError(
            f"{bag.path} holds no {' and no '.join(missing)}: fuse it first, with "
            f"'./pose fuse {bag.path} OUT', and export OUT"
        )
    names: set[tuple[str, ...]] = set()
    estimates: dict[int, FloatArray] = {}
    skeletons: dict[int, SkeletonSample] = {}
    for index, message in enumerate(bag.messages([topic for topic in topics.values() if topic])):
        content = bag.deserialize(message)
        if message.topic == topics["estimate"]:
            names.add(tuple(content.name))
            dof = np.array([content.position, content.position_stddev])
            estimates.setdefault(nanoseconds(content.header.stamp), dof)
        else:
            sample = skeleton_sample(content, "")
            skeletons.setdefault(sample.stamp_ns, sample)
        if progress is not None and index % 64 == 0:
            progress(bag.share_before(message.stamp_ns))
    if len(names) > 1:
        raise InputError(
            f"{bag.path}: the degrees of freedom of '{body}' change within the bag: export the "
            "part of each body model separately"
        )
    return _assemble(bag, body, next(iter(names), ()), estimates, skeletons, model)


def chosen_body(bag: BagReader, body: str) -> str:
    """The id of the person to export.

    Args:
        bag: A bag with estimates.
        body: The requested id; if empty the only one, not counting those that the viewer has
            fused from one kind of sensor for comparison.

    Raises:
        InputError: If there is no such person, or none, or several to choose from.
    """
    bodies = sorted({*body_topics(bag, "estimate"), *body_topics(bag, "skeleton")})
    if not bodies:
        raise InputError(
            f"{bag.path} holds no fused pose ({BODIES}<id>/estimate): fuse it first, with "
            f"'./pose fuse {bag.path} OUT', and export OUT"
        )
    if body and body not in bodies:
        raise InputError(f"{bag.path} holds no '{body}': choose among {', '.join(bodies)}")
    compared = {f"{other}{ending}" for other in bodies for ending in COMPARED}
    whole = [other for other in bodies if other not in compared]
    if not body and len(whole) > 1:
        raise InputError(f"{bag.path} holds {', '.join(bodies)}: choose one with --body")
    return body or whole[0]


def model_of_angles(names: tuple[str, ...]) -> BodyModel:
    """The body model with these joint angles, in this order.

    Raises:
        InputError: If there is none.
    """
    for model_name in available_models():
        model = load_body_model(model_name)
        if model.angle_names == names:
            return model
    raise InputError(
        f"no body model has these {len(names)} joint angles, from '{names[0] if names else ''}' "
        f"on: expected those of {' or '.join(available_models())}, or --body-model FILE"
    )


def _assemble(
    bag: BagReader,
    body: str,
    names: tuple[str, ...],
    estimates: dict[int, FloatArray],
    skeletons: dict[int, SkeletonSample],
    model: BodyModel | None,
) -> BodyMotion:
    stamps = sorted(set(estimates) & set(skeletons))
    if len(stamps) < 2:
        raise InputError(
            f"{bag.path} holds {len(stamps)} instants with both estimate and skeleton of '{body}' "
            f"(of {len(estimates)} and {len(skeletons)}): expected two or more"
        )
    if model is None:
        model = model_of_angles(names[ROOT_DOF:])
    elif model.angle_names != names[ROOT_DOF:]:
        raise InputError(
            f"{bag.path} has the joint angles {', '.join(names[ROOT_DOF:])}: body model "
            f"'{model.name}' has {', '.join(model.angle_names)}"
        )
    positions, stddev = np.stack([estimates[stamp] for stamp in stamps], axis=1)
    dof = _bridged(positions)
    joints = np.stack([skeletons[stamp].positions for stamp in stamps])
    return BodyMotion(
        body=body,
        model=model,
        stamps_ns=np.array(stamps, np.int64),
        dof=dof,
        stddev=stddev,
        joints=joints,
        is_gap=np.zeros(len(stamps), bool),
        is_unknown=~np.isfinite(positions),
        offsets=measure_offsets(model, dof, joints),
    )


def _bridged(dof: FloatArray) -> FloatArray:
    """Degrees of freedom, shape (n, d), with unknown ones (NaN) interpolated, or 0 throughout."""
    rows, dof = np.arange(len(dof)), dof.copy()
    for column in dof.T:
        known = np.isfinite(column)
        if not known.all():
            column[:] = np.interp(rows, rows[known], column[known]) if known.any() else 0.0
    return dof


def measure_offsets(model: BodyModel, dof: FloatArray, joints: FloatArray) -> FloatArray:
    """Median position of each joint in the axes of its link [m], shape (15, 3).

    Args:
        model: The body model, which gives the link of each joint.
        dof: Degrees of freedom, shape (n, d).
        joints: Positions [m] in map, shape (n, 15, 3).

    Raises:
        InputError: If a joint is never known.
    """
    rotations = ForwardKinematics(model, np.zeros((len(JOINTS), 3))).pose(dof).rotations
    offsets = np.zeros((len(JOINTS), 3))
    for name, place in model.joints.items():
        link = model.links[place.link]
        origin = dof[:, :3] if link.joint is None else joints[:, JOINT_INDEX[link.joint]]
        arm = joints[:, JOINT_INDEX[name]] - origin
        R_map_link = rotations[:, model.link_names.index(place.link)]
        in_link = np.einsum("nji,nj->ni", R_map_link, arm)
        known = np.isfinite(in_link).all(axis=1)
        if not known.any():
            raise InputError(f"joint {name} is never known: there is nothing to export")
        offsets[JOINT_INDEX[name]] = np.median(in_link[known], axis=0)
    return offsets

r"""The filter of the default estimator: links' rotations on the manifold, sensors as they come.

Prediction: constant rates that die away, :math:`\dot\omega = -\omega/\tau + w`, where a link's
white acceleration w goes in part along with its parent's. Update in information form: everything
measured at an instant at once,

.. math:: P^{+} = (P^{-1} + \sum H^T R^{-1} H)^{-1}, \quad e = P^{+} \sum H^T R^{-1} r

and the error e is added to the state on the manifold. The measurement models are linear in the
links' rotations up to second order, so one step suffices; see docs/algorithm.md. The arithmetic is
in :mod:`pose_core.kernels`.
"""

from copy import copy

import numpy as np

from pose_core.body.segment_tree import SegmentTree
from pose_core.filters.looks import CameraLooks, LinkLooks, UpdateReport
from pose_core.filters.motion_prior import MotionPrior, acceleration_power
from pose_core.filters.posture import PosturePrior, posture_numbers
from pose_core.filters.segment_state import Layout, SegmentState
from pose_core.filters.side_swaps import SWAPS
from pose_core.filters.tracker_model import LIMB_ENDS, TrackerNoise, tracker_numbers
from pose_core.kernels.compiling import settled
from pose_core.kernels.correction import Expectations, correct
from pose_core.kernels.placing import Pose
from pose_core.kernels.prediction import MotionNumbers, predict
from pose_core.streams.samples import FloatArray

WRONG_BEND = float(np.radians(-35.0))  # a hinge bent further is a limb turned by half a turn
LARGEST_STDDEV = float(np.radians(60.0))  # an unseen turn grows no further
NO_CAMERAS = CameraLooks(
    positions=np.zeros((0, 15, 3)),
    tracking_state=np.zeros((0, 15), np.uint8),
    cameras=np.zeros((0, 3)),
    offsets=np.zeros((0, 15, 3)),
    delay_s=0.0,
)
NO_IMUS = LinkLooks(
    links=np.zeros(0, np.int64),
    R_map_link=np.zeros((0, 3, 3)),
    variance=np.zeros((0, 3)),
    angular_velocity=np.zeros((0, 3)),
    rate_variance=np.zeros(0),
)


class SegmentFilter:
    """One person's pose, rates and covariance.

    Args:
        tree: The body with its measures.
        motion: How people move.
        noise: What trackers get wrong.
        posture: What is known beforehand.
    """

    def __init__(
        self,
        tree: SegmentTree,
        motion: MotionPrior | None = None,
        noise: TrackerNoise | None = None,
        posture: PosturePrior | None = None,
    ) -> None:
        self.tree = tree
        self.noise = noise or TrackerNoise()
        self.motion = motion or MotionPrior()
        self.layout = Layout(len(tree.parents), len(tree.sliding_links))
        self.motion_numbers = MotionNumbers(
            power=acceleration_power(self.motion, tree),
            rate_memory_s=self.motion.rate_memory,
            slide_memory_s=self.motion.slide_memory,
            slide_variance=self.motion.slide_stddev**2,
            place_memory_s=self.noise.memory,
            largest_stddev=LARGEST_STDDEV,
        )
        self.expectations = Expectations(
            body=tree.numbers,
            tracker=tracker_numbers(self.noise),
            limb_ends=LIMB_ENDS,
            swaps=SWAPS,
            posture=posture_numbers(posture or PosturePrior(), tree),
            wrong_bend=WRONG_BEND,
        )
        self._predict, self._correct = settled(predict), settled(correct)
        self.memory: FloatArray = np.full((len(tree.offsets), 3), np.nan)
        """See :func:`pose_core.kernels.camera.add_camera`."""
        self.state: SegmentState | None = None
        self.predicted: Pose = empty_pose(self.layout)
        """As it was just before the last update."""

    def start(self, R_map_links: FloatArray, position: FloatArray) -> None:
        """Begin at a pose: ``R_map_link`` of all links, shape (links, 3, 3), and the root [m]."""
        motion, layout = self.motion, self.layout
        stddev = np.empty(layout.size)
        stddev[layout.position] = motion.start_position_stddev
        stddev[layout.rotations] = motion.start_angle_stddev
        stddev[layout.slide] = motion.slide_stddev
        stddev[layout.rates] = motion.start_rate_stddev
        stddev[layout.rates.start : layout.rates.start + 3] = motion.start_velocity_stddev
        self.memory.fill(np.nan)
        self.state = SegmentState(
            position=np.array(position, float),
            rotations=np.array(R_map_links, float, order="C"),
            slides=np.zeros((layout.slides, 3)),
            velocity=np.zeros(3),
            rates=np.zeros((layout.links, 3)),
            covariance=np.diag(stddev**2),
        )

    def predict(self, dt_s: float) -> None:
        """Go on by ``dt_s`` [s]."""
        state = self.known_state
        self._predict(
            self.tree.numbers,
            state.pose,
            state.covariance,
            self.memory,
            dt_s,
            self.motion_numbers,
        )

    def ahead(self, dt_s: float) -> "SegmentFilter":
        """The filter ``dt_s`` [s] later, as it would be if nothing were seen until then."""
        other = copy(self)
        other.state, other.memory = self.known_state.copy(), self.memory.copy()
        other.predicted = empty_pose(self.layout)
        if dt_s > 0.0:
            other.predict(dt_s)
        return other

    def joints(self) -> FloatArray:
        """Joint positions [m] in map, shape (15, 3), with the shoulders' slides."""
        return self.tree.joints(self.known_state.pose)

    def update(self, cameras: CameraLooks = NO_CAMERAS, imus: LinkLooks = NO_IMUS) -> UpdateReport:
        """Take everything that is known of the filter's instant.

        Args:
            cameras: What the cameras saw; arrays of contiguous rows.
            imus: What the IMUs say; likewise.

        Raises:
            ValueError: If an array's rows are not contiguous.
            numpy.linalg.LinAlgError: If the covariance lost its positive definiteness.
        """
        state, layout = self.known_state, self.layout
        for array in (*cameras[:-1], *imus):
            if not array.flags.c_contiguous:
                raise ValueError("an array of what is seen has rows apart: make it contiguous")
        distance = np.empty(len(self.tree.offsets))
        of_links = np.empty((2, layout.links, 3, 3))
        outcome = self._correct(
            self.expectations,
            cameras,
            imus,
            state.pose,
            state.covariance,
            self.memory,
            self.predicted,
            distance,
            of_links,
        )
        if not outcome.is_definite:
            raise np.linalg.LinAlgError("the covariance is not positive definite")
        return UpdateReport(outcome=outcome, distance=distance, information=of_links)

    @property
    def known_state(self) -> SegmentState:
        """The state.

        Raises:
            RuntimeError: If there is none yet.
        """
        if self.state is None:
            raise RuntimeError("the filter has not been started")
        return self.state


def empty_pose(layout: Layout) -> Pose:
    """Room for a pose."""
    links, slides = layout.links, layout.slides
    return Pose(
        position=np.empty(3),
        rotations=np.empty((links, 3, 3)),
        slides=np.empty((slides, 3)),
        velocity=np.empty(3),
        rates=np.empty((links, 3)),
    )

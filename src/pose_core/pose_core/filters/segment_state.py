r"""What the segment filter knows: every link's rotation and rate, the root, and their covariance.

The covariance is that of an error: rotations in the group, the error in its tangent space, so that
nothing breaks when the person turns round or lifts an arm overhead,
:math:`R = \\exp([\\delta\\theta]_\\times)\\,\\hat R` with δθ about the world's axes.
"""

from dataclasses import dataclass

from pose_core.kernels.placing import Pose
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True)
class Layout:
    """Where each part of the error lies; first the pose, then its rates.

    Args:
        links: Number of links.
        slides: Number of sliding joints.
    """

    links: int
    slides: int

    @property
    def pose_size(self) -> int:
        """Root position, link rotations, slides."""
        return 3 + 3 * self.links + 3 * self.slides

    @property
    def moving_size(self) -> int:
        """The part of the pose that has rates: all but the slides."""
        return 3 + 3 * self.links

    @property
    def size(self) -> int:
        """The whole error."""
        return self.pose_size + self.moving_size

    @property
    def position(self) -> slice:
        """Of the root."""
        return slice(0, 3)

    @property
    def rotations(self) -> slice:
        """Of all links."""
        return slice(3, self.moving_size)

    @property
    def slide(self) -> slice:
        """Of all sliding joints."""
        return slice(self.moving_size, self.pose_size)

    @property
    def pose(self) -> slice:
        """Everything that a picture shows."""
        return slice(0, self.pose_size)

    @property
    def moving(self) -> slice:
        """The part of the pose that has rates."""
        return slice(0, self.moving_size)

    @property
    def rates(self) -> slice:
        """Of the moving part, in its order."""
        return slice(self.pose_size, self.size)

    def rotation(self, link: int) -> slice:
        """Of one link."""
        return slice(3 + 3 * link, 6 + 3 * link)

    def rate(self, link: int) -> slice:
        """Angular velocity of one link."""
        return slice(self.pose_size + 3 + 3 * link, self.pose_size + 6 + 3 * link)


@dataclass(kw_only=True)
class SegmentState:
    """One person's state."""

    position: FloatArray  # (3,) [m] of the root in map
    rotations: FloatArray  # (links, 3, 3): R_map_link
    slides: FloatArray  # (sliding joints, 3) [m] in their links' axes
    velocity: FloatArray  # (3,) [m/s] of the root
    rates: FloatArray  # (links, 3) [rad/s] in map
    covariance: FloatArray  # (size, size) of the error, in Layout's order

    @property
    def pose(self) -> Pose:
        """The arrays themselves, all but the covariance, for the kernels."""
        return Pose(self.position, self.rotations, self.slides, self.velocity, self.rates)

    def copy(self) -> "SegmentState":
        """An independent copy."""
        return SegmentState(**{name: value.copy() for name, value in vars(self).items()})

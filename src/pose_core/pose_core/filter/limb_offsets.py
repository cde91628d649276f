r"""Offsets of limbs' far joints to their near ones that all views share.

They do not appear in any difference of views. But an IMU turns with its link, whereas such an
offset turns with the body's heading: where a limb has been in several postures, the IMU's mounting
and the offset can be told apart. So each limb l that wears an aligned IMU has its offset
:math:`c_l` in the state, constant and with zero prior mean, and a joint j is measured at

.. math:: z_j = p_j + R_z(\mathrm{heading}) \sum_l c_l + \dots

with the sum over the limbs that carry it.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.segment_tree import without_side
from pose_core.filter.state import NO_COLUMN, FilterState
from pose_core.filter.tuning import CameraNoise
from pose_core.kernels.compiling import compiled_in_place
from pose_core.kernels.joint_kinematics import BodyArrays


def limb_offset_variances(model: BodyModel, noise: CameraNoise) -> FloatArray:
    """Prior variance of each link's offset [m²]; 0 of those that are no limbs, (links,)."""
    kinds = [without_side(name) for name in model.link_names]
    return np.array([noise.limb_offset_stddev.get(kind, 0.0) ** 2 for kind in kinds])


@compiled_in_place
def add_limb_offsets(
    body: BodyArrays,
    state: FilterState,
    joint: int,
    cosine: float,
    sine: float,
    H: FloatArray,
    residual: FloatArray,
) -> None:
    """Add the offsets to a joint's rows.

    Args:
        body: The tree.
        state: Contains the offsets, and their columns.
        joint: The measured joint.
        cosine: Of the root's heading.
        sine: Of the root's heading.
        H: The joint's rows of the Jacobian, (3, n).
        residual: Measured minus predicted position, (3,) [m].
    """
    for index in range(body.carrier_count[joint]):
        link = body.carriers[joint, index]
        first, offset = state.limb_offset_column[link], state.limb_offset[link]
        if first == NO_COLUMN:
            continue
        H[0, first], H[0, first + 1] = cosine, -sine
        H[1, first], H[1, first + 1] = sine, cosine
        H[2, first + 2] = 1.0
        residual[0] -= cosine * offset[0] - sine * offset[1]
        residual[1] -= sine * offset[0] + cosine * offset[1]
        residual[2] -= offset[2]

"""Meshes of the drawn body's parts, each in its own axes.

In the neutral pose all parts' axes are x forward, y to the person's left, z up. A limb's origin is
its proximal joint, and it extends along −z; the pelvis's origin is between the hips, the thorax's
in the torso joint, the head's in the neck. Lengths are measured; thicknesses are those of an adult
of 1.75 m, scaled with the legs. The orientation of hands and feet is not measured: they are drawn
straight.
"""

from collections.abc import Sequence

from pose_core.joints import SIDES
from pose_view.body.measures import BodyMeasures
from pose_view.mesh import Mesh, ellipsoid, joined, loft, moved

LIMBS = ("upper_arm", "forearm", "thigh", "shank")
PARTS: tuple[str, ...] = (
    "pelvis",
    "thorax",
    "head",
    *(f"{side}_{limb}" for side in SIDES for limb in LIMBS),
)
"""The drawn parts, in the order of every array of part poses."""

# Share of the length below the joint, half-axes forward and sideways [m], centre forward [m].
PROFILES: dict[str, Sequence[tuple[float, float, float, float]]] = {
    "upper_arm": (
        *((0.0, 0.050, 0.047, 0.0), (0.35, 0.048, 0.043, 0.003), (0.75, 0.040, 0.037, 0.0)),
        (1.0, 0.034, 0.035, 0.0),
    ),
    "forearm": (
        *((0.0, 0.037, 0.038, 0.0), (0.25, 0.041, 0.038, 0.0), (0.65, 0.033, 0.030, 0.0)),
        (1.0, 0.027, 0.021, 0.0),
    ),
    "thigh": (
        *((0.0, 0.084, 0.078, 0.0), (0.25, 0.083, 0.076, 0.004), (0.7, 0.063, 0.059, 0.003)),
        (1.0, 0.052, 0.051, 0.0),
    ),
    "shank": (
        *((0.0, 0.051, 0.049, 0.0), (0.28, 0.056, 0.053, -0.012), (0.7, 0.038, 0.036, -0.006)),
        (1.0, 0.031, 0.031, 0.0),
    ),
}


def make_parts(measures: BodyMeasures) -> dict[str, Mesh]:
    """The surface of each part by name, those of :data:`PARTS`."""
    size = measures.size
    parts = {
        "pelvis": _pelvis(measures),
        "thorax": _thorax(measures),
        "head": _head(measures),
    }
    for index, side in enumerate(SIDES):
        for limb in LIMBS:
            length = getattr(measures, limb)[index]
            surfaces = [_limb(limb, length, size)]
            if limb == "forearm":
                surfaces.append(_hand(length, size))
            if limb == "shank":
                surfaces.append(_foot(length, size))
            parts[f"{side}_{limb}"] = joined(surfaces)
    return {name: parts[name] for name in PARTS}


def _limb(limb: str, length: float, size: float) -> Mesh:
    return loft(
        [(-share * length, x * size, y * size, c * size) for share, x, y, c in PROFILES[limb]],
        cap=0.5,
    )


def _hand(forearm: float, size: float) -> Mesh:
    """Flat, the palm to the thigh; from the wrist down."""
    rows = ((0.0, 0.026, 0.019), (0.05, 0.040, 0.017), (0.10, 0.040, 0.015), (0.16, 0.028, 0.010))
    return loft([(-forearm - z * size, x * size, y * size) for z, x, y in rows], cap=0.8)


def _foot(shank: float, size: float) -> Mesh:
    """From heel to toes, below the ankle; two ellipsoids and the instep between them."""
    heel = moved(ellipsoid((0.055 * size, 0.036 * size, 0.040 * size)), (-0.025 * size, 0.0, 0.0))
    instep = moved(ellipsoid((0.105 * size, 0.038 * size, 0.034 * size)), (0.055 * size, 0.0, 0.0))
    toes = moved(
        ellipsoid((0.060 * size, 0.045 * size, 0.022 * size)), (0.135 * size, 0.0, -0.014 * size)
    )
    return moved(joined([heel, instep, toes]), (0.0, 0.0, -shank - 0.038 * size))


def _pelvis(measures: BodyMeasures) -> Mesh:
    size, top = measures.size, measures.lower_trunk
    side = max(measures.hips / 2.0 + 0.075 * size, 0.145 * size)
    return loft(
        [
            (-0.075 * size, 0.075 * size, side * 0.78, -0.008 * size),
            (0.0, 0.105 * size, side, -0.008 * size),
            (top * 0.45, 0.100 * size, side * 0.93, -0.002 * size),
            (top, 0.090 * size, side * 0.80, 0.0),
        ],
        cap=0.35,
    )


def _thorax(measures: BodyMeasures) -> Mesh:
    size, top = measures.size, measures.upper_trunk
    side = max(measures.shoulders / 2.0, 0.15 * size)
    return loft(
        [
            (-0.01 * size, 0.088 * size, side * 0.70, 0.0),
            (top * 0.35, 0.106 * size, side * 0.80, 0.004 * size),
            (top * 0.62, 0.112 * size, side * 0.88, 0.004 * size),
            (top * 0.80, 0.094 * size, side * 0.90, -0.004 * size),
            (top * 0.93, 0.066 * size, side * 0.66, -0.010 * size),
            (top * 1.02, 0.050 * size, 0.070 * size, -0.008 * size),
        ],
        cap=0.4,
    )


def _head(measures: BodyMeasures) -> Mesh:
    """Neck, skull about the head joint, and a nose on the face's side."""
    size, middle = measures.size, measures.neck
    neck = loft([(-0.03 * size, 0.052 * size, 0.055 * size), (middle, 0.046 * size, 0.046 * size)])
    rows = (
        *((-0.105, 0.045, 0.040, 0.030), (-0.065, 0.072, 0.058, 0.016), (-0.01, 0.092, 0.072, 0.0)),
        *((0.045, 0.098, 0.078, -0.004), (0.085, 0.078, 0.064, -0.004)),
    )
    skull = loft(
        [(middle + z * size, x * size, y * size, c * size) for z, x, y, c in rows], cap=0.6
    )
    nose = moved(
        ellipsoid((0.020 * size, 0.012 * size, 0.022 * size)),
        (0.094 * size, 0.0, middle - 0.022 * size),
    )
    return joined([neck, skull, nose])

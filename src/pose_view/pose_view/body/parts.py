"""Meshes of the drawn body's parts, each in its own axes.

In the neutral pose all parts' axes are x forward, y to the person's left, z up. A limb's origin is
its proximal joint, and it extends along −z; the pelvis's origin is between the hips, the thorax's
in the torso joint, the head's in the neck. Lengths are measured; thicknesses are those of an adult
of 1.75 m, scaled with the legs. The orientation of hands and feet is not measured: they are drawn
straight.
"""

from collections.abc import Sequence

from pose_core.joints import SIDES
from pose_view.body.measures import LIMBS, BodyMeasures
from pose_view.mesh import Mesh, ellipsoid, joined, loft, moved, scaled

PARTS: tuple[str, ...] = (
    *("pelvis", "thorax", "head"),
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


# Heights, half-axes and centre of ellipses [m] of an adult of 1.75 m, from the wrist down.
HAND = ((0.0, 0.026, 0.019), (-0.05, 0.040, 0.017), (-0.10, 0.040, 0.015), (-0.16, 0.028, 0.010))
SKULL = (  # about the head joint
    *((-0.105, 0.045, 0.040, 0.030), (-0.065, 0.072, 0.058, 0.016), (-0.01, 0.092, 0.072, 0.0)),
    *((0.045, 0.098, 0.078, -0.004), (0.085, 0.078, 0.064, -0.004)),
)


def make_parts(measures: BodyMeasures) -> dict[str, Mesh]:
    """The surface of each part by name, those of :data:`PARTS`."""
    size = measures.size
    parts = {
        "pelvis": _pelvis(measures.hips / size, measures.lower_trunk / size),
        "thorax": _thorax(measures.shoulders / size, measures.upper_trunk / size),
        "head": _head(measures.neck / size),
    }
    for index, side in enumerate(SIDES):
        for limb in LIMBS:
            length = getattr(measures, limb)[index] / size
            profile = [(-share * length, x, y, centre) for share, x, y, centre in PROFILES[limb]]
            surfaces = [loft(profile, cap=0.5)]
            if limb == "forearm":  # the hand is flat, the palm to the thigh
                surfaces.append(moved(loft(HAND, cap=0.8), (0.0, 0.0, -length)))
            if limb == "shank":
                surfaces.append(moved(_foot(), (0.0, 0.0, -length - 0.038)))
            parts[f"{side}_{limb}"] = joined(surfaces)
    return {name: scaled(parts[name], size) for name in PARTS}


def _foot() -> Mesh:
    """From heel to toes, below the ankle; two ellipsoids and the instep between them."""
    heel = moved(ellipsoid((0.055, 0.036, 0.040)), (-0.025, 0.0, 0.0))
    instep = moved(ellipsoid((0.105, 0.038, 0.034)), (0.055, 0.0, 0.0))
    toes = moved(ellipsoid((0.060, 0.045, 0.022)), (0.135, 0.0, -0.014))
    return joined([heel, instep, toes])


def _pelvis(hips: float, top: float) -> Mesh:
    side = max(hips / 2.0 + 0.075, 0.145)
    sections = [
        (-0.075, 0.075, side * 0.78, -0.008),
        (0.0, 0.105, side, -0.008),
        (top * 0.45, 0.100, side * 0.93, -0.002),
        (top, 0.090, side * 0.80, 0.0),
    ]
    return loft(sections, cap=0.35)


def _thorax(shoulders: float, top: float) -> Mesh:
    side = max(shoulders / 2.0, 0.15)
    sections = [
        (-0.01, 0.088, side * 0.70, 0.0),
        (top * 0.35, 0.106, side * 0.80, 0.004),
        (top * 0.62, 0.112, side * 0.88, 0.004),
        (top * 0.80, 0.094, side * 0.90, -0.004),
        (top * 0.93, 0.066, side * 0.66, -0.010),
        (top * 1.02, 0.050, 0.070, -0.008),
    ]
    return loft(sections, cap=0.4)


def _head(middle: float) -> Mesh:
    """Neck, skull about the head joint, and a nose on the face's side."""
    neck = loft([(-0.03, 0.052, 0.055), (middle, 0.046, 0.046)])
    skull = moved(loft(SKULL), (0.0, 0.0, middle))
    nose = moved(ellipsoid((0.020, 0.012, 0.022)), (0.094, 0.0, middle - 0.022))
    return joined([neck, skull, nose])

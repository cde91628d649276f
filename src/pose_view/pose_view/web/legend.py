"""What the colours mean, as HTML."""

import numpy as np

from pose_view.body.joint_marks import CERTAIN, COLORS, MEANINGS, PALE, UNCERTAIN


def legend_html() -> str:
    """A line for each colour of a joint, and a scale of certainty."""
    rows = "".join(
        f'<div style="display:flex;align-items:center;margin:0.2em 0">{_dot(COLORS[key])}'
        f"<span>{meaning}</span></div>"
        for key, meaning in MEANINGS.items()
    )
    steps = "".join(
        _dot(tuple(np.rint((1 - p) * np.array(COLORS["tracked"]) + p * PALE)), 0.75 + 0.35 * p)
        for p in (0.0, 0.25, 0.5, 0.75)
    )
    scale = (
        f'<div style="display:flex;align-items:center;margin-top:0.5em">{steps}'
        f"<span>certain to ±{np.degrees(CERTAIN):.0f}° … ±{np.degrees(UNCERTAIN):.0f}° or worse"
        "</span></div>"
    )
    return (
        '<div style="padding:0.25em 0.75em 0.5em;font-size:0.85em;line-height:1.35">'
        f"<b>Joints</b>{rows}{scale}</div>"
    )


def _dot(color: tuple, size: float = 0.85) -> str:
    r, g, b = (int(c) for c in color)
    return (
        f'<span style="flex:none;width:{size}em;height:{size}em;border-radius:50%;'
        f'background:rgb({r},{g},{b});margin-right:0.5em"></span>'
    )

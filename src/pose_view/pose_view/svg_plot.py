"""A line plot as SVG, whose curves break where nothing is known.

All lengths are in the picture's own units, which its width stretches to the page.
"""

from collections.abc import Sequence

import numpy as np

from pose_core.streams.samples import FloatArray

WIDTH, HEIGHT = 340, 128
LEFT, RIGHT, TOP, BOTTOM = 40, 8, 6, 30
MOST_TICKS = 5  # [-]
STEPS = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0)  # between ticks


def svg_plot(
    x: FloatArray,
    rows: Sequence[FloatArray],
    colors: Sequence[str],
    *,
    x_label: str,
    y_label: str,
    y_range: tuple[float, float],
) -> str:
    """The plot as an SVG element.

    Args:
        x: Shape (n,), ascending, at least two.
        rows: One curve each, shape (n,), NaN where it breaks.
        colors: Of the curves, for CSS.
        x_label: With its unit.
        y_label: With its unit.
        y_range: Lower and upper end.
    """

    def across(value: FloatArray | float) -> FloatArray:
        return LEFT + (np.asarray(value) - x[0]) / (x[-1] - x[0]) * (WIDTH - LEFT - RIGHT)

    def down(value: FloatArray | float) -> FloatArray:
        share = (np.asarray(value) - y_range[0]) / (y_range[1] - y_range[0])
        return HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" style="display:block;width:100%" '
        'font-family="sans-serif" font-size="9.5">'
    ]
    for tick in ticks(*y_range):
        at = f"{down(tick):.1f}"
        grid = "#b8bcc4" if tick == 0.0 else "#e6e8ec"
        parts.append(f'<path d="M{LEFT} {at}H{WIDTH - RIGHT}" stroke="{grid}"/>')
        parts.append(_text(LEFT - 4, float(down(tick)) + 3.3, f"{tick:g}", "end"))
    for tick in ticks(float(x[0]), float(x[-1])):
        at = f"{across(tick):.1f}"
        parts.append(f'<path d="M{at} {TOP}V{HEIGHT - BOTTOM}" stroke="#e6e8ec"/>')
        parts.append(_text(float(across(tick)), HEIGHT - BOTTOM + 11, f"{tick:g}"))
    parts.append(_text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 5, x_label))
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(
        f'<text x="10" y="{middle}" text-anchor="middle" fill="#4b4f58" '
        f'transform="rotate(-90 10 {middle})">{y_label}</text>'
    )
    for row, color in zip(rows, colors, strict=True):
        path = _path(across(x), down(row))
        parts.append(
            f'<path d="{path}" fill="none" stroke="{color}" stroke-width="1.6" '
            'stroke-linejoin="round"/>'
        )
    return "".join([*parts, "</svg>"])


def ticks(low: float, high: float) -> list[float]:
    """Round values in a range, at most :data:`MOST_TICKS` and one."""
    step = next((s for s in STEPS if (high - low) / s <= MOST_TICKS), STEPS[-1])
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [step * k for k in range(first, last + 1)]


def _path(x: FloatArray, y: FloatArray) -> str:
    """Lines through the points, anew after each NaN."""
    words = []
    is_on = False
    for px, py in zip(x.tolist(), y.tolist(), strict=True):
        if py != py:
            is_on = False
            continue
        words.append(f"{'L' if is_on else 'M'}{px:.1f} {py:.1f}")
        is_on = True
    return "".join(words)


def _text(x: float, y: float, text: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="#4b4f58">{text}</text>'

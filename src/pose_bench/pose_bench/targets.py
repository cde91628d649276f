"""Targets of the estimators on the accuracy suite."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pose_bench.means import MethodMeans, Ratio
from pose_bench.methods import BASELINE
from pose_bench.tables import UNKNOWN, TextTable, number


@dataclass(frozen=True)
class Target:
    """Target of one figure of a method."""

    method: str
    quantity: str
    value: Callable[[MethodMeans], float]
    low: float
    high: float
    digits: int = 2

    @property
    def range(self) -> str:
        """The target as text."""
        if math.isfinite(self.low):
            return f"{self.low:g} to {self.high:g}"
        return f"≤ {self.high:g}"


def _coverage_targets(method: str) -> tuple[Target, ...]:
    return (
        Target(method, "errors within 1 σ", lambda mean: mean("within_1"), 0.60, 0.76),
        Target(method, "errors within 2 σ", lambda mean: mean("within_2"), 0.91, 0.99),
    )


NONE = -math.inf  # no lower bound
WITH_IMUS = "default+imus"
TARGETS: tuple[Target, ...] = (
    Target("default", f"RMSE / {BASELINE}", lambda mean: mean.rmse_ratio, NONE, 0.55),
    Target("default", "the same, worst motion and level", lambda m: m.worst_motion[1], NONE, 1.0),
    Target("default", f"MPJPE / {BASELINE}", lambda mean: mean.mpjpe_ratio, NONE, 0.60),
    Target("default", "added lag [ms]", lambda mean: mean("added_lag_ms"), NONE, 15.0, digits=0),
    *_coverage_targets("default"),
    Target(WITH_IMUS, f"RMSE / {BASELINE}", lambda mean: mean.rmse_ratio, NONE, 0.30),
    Target(WITH_IMUS, "RMSE of hips and knees [°]", lambda m: m("hip_knee_rmse_deg"), NONE, 4.0, 1),
    *_coverage_targets(WITH_IMUS),
)


def target_table(found: Sequence[Ratio]) -> TextTable:
    """Table of the targets and the measured figures."""
    table = TextTable(title="Targets", header=("quantity", "target", "found", "met"))
    for target in TARGETS:
        if any(ratio.score.method == target.method for ratio in found):
            value = target.value(MethodMeans(found, target.method))
            shown = number(value, target.digits)
            met = (
                UNKNOWN
                if not math.isfinite(value)
                else "yes"
                if target.low <= value <= target.high
                else "no"
            )
            table.rows.append((f"{target.method}: {target.quantity}", target.range, shown, met))
    return table

"""What the estimators shall reach on the accuracy suite."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pose_bench.means import MethodMeans, Ratio
from pose_bench.methods import BASELINE
from pose_bench.tables import UNKNOWN, TextTable, number


@dataclass(frozen=True, kw_only=True)
class Target:
    """What a method shall reach."""

    method: str
    quantity: str
    value: Callable[[MethodMeans], float]
    low: float = -math.inf
    high: float
    digits: int = 2

    @property
    def range(self) -> str:
        """The target, for people."""
        if math.isfinite(self.low):
            return f"{self.low:g} to {self.high:g}"
        return f"≤ {self.high:g}"

    def is_met(self, value: float) -> bool:
        """Whether a value lies in the range."""
        return self.low <= value <= self.high


def _coverage_targets(method: str) -> tuple[Target, ...]:
    return (
        Target(
            method=method,
            quantity="errors within 1 σ",
            value=lambda mean: mean("within_1"),
            low=0.60,
            high=0.76,
        ),
        Target(
            method=method,
            quantity="errors within 2 σ",
            value=lambda mean: mean("within_2"),
            low=0.91,
            high=0.99,
        ),
    )


TARGETS: tuple[Target, ...] = (
    Target(
        method="default",
        quantity=f"RMSE / {BASELINE}",
        value=lambda mean: mean.rmse_ratio,
        high=0.55,
    ),
    Target(
        method="default",
        quantity="the same, worst motion and level",
        value=lambda mean: mean.worst_motion[1],
        high=1.0,
    ),
    Target(
        method="default",
        quantity=f"MPJPE / {BASELINE}",
        value=lambda mean: mean.mpjpe_ratio,
        high=0.60,
    ),
    Target(
        method="default",
        quantity="added lag [ms]",
        value=lambda mean: mean("added_lag_ms"),
        high=15.0,
        digits=0,
    ),
    *_coverage_targets("default"),
    Target(
        method="default+imus",
        quantity=f"RMSE / {BASELINE}",
        value=lambda mean: mean.rmse_ratio,
        high=0.30,
    ),
    Target(
        method="default+imus",
        quantity="RMSE of hips and knees [°]",
        value=lambda mean: mean("hip_knee_rmse_deg"),
        high=4.0,
        digits=1,
    ),
    *_coverage_targets("default+imus"),
)


def target_table(found: Sequence[Ratio]) -> TextTable:
    """The package's targets and what was found."""
    table = TextTable(title="Targets", header=("quantity", "target", "found", "met"))
    for target in TARGETS:
        if any(ratio.score.method == target.method for ratio in found):
            value = target.value(MethodMeans(found, target.method))
            shown = number(value, target.digits)
            met = UNKNOWN if not math.isfinite(value) else "yes" if target.is_met(value) else "no"
            table.rows.append((f"{target.method}: {target.quantity}", target.range, shown, met))
    return table

"""Scores relative to the baseline's, and their means over the suite's cells."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pose_bench.methods import BASELINE
from pose_bench.scoring import Score
from pose_bench.tables import UNKNOWN
from pose_core.finite_numbers import mean_known


@dataclass(frozen=True, kw_only=True)
class Ratio:
    """A score relative to the baseline's on the same cell."""

    score: Score
    rmse: float  # [-]
    mpjpe: float  # [-]


def ratios(scores: Sequence[Score]) -> list[Ratio]:
    """Ratios of all scores to the baseline's; NaN without a baseline."""
    baseline = {score.cell: score for score in scores if score.method == BASELINE}
    result = []
    for score in scores:
        against = baseline.get(score.cell)
        result.append(
            Ratio(
                score=score,
                rmse=score.rmse_deg / against.rmse_deg if against else math.nan,
                mpjpe=score.mpjpe_mm / against.mpjpe_mm if against else math.nan,
            )
        )
    return result


class MethodMeans:
    """One method's figures over all cells."""

    def __init__(self, found: Sequence[Ratio], method: str) -> None:
        self._own = [ratio for ratio in found if ratio.score.method == method]

    def __call__(self, figure: str) -> float:
        """The mean of a figure."""
        return mean_known([getattr(ratio.score, figure) for ratio in self._own])

    @property
    def rmse_ratio(self) -> float:
        """Mean over the cells of RMSE against the baseline's."""
        return mean_known([ratio.rmse for ratio in self._own])

    @property
    def mpjpe_ratio(self) -> float:
        """Mean over the cells of MPJPE relative to the baseline's."""
        return mean_known([ratio.mpjpe for ratio in self._own])

    @property
    def failed(self) -> int:
        """Cells without figures."""
        return sum(bool(ratio.score.error) for ratio in self._own)

    @property
    def worst_cell(self) -> tuple[str, float]:
        """The session with the largest ratio."""
        return _largest({ratio.score.cell.name: [ratio.rmse] for ratio in self._own})

    @property
    def worst_motion(self) -> tuple[str, float]:
        """The motion and level with the largest ratio, mean over the seeds."""
        groups: dict[str, list[float]] = {}
        for ratio in self._own:
            cell = ratio.score.cell
            groups.setdefault(f"{cell.choreography}, {cell.level}", []).append(ratio.rmse)
        return _largest(groups)


def _largest(groups: Mapping[str, list[float]]) -> tuple[str, float]:
    means = {name: mean_known(values) for name, values in groups.items()}
    known = {name: value for name, value in means.items() if math.isfinite(value)}
    if not known:
        return UNKNOWN, math.nan
    name = max(known, key=lambda each: known[each])
    return name, known[name]

from collections import Counter
from pathlib import Path

import pytest

from pose_bench.accuracy import FIGURES
from pose_bench.methods import METHODS
from pose_bench.suite import (
    CONDITIONS,
    JUDGING_SEEDS,
    LEVELS,
    MOTIONS,
    OFFSET,
    TUNING_CHOREOGRAPHIES,
    TUNING_SEEDS,
    cells,
    quick_cells,
)
from pose_core.errors import InputError

README = (Path(__file__).parents[3] / "src" / "pose_bench" / "README.md").read_text()


def test_the_suite_is_all_motions_levels_and_judging_seeds():
    suite = cells()

    assert len(suite) == len(MOTIONS) * 3 * 3
    assert len(MOTIONS) >= 11
    assert {cell.seed for cell in suite} == set(JUDGING_SEEDS)


@pytest.mark.parametrize("key", ["level", "seed", "choreography"])
def test_every_level_seed_and_motion_has_all_conditions_alike(key):
    counts = Counter((getattr(cell, key), cell.condition) for cell in cells())

    assert len(set(counts.values())) == 1
    assert {condition for _, condition in counts} == set(CONDITIONS)


def test_only_the_offset_condition_has_a_clock_offset():
    for cell in cells():
        assert cell.session.clock_offset_s == (0.08 if cell.condition == OFFSET else 0.0)


def test_held_out_cells_are_not_used_for_tuning():
    assert not set(TUNING_SEEDS) & set(JUDGING_SEEDS)
    assert set(TUNING_CHOREOGRAPHIES) < set(MOTIONS)
    unseen = {cell.choreography for cell in cells() if not cell.is_seen}
    assert unseen == set(MOTIONS) - set(TUNING_CHOREOGRAPHIES)
    assert all(cell.is_seen for cell in cells(seeds=TUNING_SEEDS))


def test_the_quick_suite_has_every_condition():
    assert {cell.condition for cell in quick_cells()} == set(CONDITIONS)


def test_an_unknown_choreography_is_refused_with_the_ones_there_are():
    with pytest.raises(InputError, match="unknown choreography 'polka': expected leg_lift_march"):
        cells(["polka"])


def test_the_readme_documents_tuning_sets_figures_and_methods():
    tuning, judging = README.split("Parameters may be tuned on")[1].split("The evaluation uses")
    judging = judging.split("###")[0]
    for name in MOTIONS:
        assert f"`{name}`" in (tuning if name in TUNING_CHOREOGRAPHIES else judging)
    for seed in TUNING_SEEDS:
        assert str(seed) in tuning
    for seed in JUDGING_SEEDS:
        assert str(seed) in judging
    for name in (*LEVELS, *CONDITIONS, *FIGURES, *(method.name for method in METHODS)):
        assert f"`{name}`" in README or f": `{name}`" in README

"""The suite on captured motion: its sessions, variants and tables."""

from collections import Counter
from dataclasses import MISSING, fields, replace
from pathlib import Path

import numpy as np
import pytest

from pose_bench.captured import METHODS, CapturedScore
from pose_bench.captured_suite import CALIBRATED, CONDITIONS, KNOWN, OFFSET, caption, captured_specs
from pose_bench.captured_tables import captured_csv, source_table, summary_table
from pose_bench.captured_variants import IMU_SETS, ablation_methods, imu_set_methods
from pose_core.errors import InputError
from pose_core.joints import SEGMENTS
from pose_sim.captured.clips import bundled_clips
from pose_sim.captured.trackers import HELD_OUT_TRACKERS, TUNING_TRACKERS

SCORE = CapturedScore(
    source="here", session="one", trackers="a/b", condition=KNOWN, method="default", rmse_deg=6.0,
    hip_knee_deg=5.0, r=0.9, mpjpe_mm=30.0, lag_ms=40.0, tracker_delay_ms=30.0, jerk=500.0,
    rmse_ratio=0.5, mpjpe_ratio=0.8, within_1=0.7, within_2=0.95,
)  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """Twelve people with a clip each."""
    rows = ["file,subject"]
    for index in range(12):
        path = tmp_path / f"clip_{index:02d}.npz"
        path.write_bytes(bundled_clips()[0].read_bytes())
        rows.append(f"{path.name},person {index:02d}")
    (tmp_path / "index.csv").write_text("\n".join(rows))
    return tmp_path


def test_each_condition_has_a_third_of_the_sessions(folder):
    specs = captured_specs(folder, held_out=True, seed=1)
    assert Counter(spec.condition for spec in specs) == {KNOWN: 4, CALIBRATED: 4, OFFSET: 4}
    assert all((spec.clock_offset_s != 0.0) == (spec.condition == OFFSET) for spec in specs)


def test_conditions_go_on_from_one_folder_to_the_next(folder):
    first, *_ = captured_specs(folder, held_out=True, seed=1, first=1)
    assert first.condition == CALIBRATED


def test_judged_sessions_have_held_out_trackers_and_delays(folder):
    judged = captured_specs(folder, held_out=True, seed=1)
    assert {name for spec in judged for name in spec.trackers} >= set(HELD_OUT_TRACKERS)
    assert {delay for spec in judged for delay in spec.delays_s} > {0.0}
    tuned = captured_specs(folder, held_out=False, seed=1)
    assert {name for spec in tuned for name in spec.trackers} <= set(TUNING_TRACKERS)


def test_the_caption_says_that_motion_was_used_for_tuning(folder):
    assert "tuning" in caption(captured_specs(None, held_out=True, seed=1))
    assert "tuning" not in caption(captured_specs(folder, held_out=True, seed=1))


def test_the_same_seed_gives_the_same_suite(folder):
    assert captured_specs(folder, held_out=True, seed=3) == captured_specs(
        folder, held_out=True, seed=3
    )


def test_a_folder_without_clips_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no clips"):
        captured_specs(tmp_path, held_out=True, seed=1)


def test_imu_sets_grow_from_none_to_all_segments():
    methods = imu_set_methods()
    assert not methods[0].use_imus
    assert [len(segments) for segments in IMU_SETS.values()] == [1, 2, 2, 3, 5, 9, 11, 13, 15]
    assert {segment for method in methods for segment in method.segments} == set(SEGMENTS)


def test_each_ablation_differs_from_the_whole_filter():
    without = [method.tuning for method in ablation_methods() if method.tuning is not None]
    assert len(set(map(repr, without))) == len(without) >= 6


def test_tables_have_the_mean_the_worst_session_and_what_failed():
    worse = replace(SCORE, session="two", rmse_ratio=0.7)
    failed = CapturedScore(
        source="here", session="three", trackers="a/b", condition=KNOWN, method="default",
        error="not calibrated",
    )  # fmt: skip
    table = summary_table([SCORE, worse, failed], "title")
    assert table.rows[0].name == "default"
    assert [cell.text for cell in table.rows[0].cells[:2]] == ["0.60", "0.70, 1 failed"]
    rows = source_table([SCORE, worse], ["default"]).rows
    assert [row.name for row in rows] == ["here, default", "known, default"]


def test_the_csv_has_a_row_for_each_session_and_method():
    lines = captured_csv([SCORE, SCORE]).splitlines()
    assert len(lines) == 3
    assert "0.5" in lines[1].split(",")


def test_every_method_has_a_name_of_its_own():
    assert len({method.name for method in METHODS}) == len(METHODS)
    assert np.isnan(CapturedScore(source="", session="", trackers="", condition="", method="").r)


def test_the_readme_documents_conditions_methods_and_figures():
    readme = (Path(__file__).parents[3] / "src" / "pose_bench" / "README.md").read_text()
    figures = [field.name for field in fields(CapturedScore) if field.default is not MISSING]
    for name in (*CONDITIONS, *(method.name for method in METHODS), *figures):
        assert f"`{name}`" in readme

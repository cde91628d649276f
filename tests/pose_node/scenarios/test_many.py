"""A tool over many recordings: whole outputs, made once, resumed, on cores and on a cluster."""

import sys
from pathlib import Path

import pytest
from distributed import LocalCluster

from pose_node.many import (
    OUTPUT,
    Job,
    recordings_under,
    remove_leftovers,
    run_job,
    run_jobs,
    summary,
    without_suffix,
)

COPY = "import shutil, sys; shutil.copy(*sys.argv[1:3]); print('made', sys.argv[2])"
SLOW_COPY = "import time; time.sleep(0.3); " + COPY
BROKEN = "import sys; open(sys.argv[2], 'w').write('half'); sys.exit('error: damaged')"


def bags(folder, count):
    for index in range(count):
        path = folder / f"day{index % 2}" / f"walk{index}"
        path.mkdir(parents=True)
        (path / "metadata.yaml").write_text(f"bag {index}")
    return recordings_under(folder)


def jobs_of(recordings, out, code=COPY):
    return [
        Job(
            recording=str(each),
            run="test",
            output=str(out / each.parent.name / each.name),
            command=(sys.executable, "-c", code, str(each / "metadata.yaml"), OUTPUT),
        )
        for each in recordings
    ]


def written(out):
    return sorted(path.name for path in out.rglob("*") if path.is_file())


def test_bags_are_found_at_any_depth_and_not_inside_a_bag(tmp_path):
    found = bags(tmp_path / "in", 4)
    assert [each.name for each in found] == ["walk0", "walk2", "walk1", "walk3"]
    assert recordings_under(found[0]) == []
    assert recordings_under(tmp_path / "nothing") == []


@pytest.mark.parametrize("name", ["walk.db3", "walk_0.db3", "walk_0.mcap"])
def test_a_bag_without_metadata_is_not_a_folder_of_bags(tmp_path, name):
    bag = tmp_path / "day" / "walk"
    bag.mkdir(parents=True)
    (bag / name).touch()
    assert recordings_under(bag) == []
    assert recordings_under(tmp_path / "day") == [bag]


def test_bag_files_with_other_names_are_separate_bags(tmp_path):
    files = [tmp_path / "in" / f"{name}.mcap" for name in ("run", "walk")]
    files[0].parent.mkdir()
    for file in files:
        file.touch()
    assert recordings_under(tmp_path / "in") == files


def test_a_folder_without_bags_may_hold_text_recordings(tmp_path):
    files = [tmp_path / "in" / "day" / name for name in ("a.csv", "b.csv.gz")]
    files[0].parent.mkdir(parents=True)
    for file in (*files, files[0].with_name("notes.txt"), files[0].with_name(".c.csv")):
        file.touch()
    assert recordings_under(tmp_path / "in") == files
    (found,) = bags(tmp_path / "in", 1)
    assert recordings_under(tmp_path / "in") == [found]


def test_a_dot_in_a_recording_s_name_is_kept():
    names = ["P01.walk", "P01.run.mcap", "P01.stand.csv.gz"]
    assert [without_suffix(Path("in", name)).name for name in names] == [
        "P01.walk",
        "P01.run",
        "P01.stand",
    ]


def test_the_complete_output_of_a_tool_is_shown(tmp_path):
    code = COPY + "; print('  IMU torso: used')"
    (job,) = jobs_of(bags(tmp_path / "in", 1), tmp_path / "out", code)
    assert run_job(job).message == f"made {job.output}\n  IMU torso: used"


def test_a_second_run_creates_only_missing_outputs(tmp_path):
    jobs = jobs_of(bags(tmp_path / "in", 5), tmp_path / "out")
    made = list(run_jobs(jobs, 2))
    assert [each.state for each in made] == ["done"] * 5
    assert {each.message for each in made} == {f"made {job.output}" for job in jobs}
    Path(jobs[2].output).unlink()
    states = {each.job.output: each.state for each in run_jobs(jobs, 2)}
    assert states.pop(jobs[2].output) == "done"
    assert set(states.values()) == {"there already"}
    assert written(tmp_path / "out") == sorted(Path(each.output).name for each in jobs)


def test_a_failure_is_reported_and_leaves_no_partial_output(tmp_path):
    (job,) = jobs_of(bags(tmp_path / "in", 1), tmp_path / "out", BROKEN)
    outcome = run_job(job)
    assert (outcome.state, outcome.message) == ("failed", "error: damaged")
    assert written(tmp_path / "out") == []
    assert summary([outcome]).caption == "1 failed"


@pytest.mark.timeout(120)
def test_the_job_of_a_killed_worker_is_completed_once(tmp_path):
    jobs = jobs_of(bags(tmp_path / "in", 12), tmp_path / "out", SLOW_COPY)
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        outcomes = []
        for outcome in run_jobs(jobs, 2, cluster.scheduler_address):
            outcomes.append(outcome)
            if len(outcomes) == 4:
                cluster.workers[0].process.process.kill()
    remove_leftovers(jobs)
    assert sorted(each.job.output for each in outcomes) == sorted(each.output for each in jobs)
    assert {each.state for each in outcomes} <= {"done", "there already"}
    assert written(tmp_path / "out") == sorted(Path(each.output).name for each in jobs)

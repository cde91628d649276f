"""The entry ``./pose`` and the scripts behind it: what is cheap to see of them."""

import re
from pathlib import Path

import pytest

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("prepare")]

ROOT = Path(__file__).resolve().parents[3]
POSE = ROOT / "pose"


def test_a_second_build_changes_nothing(start_process):
    first = start_process([POSE, "build"])
    assert first.wait(300.0) == 0

    second = start_process([POSE, "build"])

    assert second.wait() == 0
    assert second.output == ""


def test_pose_runs_from_any_folder_through_a_link(start_process, tmp_path):
    link = tmp_path / "pose"
    link.symlink_to(POSE)

    process = start_process([link, "run", "pose_launch", "up", "--help"], cwd=tmp_path)

    assert process.wait() == 0
    assert process.output.startswith("usage: pose up")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nonsense"], 2, "error: unknown verb 'nonsense'"),
        (["run", "pose_launch"], 2, "error: usage: ./pose run PACKAGE EXECUTABLE"),
        (["run", "pose_launch", "nothing"], 1, "error: found no executable 'nothing' in package"),
        (["build", "--nonsense"], 2, "error: usage: ./pose build [--develop]"),
        (["build", "--help"], 0, "usage: ./pose build [--develop]"),
        (["python", "-c", "import pose_msgs.msg; print('ok')"], 0, "ok"),
        (["run", "--help"], 0, "usage: ./pose run PACKAGE EXECUTABLE [arguments]"),
        (["lint", "--nonsense"], 2, "usage: ./pose lint"),
        ([], 2, "usage: ./pose VERB"),
        (["--help"], 0, "usage: ./pose VERB"),
    ],
)
def test_a_command_line_is_answered(start_process, arguments, code, message):
    process = start_process([POSE, *arguments])

    assert process.wait() == code
    assert process.output.startswith(message)


@pytest.mark.parametrize("verb", ["run", "python", "test", "lint", "build"])
def test_help_on_a_verb_of_the_script_prepares_nothing(start_process, tmp_path, verb):
    home = tmp_path / "home"

    process = start_process([POSE, verb, "--help"], env={"POSE_HOME": str(home)})

    assert process.wait() == 0
    assert process.output.startswith(f"usage: ./pose {verb}")
    assert not home.exists()


def test_every_verb_of_the_help_is_known(start_process):
    usage = start_process([POSE, "--help"])
    assert usage.wait() == 0
    verbs = [
        word.strip(",")
        for line in usage.output.splitlines()
        if line.startswith("  ")
        for word in line[2:26].split()
        if word.strip(",").isalpha() and word.islower()
    ]

    cases = POSE.read_text().split('case "$verb" in')[1]
    known = set(re.findall(r"[a-z]+", " ".join(re.findall(r"^    ([a-z |]+)\)", cases, re.M))))

    assert {"demo", "up", "fuse", "calibrate", "record", "play", "test", "build"} <= set(verbs)
    assert set(verbs) <= known


def test_a_path_with_a_space_is_refused_with_a_remedy(start_process, tmp_path):
    process = start_process([POSE, "build"], env={"POSE_HOME": str(tmp_path / "a b")})

    assert process.wait() == 1
    assert "has a space or a colon" in process.output
    assert "set POSE_HOME to another folder" in process.output


def test_an_unsupported_python_is_refused(start_process, tmp_path):
    old = tmp_path / "python"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    home = tmp_path / "home"

    process = start_process([POSE, "build"], env={"POSE_HOME": str(home), "POSE_PYTHON": str(old)})

    assert process.wait() == 1
    assert f"error: found no Python 3.10 to 3.13 among {old}" in process.output


def test_the_environment_keeps_its_original_python(start_process, tmp_path):
    """Until POSE_PYTHON names another: with stand-ins that say who was asked."""
    remembered, named = tmp_path / "remembered", tmp_path / "named"
    for python in (remembered, named):
        python.write_text(
            "#!/bin/sh\n"
            f'[ "$1" = -m ] && echo asked {python.name} && exit 1\n'
            f'case "$2" in *realpath*) echo {python} ;; esac\n'
        )
        python.chmod(0o755)
    home = tmp_path / "home"
    home.mkdir()
    (home / "python").write_text(f"wheels\n{remembered}\n")
    environment = {"POSE_HOME": str(home), "POSE_ROS_SETUP": "/nowhere"}

    again = start_process([POSE, "build"], env={**environment, "POSE_PYTHON": ""})
    assert again.wait() == 1
    other = start_process([POSE, "build"], env={**environment, "POSE_PYTHON": str(named)})
    assert other.wait() == 1

    assert "asked remembered" in again.output
    assert "asked named" in other.output


def test_the_image_s_system_step_runs_through(start_process, tmp_path):
    """With stand-ins for the programs that would change this machine."""
    for program in ("apt-get", "useradd", "mkdir", "chown", "getent"):
        stand_in = tmp_path / program
        known = "exit 2" if program == "getent" else ""  # no such user yet
        stand_in.write_text(f'#!/bin/sh\necho {program} "$@"\n{known}\n')
        stand_in.chmod(0o755)
    script = ROOT / "scripts" / "docker_system.sh"

    process = start_process(
        [script, "10001", "/opt/x", "/recordings"], env={"PATH": f"{tmp_path}:/usr/bin:/bin"}
    )

    assert process.wait() == 0
    assert "useradd --create-home --uid 10001 --groups dialout pose" in process.output
    assert process.output.splitlines()[-1] == "chown -R 10001 /opt/x /recordings"


def test_the_image_is_made_of_the_repository_s_scripts():
    steps = [
        line.split(maxsplit=1)[1]
        for line in (ROOT / "docker" / "Dockerfile").read_text().splitlines()
        if line.startswith("RUN ")
    ]

    assert steps
    for step in steps:
        program = step.split()[0].replace("/opt/pose_fusion/", "./")
        assert (ROOT / program).is_file(), f"{step}: not a script of the repository"


def test_a_read_only_home_is_reported_with_a_remedy(start_process):
    process = start_process([POSE, "build"], env={"POSE_HOME": "/proc/pose"})

    assert process.wait() == 1
    (line,) = process.output.splitlines()
    assert line.startswith("error: cannot write /proc/pose, which is ")
    assert "set POSE_HOME to a folder of your own" in line

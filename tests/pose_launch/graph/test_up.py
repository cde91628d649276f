"""``up`` with real processes: it ends all that it has started."""

import signal
import sys
import textwrap

import psutil
import pytest
from patience import PATIENCE_S

pytestmark = pytest.mark.graph

WAITING = """\
import signal, sys, time
print("ready", flush=True)
try:
    while True:
        time.sleep(60)
except KeyboardInterrupt:
    print("interrupted once", flush=True)
"""


@pytest.fixture
def up(tmp_path, start_process):
    """Start ``up`` on a launch file whose ``{name}`` are Python scripts."""

    def up(launch, *arguments, scripts=None, prefix=()):
        for name, text in (scripts or {}).items():
            (tmp_path / f"{name}.py").write_text(textwrap.dedent(text))
        commands = {name: f"{sys.executable} {tmp_path / name}.py" for name in scripts or {}}
        file = tmp_path / "x.launch.yaml"
        file.write_text(textwrap.dedent(launch).format(**commands))
        command = [sys.executable, "-c", "from pose_launch.up import main; main()"]
        return start_process([*prefix, *command, str(file), *arguments])

    return up


TWO = """\
    launch:
    - executable: {{cmd: "{waiting}", name: one}}
    - executable: {{cmd: "{waiting}", name: two}}
    """


def started(process):
    process.wait_for_output(r"\[one\] +ready")
    process.wait_for_output(r"\[two\] +ready")
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_every_process_well(up, start_process, number):
    process = started(up(TWO, scripts={"waiting": WAITING}))

    process.signal(number)

    assert process.wait() == 0
    assert process.output.count("interrupted once") == 2
    assert start_process.living() == []


def test_ctrl_c_of_a_terminal_and_one_more_end_it_without_a_traceback(up, start_process):
    process = started(up(TWO, scripts={"waiting": WAITING}))

    process.signal(signal.SIGINT, group=True)
    process.signal(signal.SIGINT)
    process.signal(signal.SIGTERM)

    assert process.wait() == 0
    assert "Traceback" not in process.output
    assert start_process.living() == []


def test_nothing_outlives_a_killed_launcher(up, start_process):
    process = started(up(TWO, scripts={"waiting": WAITING}))

    process.signal(signal.SIGKILL)

    process.wait()
    _, alive = psutil.wait_procs(start_process.living(), timeout=PATIENCE_S)
    assert alive == []


def test_children_heed_ctrl_c_though_the_launcher_was_started_in_the_background(up):
    process = started(
        up(TWO, scripts={"waiting": WAITING}, prefix=["sh", "-c", "trap '' INT; exec \"$@\"", "sh"])
    )

    process.signal(signal.SIGTERM)

    assert process.wait() == 0
    assert process.output.count("interrupted once") == 2


def test_a_process_that_fails_at_its_start_is_reported_and_stops_the_others(up, start_process):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{waiting}", name: one}}
        - executable: {{cmd: "{dying}", name: two}}
        """,
        scripts={"waiting": WAITING, "dying": "import sys; print('error: no'); sys.exit(3)"},
    )

    assert process.wait() == 1
    assert "[up] two has died (exit code 3) at its start: error: no\n" in process.output
    assert "or let them run with --keep-going" in process.output
    assert "failed: two (exit code 3)" in process.output
    assert start_process.living() == []


def test_one_that_is_not_there_stops_the_others(up):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{waiting}", name: one}}
        - executable: {{cmd: "no_such_program_anywhere", name: two}}
        """,
        scripts={"waiting": WAITING},
    )

    assert process.wait() == 1
    assert "two cannot start: " in process.output


def test_one_that_ends_well_at_once_leaves_the_others_alone(up):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{waiting}", name: one}}
        - executable: {{cmd: "{done}", name: two}}
        """,
        scripts={"waiting": WAITING, "done": ""},
    )

    process.wait_for_output(r"\[up\] two has finished")
    process.wait_for_output(r"\[one\] ready")
    assert process.stop() == 0


def test_a_process_that_dies_is_reported_and_the_others_continue_with_keep_going(up):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{waiting}", name: one}}
        - executable: {{cmd: "{dying}", name: two}}
        """,
        "--keep-going",
        scripts={"waiting": WAITING, "dying": "import sys; print('last words'); sys.exit(3)"},
    )

    process.wait_for_output(r"\[up\] two has died \(exit code 3\)")
    process.wait_for_output(r"\[two\] last words")
    process.wait_for_output(r"\[one\] ready")
    assert process.returncode is None
    assert process.stop() == 1
    assert "failed: two (exit code 3)" in process.output


def test_it_ends_well_when_every_process_has(up):
    process = up(
        'launch: [executable: {{cmd: "{done}", name: one}}]', scripts={"done": "print('x' * 10**6)"}
    )

    assert process.wait() == 0
    letters = process.output.count("x")
    assert letters == 10**6
    assert "one has finished" in process.output


def test_a_missing_program_is_reported(up):
    process = up('launch: [executable: {{cmd: "no_such_program_anywhere"}}]')

    assert process.wait() == 1
    assert "no_such_program_anywhere cannot start: " in process.output


def test_a_required_process_takes_the_graph_with_it(up):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{waiting}", name: one}}
        - executable: {{cmd: "{done}", name: two, on_exit: shutdown}}
        """,
        scripts={"waiting": WAITING, "done": ""},
    )

    assert process.wait() == 0
    assert "two was required: stopping" in process.output


def test_respawn_starts_it_again(up, tmp_path):
    process = up(
        """\
        launch:
        - executable:
            cmd: "{twice}"
            respawn: "true"
            respawn_delay: 0.1
        """,
        scripts={
            "twice": f"""\
            import os, pathlib, signal, time
            mark = pathlib.Path({str(tmp_path / "mark")!r})
            if not mark.exists():
                mark.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            print("second life", flush=True)
            try:
                time.sleep(600)
            except KeyboardInterrupt:
                pass
            """
        },
    )

    process.wait_for_output(r"has died \(signal SIGKILL\): starting it again in 0.1 s")
    process.wait_for_output("second life")
    assert process.stop() == 0


def test_one_that_has_finished_or_has_never_started_is_not_respawned(up):
    process = up(
        """\
        launch:
        - executable: {{cmd: "{done}", name: one, respawn: "true"}}
        - executable: {{cmd: "{failing}", name: two, respawn: "true"}}
        """,
        scripts={"done": "", "failing": "raise SystemExit(5)"},
    )

    assert process.wait() == 1
    assert "two has died (exit code 5) at its start" in process.output
    assert "again" not in process.output


RECORDING = """\
    launch:
    - arg: {{name: exit_at_end, default: "false"}}
    - executable: {{cmd: "{waiting}", name: fusion}}
    - node:
        pkg: demo_pkg
        exec: replay
        name: left
        param: [{{name: exit_at_end, value: "$(var exit_at_end)", type: "bool"}}]
    """


@pytest.fixture
def replay(tmp_path, monkeypatch):
    """A package whose executable ends well at once, or waits if it is not to exit at the end."""
    for folder in ("share/ament_index/resource_index/packages", "lib/demo_pkg"):
        (tmp_path / "prefix" / folder).mkdir(parents=True)
    (tmp_path / "prefix/share/ament_index/resource_index/packages/demo_pkg").touch()
    program = tmp_path / "prefix/lib/demo_pkg/replay"
    program.write_text(
        '#!/bin/sh\nfor word; do case "$word" in *.yaml) file="$word";; esac; done\n'
        'grep -q "exit_at_end: true" "$file" || exec sleep 600\n'
    )
    program.chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


@pytest.mark.usefixtures("replay")
def test_it_ends_when_its_recordings_have(up, start_process):
    process = up(RECORDING, scripts={"waiting": WAITING})

    assert process.wait() == 0
    assert "[up] Ctrl-C stops all of it, and so does the end of the recording" in process.output
    assert "every recording has ended: stopping (--keep-running stays)" in process.output
    assert start_process.living() == []


@pytest.mark.usefixtures("replay")
def test_it_continues_after_its_recordings_with_keep_running(up):
    process = up(RECORDING, "--keep-running", "--print", scripts={"waiting": WAITING})

    assert process.wait() == 0
    assert "exit_at_end:=false" in process.output


def test_what_a_process_leaves_behind_ends_with_it(up, start_process):
    process = up(
        'launch: [executable: {{cmd: "{parent}"}}]',
        scripts={
            "parent": """\
            import subprocess, sys
            subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
            """
        },
    )

    assert process.wait() == 0
    assert start_process.living() == []


def test_a_process_that_ignores_ctrl_c_is_terminated_and_then_killed(tmp_path, start_process):
    stubborn = tmp_path / "stubborn.py"
    stubborn.write_text(
        "import signal, time\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print('ready', flush=True)\n"
        "time.sleep(600)\n"
    )
    hasty = tmp_path / "hasty.py"
    hasty.write_text(
        "import asyncio, signal, sys\n"
        "from pose_launch import supervising\n"
        "from pose_launch.processes import Process\n"
        "supervising.ESCALATION = ((signal.SIGINT, 0.1), (signal.SIGTERM, 0.1),"
        " (signal.SIGKILL, None))\n"
        "async def run(process):\n"
        "    return await supervising.ProcessSupervisor([process]).run()\n"
        f"process = Process(name='stubborn', command=(sys.executable, {str(stubborn)!r}))\n"
        "sys.exit(asyncio.run(run(process)))\n"
    )
    process = start_process([sys.executable, hasty])
    process.wait_for_output("ready")

    assert process.stop() == 1
    assert "sending SIGTERM" in process.output
    assert "sending SIGKILL" in process.output
    assert "failed: stubborn (signal SIGKILL)" in process.output


def test_the_launcher_opens_no_network_port(up):
    process = started(up(TWO, scripts={"waiting": WAITING}))

    assert psutil.Process(process.pid).net_connections() == []


def test_a_reader_that_goes_away_stops_it(tmp_path, up, start_process):
    file = tmp_path / "y.launch.yaml"
    script = tmp_path / "chatty.py"
    script.write_text("import time\nwhile True:\n    print('again'); time.sleep(0.01)\n")
    file.write_text(f'launch: [executable: {{cmd: "{sys.executable} {script}"}}]')
    command = f"{sys.executable} -c 'from pose_launch.up import main; main()' {file}"

    process = start_process(["sh", "-c", f"{command} | head -n 3"], env={"SHELL": "/bin/sh"})

    assert process.wait() == 0
    assert "Traceback" not in process.output
    assert start_process.living() == []


def test_dry_run_prints_the_commands_and_starts_nothing(up):
    process = up(TWO, "--print", scripts={"waiting": "import sys; sys.exit(9)"})

    assert process.wait() == 0
    assert process.output.splitlines()[0].startswith(f"one: {sys.executable}")


def test_an_option_may_stand_between_the_file_and_its_arguments(up):
    launch = """\
        launch:
        - arg: {{name: word, default: left}}
        - executable: {{cmd: "{waiting} $(var word)", name: one}}
        """
    process = up(launch, "--print", "word:=right", scripts={"waiting": WAITING})

    assert process.wait() == 0
    assert process.output.endswith("waiting.py right\n")


def test_a_bad_launch_file_is_one_line_and_exit_code_1(up):
    process = up("launch: [nodes: {{}}]")

    assert process.wait() == 1
    assert process.output.startswith("error: ")
    assert len(process.output.splitlines()) == 1


def test_help_and_arguments_are_shown(up):
    process = up(
        'launch: [arg: {{name: side, default: left, description: "which one"}}]', "--show-args"
    )

    assert process.wait() == 0
    assert process.output == "side:=  (default: 'left')\n    which one\n"


def test_a_process_that_fails_in_stopping_is_a_failure(up):
    process = up(
        'launch: [executable: {{cmd: "{failing}"}}]',
        scripts={
            "failing": """\
            import sys, time
            try:
                print("ready", flush=True)
                time.sleep(600)
            except KeyboardInterrupt:
                sys.exit("cannot save")
            """
        },
    )
    process.wait_for_output("ready")

    assert process.stop() == 1
    assert "cannot save" in process.output


def test_a_program_interrupted_before_it_can_heed_it_is_no_failure(up):
    process = up(
        'launch: [executable: {{cmd: "{starting}"}}]',
        scripts={
            "starting": """\
            import os, sys, time, traceback
            try:
                print("ready", flush=True)
                time.sleep(600)
            except KeyboardInterrupt:
                traceback.print_exc()  # as Python does while it still imports
                os._exit(1)
            """
        },
    )
    process.wait_for_output("ready")

    assert process.stop() == 0
    assert "Traceback" not in process.output
    assert "interrupted while it started" in process.output


def test_a_traceback_in_stopping_that_is_no_interruption_is_shown(up):
    process = up(
        'launch: [executable: {{cmd: "{failing}"}}]',
        scripts={
            "failing": """\
            import time
            try:
                print("ready", flush=True)
                time.sleep(600)
            finally:
                raise ValueError("no good") from None
            """
        },
    )
    process.wait_for_output("ready")

    assert process.stop() == 1
    assert "ValueError: no good" in process.output

import io
import os
import signal
import socket
import sys
from argparse import Namespace
from pathlib import Path

import pytest
from rich.console import Console

from pose_core.errors import InputError
from pose_fusion import own_domain
from pose_fusion.launched_graph import GraphError, LaunchedGraph
from pose_fusion.tools import demo, demo_run
from pose_fusion.tools.demo_run import describe
from pose_node.child_process import executable, run_to_end, start, stop
from pose_node.node_status import Level, NodeStatus


def options(**given):
    values = {"output": None, "recording": None, "motion": None, "choreography": "squats"}
    return Namespace(**{**values, **given})


def python(code):
    return [sys.executable, "-c", code]


def test_the_default_folder_is_the_first_free_name_under_out(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = []
    for _ in range(3):
        folder = demo._output_folder(options())
        folder.mkdir(parents=True)
        names.append(str(folder))
    assert names == ["out/demo-squats", "out/demo-squats-2", "out/demo-squats-3"]


def test_a_recording_s_folder_is_named_after_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = Path("/data/Study_10.v2.csv.gz")
    assert demo._output_folder(options(recording=recording)) == Path("out/demo-Study_10.v2")


def test_an_existing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="exists already"):
        demo._output_folder(options(output=tmp_path))


@pytest.mark.parametrize("words", [["--duration", "0"], ["--duration", "nan"], ["--rate", "-1"]])
def test_invalid_durations_and_rates_are_refused(words, capsys):
    with pytest.raises(SystemExit):
        demo._parser().parse_args(words)
    assert "is not greater than 0" in capsys.readouterr().err


def test_a_session_that_takes_longer_to_generate_starts_later(tmp_path, monkeypatch):
    now_ns = [0]
    started = []
    monkeypatch.setattr(demo.time, "time_ns", lambda: now_ns[0])
    monkeypatch.setattr(demo.time, "monotonic", lambda: now_ns[0] * 1e-9)
    monkeypatch.setattr(demo, "executable", lambda package, name: Path(package) / name)

    def make_slowly(command):
        started.append(int(command[command.index("--start-at") + 1]))
        Path(command[-1]).mkdir()
        now_ns[0] += 20 * 10**9

    monkeypatch.setattr(demo, "run_to_end", make_slowly)
    given = options(choreography="squats", seed=1)
    start_at_ns = demo._generate(given, 30.0, tmp_path / "session", 5.0)
    assert len(started) == 2
    assert start_at_ns == started[-1]
    assert start_at_ns - now_ns[0] >= 4 * 10**9


def test_the_error_of_a_failing_tool_is_its_last_line():
    code = "import sys; print('noise', file=sys.stderr); sys.exit('error: no such thing')"
    with pytest.raises(InputError) as caught:
        run_to_end(python(code))
    assert str(caught.value) == "no such thing"


def test_a_tool_s_output_is_returned():
    assert run_to_end(python("print('hello')")) == "hello\n"


def test_a_missing_executable_says_to_build():
    with pytest.raises(InputError, match=r"build (the|and source its) workspace"):
        executable("pose_launch", "no_such_thing")
    with pytest.raises(InputError, match=r"build (the|and source its) workspace"):
        executable("no_such_package", "up")


def test_a_process_that_handles_the_interrupt_is_not_killed():
    process = start(python("import time; print(flush=True); time.sleep(60)"))
    assert stop(process) != -signal.SIGKILL


def test_a_process_that_ignores_the_interrupt_is_killed():
    code = (
        "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); "
        "print('ready', flush=True); time.sleep(60)"
    )
    reading, writing = os.pipe()
    process = start(python(code), stdout=writing)
    os.read(reading, 5)
    assert stop(process, patience_s=0.1) == -signal.SIGKILL
    os.close(reading)
    os.close(writing)


def test_a_count_that_a_node_does_not_report_is_zero():
    node = NodeStatus(name="/kinect_left", values={"frames_published": "12", "file": "a.csv"})
    assert [node.count(name) for name in ("frames_published", "file", "other")] == [12, 0, 0]


def test_before_the_first_frame_progress_lists_the_running_nodes():
    assert describe({"/fusion": NodeStatus(name="/fusion")}, -2.0, 10.0) == (
        "starting, 1 nodes are up",
        "",
    )


def test_progress_counts_frames_in_and_joint_states_out():
    nodes = {
        "/kinect_left": NodeStatus(name="/kinect_left", values={"frames_published": "30"}),
        "/kinect_right": NodeStatus(name="/kinect_right", values={"frames_published": "31"}),
        "/fusion": NodeStatus(name="/fusion", values={"estimates": "25"}),
    }
    assert describe(nodes, 1.0, 10.0) == (
        "running",
        "frames in 61, joint states out 25, warnings 0",
    )


def test_progress_shows_warnings_of_nodes():
    nodes = {"/fusion": NodeStatus(name="/fusion", level=Level.WARN, message="no extrinsics yet")}
    _, counts = describe(nodes, 1.0, 10.0)
    assert counts.endswith("warnings 1 (fusion: no extrinsics yet)")


@pytest.mark.parametrize(
    ("log", "told"),
    [
        ("[up] starting\n[a] error: bad rate\n[up] a has died (exit code 1)\n", "bad rate"),
        ("[up] starting\n[a] Traceback\n[a] ValueError: x\n[up] a has died\n", "ValueError: x"),
        ("[up] starting\n[up] a has died (signal SIGSEGV)\n[b] bye\n", "a has died"),
        ("", "it said nothing"),
    ],
)
def test_a_failed_graph_is_reported_by_its_most_severe_line(tmp_path, log, told):
    graph = LaunchedGraph("demo.launch.yaml", {}, tmp_path / "graph.log")
    error = graph._error("the graph failed", log)
    assert isinstance(error, GraphError)
    assert told in str(error)
    assert "\n" not in str(error)
    assert "graph.log" in str(error)


def test_devices_silent_after_the_end_cause_no_warning():
    nodes = {
        "/imu_bridge": NodeStatus(
            name="/imu_bridge", level=Level.ERROR, message="the port was lost"
        )
    }
    assert describe(nodes, 11.0, 10.0) == (
        "stopping",
        "frames in 0, joint states out 0, warnings 0",
    )


class GraphOfTwo:
    """A graph whose nodes come up one after another, on a clock of its own."""

    def __init__(self, clock, up_after_s):
        self._clock = clock
        self._up_after_s = up_after_s
        self._begin_ns = clock.now_ns

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def planned_nodes(self):
        return list(self._up_after_s)

    def check(self):
        pass

    @property
    def nodes(self):
        passed_s = (self._clock.now_ns - self._begin_ns) * 1e-9
        return {
            f"/{n}": NodeStatus(name=f"/{n}") for n, s in self._up_after_s.items() if s <= passed_s
        }


class Clock:
    now_ns = 10**18

    def time_ns(self):
        return self.now_ns

    def sleep(self, seconds):
        self.now_ns += round(seconds * 1e9)


@pytest.fixture
def start_two(tmp_path, monkeypatch):
    """Start a graph of two nodes that take so long; the leads that were tried, and the output."""

    def start_two(lead_s, **up_after_s):
        clock, leads, output = Clock(), [], io.StringIO()
        monkeypatch.setattr(demo_run, "time", clock)
        monkeypatch.setattr(demo_run, "LaunchedGraph", lambda *_: GraphOfTwo(clock, up_after_s))

        def warm_up(lead_s):
            leads.append(lead_s)
            return clock.now_ns + round(lead_s * 1e9), {}

        console = Console(file=output)
        started = demo_run.started_graph("x", warm_up, tmp_path, lead_s, console)
        with started as (_, start_at_ns):
            return leads, (start_at_ns - clock.now_ns) * 1e-9, output.getvalue()

    return start_two


def test_the_input_starts_once_every_node_is_running(start_two):
    leads, left_s, output = start_two(8.0, fusion=2.0, recorder=3.0)
    assert leads == [8.0]
    assert left_s == pytest.approx(5.0, abs=0.2)
    assert output == ""


def test_a_slow_machine_gets_twice_the_time(start_two):
    leads, left_s, output = start_two(8.0, fusion=2.0, recorder=9.0)
    assert leads == [8.0, 16.0]
    assert left_s >= 1.0
    assert "recorder: not up yet; starting again, with 16 s" in output


def test_the_input_starts_after_a_minute_and_missing_nodes_are_reported(start_two):
    leads, _, output = start_two(20.0, fusion=2.0, recorder=1e9)
    assert leads == [20.0, 40.0, 60.0]
    assert "not up when the input begins: recorder" in output


def test_the_graph_s_own_nodes_are_waited_for(tmp_path):
    graph = LaunchedGraph("capture.launch.yaml", {"recording": "r.csv"}, tmp_path / "graph.log")
    expected = {"calibration", "fusion", "kinect_left", "kinect_right", "recorder"}
    assert expected <= set(graph.planned_nodes())


def test_the_demo_runs_in_a_free_domain_of_its_own_and_prints_it(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    monkeypatch.setattr(own_domain.os, "getpid", lambda: 41)
    monkeypatch.setattr(own_domain, "_is_free", lambda domain: domain != 42)
    printed = io.StringIO()
    own_domain.use_own_domain(Console(file=printed, width=200))
    assert os.environ["ROS_DOMAIN_ID"] == "43"
    assert "export ROS_DOMAIN_ID=43" in printed.getvalue()


def test_a_domain_in_which_somebody_listens_is_not_free():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        domain = next(d for d in range(1, 101) if own_domain._is_free(d))
        other.bind(("", 7400 + 250 * domain))
        assert not own_domain._is_free(domain)


def test_a_domain_that_is_set_is_kept(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    own_domain.use_own_domain(Console(quiet=True))
    assert os.environ["ROS_DOMAIN_ID"] == "7"

"""What tests with live nodes and real processes share.

Every worker of every test run has ROS domains to itself, on the loopback alone:

- ``ros_domain_id``: the number that a module's nodes and processes talk on (set for every test).
- ``ros_context``: an initialised rclpy with an executor, see :class:`RosContext`.
- ``spin_until(condition, what="")``: spins ``ros_context`` until it holds.
- ``start_process(command)``: a real process, gone after the test, see :class:`StartedProcess`;
  ``start_module_process`` where a module's tests look at the same run.
- ``shared_data``: the public recordings beside the checkout, or a skip.
- ``browser``: a headless Chromium that reaches this machine alone, or a skip; see
  :class:`browser.LocalBrowser`.
"""

import contextlib
import gc
import os
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psutil
import pytest
from checked_kernels import check_settled_kernels
from patience import PATIENCE_S, POLL_S, wait_until

if TYPE_CHECKING:
    from browser import LocalBrowser
    from rclpy.executors import Executor
    from rclpy.node import Node

ROOT = Path(__file__).resolve().parents[1]
DOMAINS = range(1, 102)
"""Above 101 the ports of a domain reach into Linux's ephemeral range."""

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell's background job ignores SIGINT, and so would every process that tests start.
    signal.signal(signal.SIGINT, signal.default_int_handler)
ORPHANS_S = 10.0  # for what a process that has ended leaves behind to end, too
PROCESS_MARK = "POSE_TEST_PROCESS"

check_settled_kernels()
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.pop("ROS_STATIC_PEERS", None)
os.environ["XDG_STATE_HOME"] = os.path.join(tempfile.gettempdir(), f"pose-test-state-{os.getuid()}")
LIBRARY_PATH = os.environ.get("LD_LIBRARY_PATH")


@pytest.fixture(autouse=True)
def kept_library_path() -> None:
    """Processes that a test starts find ROS's libraries, whatever a library set before them."""
    if LIBRARY_PATH is not None:
        os.environ["LD_LIBRARY_PATH"] = LIBRARY_PATH


# -- domains ------------------------------------------------------------------------------------


def claim_domain() -> tuple[int, socket.socket]:
    """Claim a domain that no other test of this machine uses.

    The claim is an abstract socket, so it ends with the process, however that ends, and holds
    just as far as the network that the domain's ports live in.
    """
    for domain in random.SystemRandom().sample(DOMAINS, len(DOMAINS)):
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f"\0pose-fusion-test-domain-{domain}")
        except OSError:
            claim.close()
        else:
            return domain, claim
    raise RuntimeError(f"all {len(DOMAINS)} ROS domains are in use by other tests")


@pytest.fixture(scope="module", autouse=True)
def ros_domain_id() -> Iterator[int]:
    """The ROS domain of this module's tests, in the environment too."""
    domain, claim = claim_domain()
    before = os.environ.get("ROS_DOMAIN_ID")
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    yield domain
    if "rclpy" in sys.modules:
        gc.collect()  # a node in a cycle of references would be seen by this domain's next tests
    claim.close()
    if before is None:
        del os.environ["ROS_DOMAIN_ID"]
    else:
        os.environ["ROS_DOMAIN_ID"] = before


# -- nodes in this process ----------------------------------------------------------------------


class RosContext:
    """An initialised rclpy (its default context) with an executor for the nodes under test."""

    def __init__(self, executor: "Executor", domain_id: int) -> None:
        self.executor = executor
        self.domain_id = domain_id
        self._nodes: list[Node] = []

    def add(self, node: "Node") -> "Node":
        """Spin this node too, and destroy it after the test."""
        self._nodes.append(node)
        self.executor.add_node(node)
        return node

    def make_node(self, name: str = "test_node", **options: Any) -> "Node":
        """A plain node for the test's own publishers and subscriptions."""
        from rclpy.node import Node

        return self.add(Node(name, **options))

    def collect(
        self, message_type: Any, topic: str, qos: Any = 10, node: "Node | None" = None
    ) -> list[Any]:
        """Subscribe; the list that the received messages are appended to."""
        received: list[Any] = []
        node = node or self.make_node(f"collector_{uuid.uuid4().hex[:8]}")
        node.create_subscription(message_type, topic, received.append, qos)
        return received

    def spin_until(
        self, condition: Callable[[], Any], timeout_s: float = PATIENCE_S, what: str = ""
    ) -> None:
        """Spin until the condition holds; an AssertionError after the deadline."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                raise AssertionError(f"spun {timeout_s:g} s in vain for {what or 'the condition'}")
            self.executor.spin_once(timeout_sec=POLL_S)

    def close(self) -> None:
        """Destroy the nodes."""
        for node in self._nodes:
            self.executor.remove_node(node)
            node.destroy_node()
        self.executor.shutdown()


@pytest.fixture
def ros_context(ros_domain_id: int) -> Iterator[RosContext]:
    """Rclpy, initialised on this module's domain, with an executor."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    rclpy.init(args=[], domain_id=ros_domain_id)
    context = RosContext(SingleThreadedExecutor(), ros_domain_id)
    try:
        yield context
    finally:
        context.close()
        rclpy.try_shutdown()


@pytest.fixture
def spin_until(ros_context: RosContext) -> Callable[..., None]:
    """``spin_until(condition, what="")`` on ``ros_context``."""
    return ros_context.spin_until


# -- real processes -----------------------------------------------------------------------------


class StartedProcess:
    """A process in a session of its own; stdout and stderr together go to ``log``."""

    def __init__(
        self, command: Sequence[str], log: Path, env: Mapping[str, str], cwd: Path | None
    ) -> None:
        self.command = list(command)
        self._log = log
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                self.command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=dict(env),
                cwd=cwd,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """The process's id, and its process group's."""
        return self._process.pid

    @property
    def output(self) -> str:
        """What it has printed so far."""
        return self._log.read_text(errors="replace")

    @property
    def returncode(self) -> int | None:
        """The exit code, negative for a signal; None while it runs."""
        return self._process.poll()

    def wait(self, timeout_s: float = PATIENCE_S) -> int:
        """Wait for its end; the exit code."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(
                f"still running after {timeout_s:g} s: {self.describe()}"
            ) from None

    def wait_for_output(self, pattern: str, timeout_s: float = PATIENCE_S) -> re.Match[str]:
        """Wait until a regular expression matches the output."""
        match: re.Match[str] | None = None

        def found() -> bool:
            nonlocal match
            ended = self.returncode is not None
            match = re.search(pattern, self.output, re.MULTILINE)
            if match is None and ended:
                raise AssertionError(f"ended before it printed {pattern!r}: {self.describe()}")
            return match is not None

        try:
            wait_until(found, timeout_s, f"output {pattern!r}")
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.describe()}") from None
        assert match is not None
        return match

    def signal(self, number: int = signal.SIGINT, group: bool = False) -> None:
        """Send a signal to it, or to its whole group as a terminal does."""
        with contextlib.suppress(ProcessLookupError):
            (os.killpg if group else os.kill)(self.pid, number)

    def stop(self, timeout_s: float = PATIENCE_S) -> int:
        """Interrupt it as Ctrl-C does and wait for its end; the exit code."""
        if self.returncode is None:
            self.signal(signal.SIGINT)
        return self.wait(timeout_s)

    def describe(self) -> str:
        """Command, exit code and output."""
        return (
            f"{' '.join(self.command)} (pid {self.pid}, exit code {self.returncode})\n"
            f"{self.output or '(no output)'}"
        )


def marked_processes(mark: str) -> list[psutil.Process]:
    """Every living process that was started, however indirectly, under a mark."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if (
                process.environ().get(PROCESS_MARK) == mark
                and process.status() != psutil.STATUS_ZOMBIE
            ):
                found.append(process)
    return found


class ProcessStarter:
    """Starts processes and knows all that came of them.

    Calling it starts one: ``start_process(["./pose", "up", …], env={…}, cwd=…)``.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._mark = uuid.uuid4().hex
        self.processes: list[StartedProcess] = []

    def __call__(
        self,
        command: Sequence[str | Path],
        *,
        env: Mapping[str, str] | None = None,
        cwd: Path | None = None,
    ) -> StartedProcess:
        """Start a process; ``env`` is added to this process's environment."""
        words = [str(word) for word in command]
        name = f"process_{len(self.processes)}_{Path(words[0]).name}.log"
        environment = {**os.environ, **(env or {}), PROCESS_MARK: self._mark}
        environment.setdefault("PYTHONUNBUFFERED", "1")
        process = StartedProcess(words, self._folder / name, environment, cwd)
        self.processes.append(process)
        return process

    def living(self) -> list[psutil.Process]:
        """Every living process that came of the started ones, orphans included."""
        return marked_processes(self._mark)

    def close(self, orphans_s: float = ORPHANS_S) -> list[str]:
        """End everything; what had to be killed."""
        for process in self.processes:
            if process.returncode is None:
                process.signal(signal.SIGINT)
        with contextlib.suppress(AssertionError):
            wait_until(lambda: None not in [p.returncode for p in self.processes])
        complaints = [
            f"did not end on SIGINT: {' '.join(process.command)}"
            for process in self.processes
            if process.returncode is None
        ]
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not self.living(), orphans_s)
        for orphan in self.living():
            with contextlib.suppress(psutil.Error):
                complaints.append(f"left running: pid {orphan.pid}, {' '.join(orphan.cmdline())}")
                orphan.kill()
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not self.living(), ORPHANS_S)  # the killed take a moment to go
        for process in self.processes:
            with contextlib.suppress(AssertionError):
                process.wait(ORPHANS_S)
        return complaints


def run_starter(folder: Path) -> Iterator[ProcessStarter]:
    """A starter whose processes are ended after use; one left running is a failure."""
    starter = ProcessStarter(folder)
    yield starter
    complaints = starter.close()
    for process in starter.processes:
        sys.stdout.write(f"----- {process.describe()}\n")  # pytest shows it if the test failed
    if complaints:
        outputs = "\n".join(process.describe() for process in starter.processes)
        pytest.fail("\n".join([*complaints, outputs]), pytrace=False)


@pytest.fixture
def start_process(tmp_path: Path, ros_domain_id: int) -> Iterator[ProcessStarter]:
    """Start real processes; a test that leaves one running fails, with everyone's output."""
    yield from run_starter(tmp_path)


@pytest.fixture(scope="module")
def start_module_process(
    tmp_path_factory: pytest.TempPathFactory, ros_domain_id: int
) -> Iterator[ProcessStarter]:
    """Like ``start_process``, for a run that all tests of a module look at.

    Mark such a module with ``pytest.mark.xdist_group``, so that one worker has all of it;
    a module that runs a whole graph with ``live_graph``: two of these at once are too much for
    two cores, and their nodes fall behind.
    """
    yield from run_starter(tmp_path_factory.mktemp("processes"))


# -- data ---------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of public recordings beside the checkout."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"needs the public recordings in ../shared/data: found no {folder}")
    return folder


# -- pages --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """The browser's process; a module's own, since Playwright keeps an event loop meanwhile."""
    from browser import find_browser, start_browser
    from playwright.sync_api import sync_playwright

    executable = find_browser()
    if executable is None:
        reason = "found no Chromium: run scripts/install_browser.sh as root, or set POSE_BROWSER"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    with sync_playwright() as playwright:
        started = start_browser(playwright.chromium, executable)
        yield started
        started.close()


@pytest.fixture
def browser(chromium: Any) -> "Iterator[LocalBrowser]":
    """Opens pages: ``page = browser.open("http://127.0.0.1:…")``, then Playwright's ``Page``."""
    from browser import LocalBrowser

    local = LocalBrowser(chromium)
    yield local
    local.close()

"""Measures the frame rate of the live page in browsers; run by ``measure_viewer.sh``."""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from browser import LocalBrowser, find_browser, start_browser
from playwright.sync_api import Page, sync_playwright
from rich.console import Console
from rich.table import Table
from viewed_graph import Session, executable, serving, viewed_graph

BEGIN_S = 20.0  # [s] into the session, when cameras and IMUs are calibrated
SLOWEST_S = 30.0  # [s] for opening pages
SETTLE_S = 4.0  # [s] until a page has drawn its first frames
SLOW_MS = 60_000  # [ms] time limit without a graphics card

# viser receives in a worker and hands batches of messages to the page, which draws on demand.
COUNT = """
window.received = []; window.drawn = [];
const Plain = window.Worker;
window.Worker = class extends Plain {
  constructor(...words) {
    super(...words);
    this.addEventListener("message", ({data}) => {
      if (data.type === "message_batch" && data.messages.some(
            (m) => m.type === "SetPositionMessage" && m.name.startsWith("/bodies/")))
        window.received.push(performance.now());
    });
  }
};
const gl = WebGL2RenderingContext.prototype;
for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
  const draw = gl[name];
  gl[name] = function (...words) {
    const frame = document.timeline.currentTime;
    if (window.drawn.at(-1) !== frame) window.drawn.push(frame);
    if (RASTER) draw.apply(this, words);
  };
}
"""


@dataclass(frozen=True, kw_only=True)
class Cadence:
    """Regularity of events."""

    rate_hz: float
    p50_ms: float  # of the intervals
    p99_ms: float
    longest_ms: float

    @classmethod
    def of(cls, times_ms: Sequence[float]) -> "Cadence":
        """Compute from times [ms], ascending."""
        if len(times_ms) < 3:
            return cls(rate_hz=0.0, p50_ms=np.inf, p99_ms=np.inf, longest_ms=np.inf)
        gaps = np.diff(times_ms)
        p50, p99 = np.percentile(gaps, (50, 99))
        return cls(
            rate_hz=1e3 * len(gaps) / float(np.sum(gaps)),
            p50_ms=float(p50),
            p99_ms=float(p99),
            longest_ms=float(np.max(gaps)),
        )


@dataclass(frozen=True, kw_only=True)
class LookedAt:
    """A running viewer.

    Attributes:
        address: Address of its page.
        processes: Its process and its children.
    """

    address: str
    processes: tuple[int, ...]


def main() -> None:
    """Measure, and print a table."""
    options = _parser().parse_args()
    chromium = find_browser()
    if chromium is None:
        sys.exit("error: found no Chromium: run scripts/install_browser.sh, or set POSE_BROWSER")
    console = Console(width=None if sys.stdout.isatty() else 120)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        browser = LocalBrowser(start_browser(playwright.chromium, chromium))
        run = _live(options, Path(name)) if options.bag is None else _played(options.bag)
        with run as looked_at:
            rows = [
                (count, _measure(looked_at, browser, count, options))
                for count in (0, *options.browsers)
            ]
    console.print(_table(rows))
    if options.output:
        options.output.write_text(json.dumps(dict(rows), default=vars, indent=1))


@contextmanager
def _live(options: argparse.Namespace, folder: Path) -> Iterator[LookedAt]:
    """The synthetic subject's devices and the whole graph, once everything is calibrated."""
    session = Session(
        choreography=options.choreography,
        seed=options.seed,
        duration_s=BEGIN_S + (options.seconds + SLOWEST_S) * (1 + len(options.browsers)),
    )
    with viewed_graph(session, folder) as graph:
        time.sleep(graph.left_s(BEGIN_S))
        yield LookedAt(address=graph.address, processes=(graph.process.pid,))


@contextmanager
def _played(bag: Path) -> Iterator[LookedAt]:
    """The viewer, with a recording of all three bodies played to it."""
    viewer = [executable("pose_view", "viewer"), "--ros-args", "-p", "port:=0"]
    play = [str(executable("pose_fusion", "player")), str(bag), "--loop"]
    with serving(viewer) as (process, address), subprocess.Popen(play) as player:
        try:
            yield LookedAt(address=address, processes=(process.pid, player.pid))
        finally:
            player.send_signal(signal.SIGINT)


def _measure(
    graph: LookedAt, browser: LocalBrowser, count: int, options: argparse.Namespace
) -> dict[str, Any]:
    """Measure what ``count`` pages receive and draw, and the CPU time of the graph's processes."""
    pages = [_open(browser, graph.address, options) for _ in range(count)]
    for page in pages:
        page.wait_for_function("window.received.length > 0", timeout=SLOW_MS)
    _wait(pages, SETTLE_S)
    for page in pages:
        page.evaluate("window.received.length = window.drawn.length = 0")
    before, machine_before, begun_s = _cpu_s(graph), psutil.cpu_times(), time.monotonic()
    _wait(pages, options.seconds)
    after, machine, spent_s = _cpu_s(graph), psutil.cpu_times(), time.monotonic() - begun_s
    found = {
        "cpu": {name: 100.0 * (after[name] - before.get(name, 0.0)) / spent_s for name in after},
        "idle": 100.0 * (machine.idle - machine_before.idle) / spent_s,
        "received": [Cadence.of(page.evaluate("window.received")) for page in pages],
        "drawn": [Cadence.of(page.evaluate("window.drawn")) for page in pages],
    }
    browser.close()
    return found


def _open(browser: LocalBrowser, address: str, options: argparse.Namespace) -> Page:
    page = browser.open("about:blank", width=options.size[0], height=options.size[1])
    raster = "true" if options.raster else "false"
    page.add_init_script(COUNT.replace("RASTER", raster))
    page.goto(address)
    page.wait_for_selector("canvas", timeout=SLOW_MS)
    return page


def _wait(pages: Sequence[Page], seconds: float) -> None:
    """Wait while the browser's driver processes events."""
    if pages:
        pages[0].wait_for_timeout(1e3 * seconds)
    else:
        time.sleep(seconds)


def _cpu_s(graph: LookedAt) -> dict[str, float]:
    """CPU time [s] of each process, by the node's name."""
    spent: dict[str, float] = {}
    for root in map(psutil.Process, graph.processes):
        for process in (root, *root.children(recursive=True)):
            words = process.cmdline()
            named = [word for word in words if word.startswith("__node:=")]
            name = named[0].removeprefix("__node:=") if named else Path(words[1]).name
            times = process.cpu_times()
            spent[name] = times.user + times.system
    return spent


def _table(rows: Sequence[tuple[int, Mapping[str, Any]]]) -> Table:
    table = Table(title="The live page, by browsers that look at once")
    table.add_column("browsers", justify="right")
    for what in ("updates received", "pictures drawn"):
        table.add_column(f"{what} [Hz]", justify="right")
        table.add_column("gaps p50, p99, longest [ms]", justify="right")
    for what in ("CPU of the viewer", "of the other nodes", "idle"):
        table.add_column(f"{what} [% of a core]", justify="right")
    for count, found in rows:
        cpu = dict(found["cpu"])
        viewer = cpu.pop("viewer")
        table.add_row(
            str(count),
            *_cadence(found["received"]),
            *_cadence(found["drawn"]),
            f"{viewer:.1f}",
            f"{sum(cpu.values()):.0f}",
            f"{found['idle']:.0f}",
        )
    table.caption = "of several browsers, the worst"
    return table


def _cadence(each: Sequence[Cadence]) -> tuple[str, str]:
    """Cells of the slowest browser."""
    if not each:
        return "–", "–"
    worst = max(each, key=lambda cadence: cadence.p99_ms)
    gaps = f"{worst.p50_ms:.0f}, {worst.p99_ms:.0f}, {worst.longest_ms:.0f}"
    return f"{worst.rate_hz:.1f}", gaps


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="measure_viewer", description="Measure whether the live page runs smoothly."
    )
    parser.add_argument(
        "--bag",
        type=Path,
        help="play this recording of three bodies to the viewer alone, on machines that are too"
        " slow for the whole graph and a browser",
    )
    parser.add_argument(
        "--browsers", type=int, nargs="+", default=[1, 3], help="how many look at once"
    )
    parser.add_argument("--seconds", type=float, default=15.0, help="of each measurement")
    parser.add_argument(
        "--size",
        type=int,
        nargs=2,
        default=(800, 400),
        metavar=("WIDTH", "HEIGHT"),
        help="of a page [px]; large ones are slow to fill without a graphics card",
    )
    parser.add_argument(
        "--raster",
        action="store_true",
        help="also let the browsers fill the pixels; without a graphics card, that is what is"
        " measured then",
    )
    parser.add_argument("--choreography", default="arm_raises", help="what the subject does")
    parser.add_argument("--seed", type=int, default=3, help="of the synthetic subject")
    parser.add_argument("-o", "--output", type=Path, help="also write the numbers, as JSON")
    return parser


if __name__ == "__main__":
    main()

"""Takes screenshots of the viewer for the documentation; run by ``take_screenshots.sh``."""

import argparse
import io
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from browser import LocalBrowser, find_browser, start_browser
from PIL import Image
from playwright.sync_api import Page, sync_playwright
from viewed_graph import Session, executable, serving, viewed_graph

LIVE_AT_S = 33.0  # [s] earliest time of the live screenshot in the session
DURATION_S = 70.0  # [s] duration of the recorded session
MAX_DURATION_S = 200.0  # [s] for a screenshot on a slow machine
SIZE = {"width": 1440, "height": 800}
SLOW_MS = 120_000  # [ms] time limit without a graphics card


def main() -> None:
    """Take the screenshots."""
    options = _parser().parse_args()
    chromium = find_browser()
    if chromium is None:
        sys.exit("error: found no Chromium: run scripts/install_browser.sh, or set POSE_BROWSER")
    options.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        browser = LocalBrowser(start_browser(playwright.chromium, chromium))
        if options.report is not None:
            _save_angles(browser, options.report, options.output / "report_angles.png")
            return
        bag = options.bag or _run_graph(options, folder, browser)
        with serving([executable("pose_view", "view"), bag, "--port", "0"]) as (_, address):
            page = _open(browser, address)
            _show_recording(page, options.at)
            _save(page, options.output / "viewer_recording.png")


def _run_graph(options: argparse.Namespace, folder: Path, browser: LocalBrowser) -> Path:
    """Take the live screenshot; record another run, without a browser's load."""
    session = Session(choreography=options.choreography, seed=options.seed, duration_s=DURATION_S)
    longer = replace(session, duration_s=MAX_DURATION_S)
    with viewed_graph(longer, folder / "live", "record:=false") as graph:
        page = _open(browser, graph.address)
        page.wait_for_timeout(1e3 * graph.left_s(LIVE_AT_S))
        _save(page, options.output / "viewer_live.png")
        page.close()
    with viewed_graph(session, folder / "recorded") as graph:
        time.sleep(graph.left_s(DURATION_S))
    return graph.bag


def _show_recording(page: Page, at: float) -> None:
    """Pause within the recording, with the raw skeletons drawn."""
    page.get_by_role("button", name="Pause").click(timeout=SLOW_MS)
    page.get_by_text("Raw skeletons").locator("xpath=../../..").get_by_role("checkbox").check(
        timeout=SLOW_MS, force=True
    )
    slider = page.get_by_role("slider").first
    track = slider.locator("xpath=../..").bounding_box()
    assert track is not None
    stood_at = slider.get_attribute("aria-valuenow")
    while slider.get_attribute("aria-valuenow") == stood_at:
        x = track["x"] + at * track["width"]
        page.mouse.click(x, track["y"] + track["height"] / 2)
        page.wait_for_timeout(3000)
    page.wait_for_timeout(6000)


def _save_angles(browser: LocalBrowser, report: Path, path: Path) -> None:
    """Save the twelve angles of a report's page."""
    page = browser.open(report.absolute().as_uri(), width=1180, height=900)
    page.add_style_tag(content="fieldset { position: static !important }")
    section = page.locator("section#angles")
    picture = Image.open(io.BytesIO(section.screenshot(timeout=SLOW_MS))).convert("RGB")
    picture.save(path, optimize=True)


def _open(browser: LocalBrowser, address: str) -> Page:
    page = browser.open(address, **SIZE)
    page.wait_for_selector("canvas", timeout=SLOW_MS)
    page.locator(".mantine-Notification-closeButton").first.click(timeout=SLOW_MS)
    return page


def _save(page: Page, path: Path) -> None:
    page.mouse.move(SIZE["width"] / 2, SIZE["height"] - 5)
    picture = Image.open(io.BytesIO(page.screenshot(timeout=SLOW_MS))).convert("RGB")
    picture.save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="take_screenshots", description="Take the documentation's pictures of the viewer."
    )
    parser.add_argument("--choreography", default="arm_raises", help="what the subject does")
    parser.add_argument("--seed", type=int, default=3, help="of the synthetic subject")
    parser.add_argument(
        "--bag", type=Path, help="a recording to show; no live run and no live picture then"
    )
    parser.add_argument(
        "--report",
        type=Path,
        help="a report.html: only its angles are taken, as report_angles.png",
    )
    parser.add_argument(
        "--at", type=float, default=0.45, help="share of the recording, where it is shown"
    )
    parser.add_argument("--output", type=Path, default=Path("docs/images"), help="where to")
    return parser


if __name__ == "__main__":
    main()

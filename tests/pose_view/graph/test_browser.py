"""The viewer in a real browser: a recording that plays and scrubs, a graph that is recorded."""

import io
import re
import time
from functools import partial

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from patience import PATIENCE_S
from PIL import Image
from viewed_bag import write_viewed_bag

from pose_io.bags import open_bag

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]
VIEW = f"{get_package_prefix('pose_view')}/lib/pose_view/view"
VIEWER = f"{get_package_prefix('pose_view')}/lib/pose_view/viewer"
RECORDER = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion/recorder"
PLAYER = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion/player"
ADDRESS = r"(http://127\.0\.0\.1:\d+)"
SIZE = {"width": 1000, "height": 460}
PHONE = {"width": 390, "height": 844}
CANVAS = {"x": 280, "y": 60, "width": 370, "height": 330}  # between the panels
CHANGED = 24  # [-] of 255: more than a curve's or a shadow's edge


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("viewed") / "walk"
    write_viewed_bag(path)
    return path


def open_page(browser, process):
    page = browser.open(process.wait_for_output(ADDRESS)[1], **SIZE)
    page.wait_for_selector("canvas")
    notice = page.locator(".mantine-Notification-closeButton")  # that there is no graphics card
    notice.first.click()
    return page


def picture(page):
    data = page.screenshot(clip=CANVAS)
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), int)


def moving(first, second):
    """Changed pixels in the left, middle and right third."""
    changed = np.abs(first - second).max(axis=2) > CHANGED
    return [int(part.sum()) for part in np.array_split(changed, 3, axis=1)]


def has_moved(page, before):
    """Whether each third of the picture has changed."""
    return min(moving(before, picture(page))) > 40


def until(page, condition, what):
    """The first truthy result of a condition, asked for again and again."""
    deadline = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        assert time.monotonic() < deadline, f"waited {PATIENCE_S:g} s in vain for {what}"
        page.wait_for_timeout(100)
    return found


def shown_time(page):
    return float(page.get_by_role("slider").first.get_attribute("aria-valuenow"))


def scrub(page, share):
    """Click at a share of the slider, until it stands there."""
    slider = page.get_by_role("slider").first.locator("xpath=../..")

    def is_scrubbed():
        track = slider.bounding_box()  # the panel may still grow, and a click miss it
        page.mouse.click(track["x"] + share * track["width"], track["y"] + track["height"] / 2)
        return abs(shown_time(page) - 6.0 * share) < 0.7

    until(page, is_scrubbed, "the slider's time")


def test_a_recording_plays_pauses_and_scrubs_without_the_internet(browser, start_process, bag):
    process = start_process([VIEW, bag, "--port", "0"])
    page = open_page(browser, process)
    before = picture(page)

    until(page, partial(has_moved, page, before), "moving pixels in each place")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    until(page, lambda: moving(picture(page), picture(page)) == [0, 0, 0], "a standing picture")
    for share in (0.25, 0.75) if shown_time(page) > 3.0 else (0.75, 0.25):
        stood = picture(page)
        scrub(page, share)
        until(page, partial(has_moved, page, stood), "the bodies of another time")
        assert abs(shown_time(page) - 6.0 * share) < 0.7
    assert browser.refused == []
    assert browser.errors == []


def test_a_click_on_record_makes_a_bag_that_outlives_the_viewer(
    browser, start_process, bag, tmp_path
):
    output = tmp_path / "made"
    start_process([PLAYER, bag, "--loop"])
    recorder = start_process(
        [RECORDER, "--output", output, "--all", "--start-paused"],
    )
    process = start_process([VIEWER, "--ros-args", "-p", "port:=0"])
    page = open_page(browser, process)

    page.get_by_text("Fused").first.wait_for()
    button = page.get_by_role("button", name="Start recording")
    until(page, button.is_enabled, "a recorder")
    button.click()
    page.get_by_text(f"recording into {output}").wait_for()
    page.get_by_role("button", name="Stop recording").wait_for()
    process.signal(9)
    process.wait()
    assert recorder.returncode is None
    recorder.stop()

    assert re.search(r"recorder: \d+ messages", recorder.output)
    with open_bag(output) as made:
        assert made.topics["/humans/bodies/subject/skeleton"].count > 0
    assert browser.refused == []


def test_the_slider_spans_the_page_and_no_panel_lies_over_the_picture(browser, start_process, bag):
    process = start_process([VIEW, bag, "--port", "0"])
    page = browser.open(process.wait_for_output(ADDRESS)[1], **SIZE)
    page.wait_for_selector("canvas")
    slider = page.get_by_role("slider").first.locator("xpath=../..")
    button = page.get_by_role("button", name=re.compile("Pause|Play"))

    def is_laid_out(width, height):
        parts = slider, page.locator("canvas").first, button
        bar, picture, panel = boxes = [part.bounding_box() for part in parts]
        if None in boxes:  # while the page is laid out anew, a part may not be shown
            return False
        below = picture["y"] + picture["height"]
        beside = panel["x"] + panel["width"] <= picture["x"] or panel["y"] >= below
        return bar["width"] > 0.5 * width and below <= bar["y"] < height and beside

    for size in (SIZE, PHONE):
        page.set_viewport_size(size)
        what = f"the slider at the bottom, the panels beside or below the picture: {size}"
        until(page, partial(is_laid_out, **size), what)

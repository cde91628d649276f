"""A synthetic session's bag, and the report that the tool makes of it."""

import csv
import re
import sys
from html.parser import HTMLParser

import pytest
from session_bag import write_session, write_truth

from pose_bench.sessions import SessionSpec, bench_session
from pose_core.body.joint_angles import ANGLES
from pose_sim.captured.session import START_NS
from pose_view.tools import report

METHODS = ["left", "right", "mean", "joint_kf", "li2020"]


def run(monkeypatch, capsys, *arguments):
    """The tool in this process; exit code, what it printed."""
    monkeypatch.setattr(sys, "argv", ["report", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        report.main()
    printed = capsys.readouterr()
    return ended.value.code, printed.out + printed.err


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A bag of two virtual Kinects, and one of the truth."""
    folder = tmp_path_factory.mktemp("session")
    spec = SessionSpec(choreography="leg_lift_march", level="typical", seed=3, duration_s=32.0)
    made = bench_session(spec, imus=False)
    placed = {name: made.extrinsics.T_map_sensor(name) for name in made.extrinsics.sensors}
    march_ns = START_NS + 20 * 10**9
    samples = [sample for sample in made.skeletons if sample.stamp_ns > march_ns]
    write_session(folder / "march", samples, placed)
    write_truth(folder / "truth", made.truth)
    return folder


@pytest.fixture(scope="module")
def made(session, tmp_path_factory):
    """The report of the session beside the truth."""
    folder = tmp_path_factory.mktemp("report") / "made"
    words = [session / "march", "--reference", session / "truth", "-o", folder]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["report", *map(str, words), "--methods", *METHODS])
        with pytest.raises(SystemExit) as ended:
            report.main()
    assert ended.value.code == 0
    return folder


@pytest.fixture(scope="module")
def page(made):
    return (made / "report.html").read_text()


def rows(path):
    with path.open() as lines:
        return list(csv.DictReader(lines))


class Links(HTMLParser):
    """Everything that a page points to."""

    def __init__(self):
        super().__init__()
        self.found = []
        self.tags = []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        names = {"href", "src", "xlink:href", "srcset", "action", "poster", "data"}
        self.found += [value for name, value in attrs if name in names]


def test_the_page_points_to_nothing_but_itself(page):
    links = Links()
    links.feed(page)
    assert [link for link in links.found if not link.startswith(("#", "data:image/"))] == []
    assert "script" not in links.tags
    assert "http" not in page
    assert re.findall(r"url\((?!#)", page) == []


def test_every_link_inside_the_page_has_a_target(page):
    links = Links()
    links.feed(page)
    anchors = {link[1:] for link in links.found if link.startswith("#")}
    clips = set(re.findall(r"url\(#([^)]+)\)", page))
    assert anchors | clips <= set(re.findall(r'id="([^"]+)"', page))


def test_the_page_states_that_the_subject_is_synthetic(page):
    assert "Simulated sensors." in page
    assert "synthetic: no person, made for a test" in page


def test_the_page_has_every_part(page):
    titles = re.findall(r"<h2>([^<]+)</h2>", page)
    assert titles == [
        "Accuracy",
        "Agreement",
        "Angles over time",
        "Bland–Altman plots",
        "Range of motion and symmetry",
        "Cycles",
        "Uncertainty",
        "Sources",
        "Pitch, yaw and roll of the limbs",
        "Path of the right knee",
        "Stability",
        "How it was measured",
    ]


def test_tables_go_angle_by_angle_and_method_by_method(page):
    table = page[page.index("Error: RMSE [deg]") :]
    table = table[: table.index("</table>")]
    assert re.findall(r'<th scope="col">([^<]+)', table) == ["angle", *METHODS]
    assert re.findall(r'<th scope="row">([^<]+)', table)[: len(ANGLES)] == [
        name.replace("_", " ") for name in ANGLES
    ]
    assert table.count('class="best"') >= len(ANGLES)


def test_every_figure_has_its_units(page):
    drawings = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(drawings) > 50
    for drawing in drawings:
        assert re.search(r"\[(s|deg|%|m|cm)\]</text>", drawing), drawing[:200]
        assert 'aria-label="' in drawing


def test_the_page_stays_small(page):
    assert len(page.encode()) < 6e6


def test_the_csv_holds_the_page_s_numbers(made, page):
    found = {
        row["method"]: float(row["value"])
        for row in rows(made / "evaluation.csv")
        if (row["quantity"], row["of"]) == ("rmse", "left_knee_flexion")
    }
    table = page[page.index("Error: RMSE [deg]") :]
    line = re.search(r'<tr><th scope="row">left knee flexion</th>(.*?)</tr>', table)[1]
    assert re.findall(r">([\d.]+)<", line) == [f"{found[name]:.1f}" for name in METHODS]


def test_every_file_states_that_the_subject_is_synthetic(made):
    paths = list(made.glob("*.csv"))
    assert len(paths) == 6
    for path in paths:
        said = {row.get("subject") or row.get("reference") for row in rows(path)}
        assert said
        assert all("simulated" in text for text in said), path.name


def test_fused_bones_are_rigid_and_raw_ones_are_not(made):
    sd = {
        row["method"]: float(row["value"])
        for row in rows(made / "evaluation.csv")
        if (row["quantity"], row["of"]) == ("bone_length_sd", "left_shank")
    }
    assert sd["li2020"] < 0.1 < 3.0 < sd["left"]


def test_the_march_is_found_and_timed(made):
    found = rows(made / "cycles.csv")
    assert {row["side"] for row in found} == {"left", "right"}
    of_knee = [
        row for row in found if (row["method"], row["angle"]) == ("reference", "left_knee_flexion")
    ]
    assert [float(row["cycle_percent"]) for row in of_knee] == list(range(101))
    assert float(of_knee[0]["mean_deg"]) > 50.0 > float(of_knee[50]["mean_deg"])


def test_a_reader_on_a_phone_need_not_scroll_sideways(made, browser):
    page = browser.open((made / "report.html").as_uri(), width=380, height=800)
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    widths = page.evaluate(
        "[...document.querySelectorAll('.grid svg')].map(e => e.getBoundingClientRect().width)"
    )
    assert min(widths) > 300
    assert browser.refused == []
    assert browser.errors == []


def test_a_method_s_lines_can_be_hidden(made, browser):
    page = browser.open((made / "report.html").as_uri())
    line = page.locator("#angles .method-mean").first
    assert line.is_visible()
    page.locator("#show-method-mean").uncheck()
    assert not line.is_visible()
    hidden = page.locator("#angles .method-joint_kf").first
    assert not hidden.is_visible()
    page.locator("#show-method-joint_kf").check()
    assert hidden.is_visible()


def test_without_a_reference_methods_are_compared_with_one_another(
    session, tmp_path, monkeypatch, capsys
):
    folder = tmp_path / "alone"
    code, said = run(
        monkeypatch, capsys, session / "march", "-o", folder, "--methods", "left", "right", "mean"
    )
    assert code == 0, said
    text = (folder / "report.html").read_text()
    assert "none: methods are compared with one another" in text
    assert "Difference of the methods" in text
    assert "Bland" not in text
    assert not (folder / "evaluation.csv").exists()
    assert "Simulated sensors." in text  # the bag itself says so


def test_a_method_that_there_is_not_is_refused_in_one_line(session, tmp_path, monkeypatch, capsys):
    code, said = run(
        monkeypatch, capsys, session / "march", "-o", tmp_path / "x", "--methods", "magic"
    )
    assert code == 1
    assert re.search(
        r"(?m)^error: there is no method magic here: expected some of left, right", said
    )
    assert not (tmp_path / "x").exists()


def test_a_bad_reference_is_refused_in_one_line(session, tmp_path, monkeypatch, capsys):
    (tmp_path / "trial.c3d").write_bytes(bytes(1024))
    words = [session / "march", "--reference", tmp_path / "trial.c3d", "-o", tmp_path / "x"]
    code, said = run(monkeypatch, capsys, *words)
    assert code == 1
    assert re.fullmatch(r"error: \S+trial\.c3d is not a readable C3D file: [^\n]+\n", said)


def test_an_existing_folder_is_left_alone(session, tmp_path, monkeypatch, capsys):
    code, said = run(monkeypatch, capsys, session / "march", "-o", tmp_path)
    assert code == 1
    assert "exists already" in said

import re
from pathlib import Path

from pose_io.references.markers import CENTRE_LABELS, MEDIAL
from pose_view.tools.report import make_parser

ROOT = Path(__file__).resolve().parents[2]


def test_the_readme_names_every_option():
    text = (ROOT / "src/pose_view/README.md").read_text()
    options = {
        option
        for action in make_parser()._actions
        for option in action.option_strings
        if option.startswith("--") and option not in ("--help", "--output")
    }
    assert {option for option in options if f"`{option}" not in text} == set()


def test_every_label_that_is_understood_is_documented():
    text = (ROOT / "docs/references.md").read_text()
    documented = {re.sub(r"[^a-z0-9]", "", word.lower()) for word in re.findall(r"`([^`]+)`", text)}
    known = {
        label.format(side="left", s="l")
        for labels in (*CENTRE_LABELS.values(), *MEDIAL.values())
        for label in labels
    }
    assert known - documented == set()

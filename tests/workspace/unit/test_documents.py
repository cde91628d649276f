"""What documents say of files is true."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
DOCUMENTS = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / "src").glob("*/README.md"),
]
FILES = {
    str(path.relative_to(ROOT))
    for folder in ("src", "tests", "scripts", "docs", "examples", "requirements", "docker")
    for path in (ROOT / folder).rglob("*")
}
MODULE = re.compile(r"`([\w/]*\w\.py)`")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
# What the how-tos have one write.
NOT_YET = ("steady.py", "arrays.py", "pose_array.py", "six_shorts.py", "stick.py")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_module_named_in_a_document_exists(document):
    named = set(MODULE.findall(document.read_text()))
    gone = {
        name
        for name in named
        if not name.endswith(NOT_YET) and not any(f"/{file}".endswith(f"/{name}") for file in FILES)
    }
    assert gone == set()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_linked_in_a_document_exists(document):
    links = [link for link in LINK.findall(document.read_text()) if ":" not in link]
    assert [link for link in links if not (document.parent / link).exists()] == []

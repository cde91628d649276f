"""The browser that tests of pages share."""

from pathlib import Path

PAGE = """<!doctype html><title>t</title><p id="p">local</p>
<img src="http://example.org/picture.png">
<script>
  const gl = document.createElement("canvas").getContext("webgl2");
  document.title = gl ? "WebGL" : "none";
</script>"""


def test_the_browser_opens_files_with_webgl_and_has_no_network(browser, tmp_path: Path):
    file = tmp_path / "page.html"
    file.write_text(PAGE)

    page = browser.open(file.as_uri())

    assert page.inner_text("#p") == "local"
    assert page.title() == "WebGL"
    assert browser.refused == ["http://example.org/picture.png"]
    assert browser.errors == []

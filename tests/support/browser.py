"""A headless Chromium for tests of pages; it never reaches beyond this machine."""

import os
import shutil
from pathlib import Path
from urllib.parse import urlsplit

from patience import PATIENCE_S
from playwright.sync_api import Browser, BrowserType, Page, Route

CANDIDATES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--no-sandbox",  # it runs as root in containers
    # WebGL on the processor, on machines without a graphics card
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # Nothing but this machine has an address, for WebSockets too
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
)
LOCAL_HOSTS = ("127.0.0.1", "localhost", "::1")
LOCAL_SCHEMES = ("about", "blob", "data", "file")


def find_browser() -> Path | None:
    """The browser to use: what POSE_BROWSER names, or the first on the PATH."""
    named = os.environ.get("POSE_BROWSER")
    for candidate in (named,) if named else CANDIDATES:
        if found := shutil.which(candidate):
            return Path(found)
    return None


def start_browser(chromium: BrowserType, executable: Path) -> Browser:
    """Start it without a window."""
    return chromium.launch(executable_path=executable, args=list(OPTIONS))


class LocalBrowser:
    """Opens pages for one test, refuses requests to other machines and keeps what went wrong.

    Attributes:
        refused: Addresses on other machines that a page asked for.
        errors: Uncaught errors of the pages' scripts.
    """

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self.refused: list[str] = []
        self.errors: list[str] = []

    def open(self, address: str, *, width: int = 1200, height: int = 800) -> Page:
        """A new page, as of a new visitor, of that size in pixels."""
        context = self._browser.new_context(viewport={"width": width, "height": height})
        context.route("**/*", self._route)
        context.set_default_timeout(1e3 * PATIENCE_S)  # pictures are drawn without a graphics card
        page = context.new_page()
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(address)
        return page

    def close(self) -> None:
        """Close every page."""
        for context in self._browser.contexts:
            context.close()

    def _route(self, route: Route) -> None:
        parts = urlsplit(route.request.url)
        if parts.scheme in LOCAL_SCHEMES or parts.hostname in LOCAL_HOSTS:
            route.continue_()
        else:
            self.refused.append(route.request.url)
            route.abort()

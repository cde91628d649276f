"""Who may see the page: pages of our own on this machine; others by a token, where it is opened."""

import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
COOKIE = "pose_token"


class Guard:
    """Judges a request by what a browser cannot forge for another site's page.

    On loopback the request's Host must be a name of loopback: a name of somebody else's that
    resolves to 127.0.0.1 (DNS rebinding) is not. Beyond loopback anybody may call, so a secret must
    come with the first request; a cookie brings it with those that follow.

    Args:
        host: The address that is served.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if host in LOOPBACK else secrets.token_urlsafe(16)

    def refusal(self, path: str, headers: Mapping[str, str]) -> str | None:
        """Why a request is refused; None if it is not."""
        host, origin = headers.get("Host", ""), headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "this page is not shown to pages of other sites"
        if not self.token:
            known = _name(host) in LOOPBACK
            return None if known else f"this page is served as {', '.join(LOOPBACK)} alone"
        given = parse_qs(urlsplit(path).query).get("token", [""])[-1] or _cookie(headers)
        if secrets.compare_digest(given.encode(), self.token.encode()):
            return None
        return "a token is missing or wrong: open the address that the viewer printed"

    def cookie(self) -> str:
        """The header that keeps the token in the browser."""
        return f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"


def _name(host: str) -> str:
    """The name in a Host header, without the port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie(headers: Mapping[str, str]) -> str:
    try:
        morsel = SimpleCookie(headers.get("Cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value

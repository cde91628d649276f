"""The web server: viser's, on the user's address, with access control."""

import contextlib
import io
import secrets
import socket
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server

from pose_core.errors import PoseError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
COOKIE = "pose_token"


class Guard:
    """Checks requests by headers that a browser does not let another site's page forge.

    On the loopback address the request's Host must be a loopback name, which excludes other names
    that resolve to 127.0.0.1 (DNS rebinding). On other addresses the first request must have a
    secret token; a cookie adds it to later ones.

    Args:
        host: The server's address.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if host in LOOPBACK else secrets.token_urlsafe(16)

    def refusal(self, path: str, headers: Mapping[str, str]) -> str | None:
        """Reason to refuse a request; None if it is accepted."""
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


class LocalServer(viser.ViserServer):
    """A viser server with access control.

    A page of another site in the same browser could connect to a WebSocket on this machine, and
    everybody in the network could if the page is served there: the :class:`Guard` refuses both.
    Sharing through viser's relay is disabled.

    Args:
        host: Address to bind to.
        port: Port to bind to; the next free one if it is in use; any for 0.

    Raises:
        PoseError: If the address cannot be used.
    """

    def __init__(self, host: str, port: int) -> None:
        _check_address(host)
        self._guard = Guard(host)
        with contextlib.redirect_stdout(io.StringIO()), _guarded(self._guard):
            super().__init__(host=host, port=port, label="Pose fusion", verbose=False)

    @property
    def address(self) -> str:
        """URL of the page for a browser on this machine."""
        host = self.get_host()
        host = "127.0.0.1" if host == "0.0.0.0" else host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.get_port()}"

    @property
    def invitation(self) -> str:
        """The URL with the token, if needed: only for the user, not for topics."""
        if not self._guard.token:
            return self.address
        return f"{self.address}/?token={self._guard.token}"

    @property
    def opened(self) -> str:
        """Warning if the page can be reached from the network; otherwise empty."""
        if not self._guard.token:
            return ""
        return (
            f"the page is open to the network at host = {self.get_host()!r}, unencrypted: whoever"
            " has the token sees the person and may press the buttons"
        )

    @property
    def has_visitors(self) -> bool:
        """Whether a browser is connected."""
        return bool(self.get_clients())

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: data of the cameras are not sent to a relay on the internet."""
        return None

    def stop(self) -> None:
        """Close all connections and stop."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()


def _check_address(host: str) -> None:
    """Raise a PoseError if the address is invalid; viser would try a thousand ports."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(address)
    except OSError as error:
        raise PoseError(
            f"cannot serve pages on host = {host!r}: {error.strerror}: use 127.0.0.1 for this"
            " machine alone, 0.0.0.0 for everybody who can reach it"
        ) from error


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Check requests before viser's handler, as viser has no setting for access control."""
    serve = websockets.asyncio.server.serve

    def serve_guarded(*args: Any, process_request: Callable[..., Any], **options: Any) -> Any:
        def process(connection: Any, request: Any) -> Any:
            refusal = guard.refusal(request.path, request.headers)
            if refusal is not None:
                return connection.respond(HTTPStatus.FORBIDDEN, refusal + "\n")
            response = process_request(connection, request)
            if response is not None and guard.token:
                response.headers["Set-Cookie"] = guard.cookie()
            return response

        return serve(*args, process_request=process, **options)

    websockets.asyncio.server.serve = serve_guarded  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]

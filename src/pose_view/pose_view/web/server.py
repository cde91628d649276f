"""The web server: viser's, on the address that the user chose and for pages of its own alone."""

import contextlib
import io
import socket
from typing import Any
from urllib.parse import urlsplit

import viser

from pose_core.errors import PoseError


class LocalServer(viser.ViserServer):
    """A viser server that hands nothing to anybody else.

    A page of another site that is open in the same browser could connect to a WebSocket on this
    machine: such connections are closed. Nor can the view be shared
    through viser's relay.

    Args:
        host: Address to bind to.
        port: Port to bind to; the next free one is taken if it is in use, any for 0.
        title: Of the panel.

    Raises:
        PoseError: If nothing can be bound to the address.
    """

    def __init__(self, host: str, port: int, title: str) -> None:
        _check_address(host)
        with _quiet():
            super().__init__(host=host, port=port, label=title, verbose=False)
        self._websock_server.on_client_connect(self._refuse_other_sites)

    @property
    def address(self) -> str:
        """What to type into a browser on this machine."""
        host = self.get_host()
        host = "127.0.0.1" if host == "0.0.0.0" else host
        return (
            f"http://[{host}]:{self.get_port()}"
            if ":" in host
            else (f"http://{host}:{self.get_port()}")
        )

    @property
    def has_visitors(self) -> bool:
        """Whether a browser is looking."""
        return bool(self.get_clients())

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: what the cameras see is not sent to a relay on the internet."""
        return None

    def stop(self) -> None:
        """Close all connections and stop."""
        with _quiet():
            super().stop()

    async def _refuse_other_sites(self, connection: Any) -> None:
        # viser has no setting for it, and its connection object carries no headers.
        websocket = self._websock_server._live_connections[connection.client_id]
        assert websocket.request is not None  # the handshake is over
        headers = websocket.request.headers
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != headers.get("Host"):
            await websocket.close(1008, "a page of another site")


def _check_address(host: str) -> None:
    """Viser would try a thousand ports of an address that does not exist."""
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
def _quiet() -> Any:
    """Viser greets and parts on stdout; what matters is said in our words."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield

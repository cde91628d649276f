"""Access control of the web server."""

import http.client
import urllib.request

import pytest
import viser
import zstandard
from patience import PATIENCE_S
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from pose_core.errors import PoseError
from pose_view.web.server import LocalServer

PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture(scope="module")
def server():
    started = LocalServer("127.0.0.1", 0)
    yield started
    started.stop()


def websocket(server, origin):
    address = server.address.replace("http", "ws")
    return connect(address, subprotocols=[PROTOCOL], origin=origin, max_size=None)


def received(connection, text):
    """Whether a text arrives; messages are packed, after two lengths."""
    while True:
        data = connection.recv(timeout=PATIENCE_S)
        packed = int.from_bytes(data[8:16], "little")
        if text in zstandard.decompress(data[16 : 16 + packed]):
            return True


def test_it_serves_the_page_on_the_address_it_names(server):
    with urllib.request.urlopen(server.address, timeout=PATIENCE_S) as answer:
        assert b"<html" in answer.read()
    assert server.address.startswith("http://127.0.0.1:")


def test_its_own_page_may_connect(server):
    with websocket(server, server.address) as connection:
        assert connection.recv(timeout=PATIENCE_S)


def test_a_page_of_another_site_is_refused(server):
    with pytest.raises(InvalidStatus, match="403"):
        websocket(server, "https://example.org")


def answer(server, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=PATIENCE_S)
    connection.request("GET", path, headers=headers)
    return connection.getresponse()


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200),
        ("127.0.0.1:9000", 200),
        ("[::1]:1", 200),
        ("rebound.example.org", 403),
        ("localhost.example.org:80", 403),
        ("[", 403),
        ("", 403),
    ],
)
def test_a_foreign_host_name_is_refused(server, host, status):
    assert answer(server, Host=host).status == status


def test_a_rebound_name_gets_no_scene_even_if_its_page_is_of_the_same_name(server):
    name = f"rebound.example.org:{server.get_port()}"
    upgrade = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    assert answer(server, Host=name, Origin=f"http://{name}", **upgrade).status == 403


def test_a_public_page_requires_its_token_once_and_warns():
    opened = LocalServer("0.0.0.0", 0)
    try:
        token = opened.invitation.partition("?token=")[2]
        assert len(token) > 20
        assert token not in opened.address
        assert "open to the network" in opened.opened
        assert answer(opened).status == 403
        assert answer(opened, "/?token=wrong").status == 403
        let_in = answer(opened, f"/?token={token}", Host="anything.example.org")
        assert let_in.status == 200
        cookie = let_in.headers["Set-Cookie"]
        assert "HttpOnly" in cookie
        assert answer(opened, Cookie=cookie.partition(";")[0]).status == 200
        assert answer(opened, Cookie='pose_token="').status == 403
        with pytest.raises(InvalidStatus, match="403"):
            websocket(opened, None)
        url = f"ws://127.0.0.1:{opened.get_port()}"
        kept = {"Cookie": cookie.partition(";")[0]}
        with connect(url, subprotocols=[PROTOCOL], additional_headers=kept, max_size=None) as seen:
            assert seen.recv(timeout=PATIENCE_S)
    finally:
        opened.stop()


def test_several_browsers_see_the_same_scene_and_one_that_leaves_disturbs_none(server):
    with websocket(server, server.address) as first:
        with websocket(server, server.address) as second:
            server.scene.add_label("/early", "both see it")
            assert received(first, b"both see it")
            assert received(second, b"both see it")
        server.scene.add_label("/late", "one has left")
        assert received(first, b"one has left")


def test_nothing_is_shared_through_the_internet(server):
    assert server.request_share_url() is None


def test_an_address_that_is_none_ends_in_one_line():
    with pytest.raises(PoseError, match=r"cannot serve pages on host = '192\.0\.2\.7'.*127"):
        LocalServer("192.0.2.7", 0)


def test_a_taken_port_is_passed_over(server):
    other = LocalServer("127.0.0.1", server.get_port())
    try:
        assert other.get_port() != server.get_port()
    finally:
        other.stop()

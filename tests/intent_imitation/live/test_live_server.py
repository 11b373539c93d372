"""The page of the live view: on the loopback alone, and as a browser shows it."""

import socket
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from urllib.error import HTTPError

import cv2
import numpy as np
import pytest
from tests.intent_imitation.live.test_live_view import kept
from tests.support.browser import dom_of
from tests.support.demo_records import record

from intent_imitation.live.live_page import PAGE
from intent_imitation.live.live_server import LiveServer
from intent_perception.objects.database import ObjectDatabase


@pytest.fixture
def server() -> Iterator[LiveServer]:
    """A page that shows a grey picture and what is believed of a run."""
    run = record(ObjectDatabase.load())
    keeper = kept(run, len(run.states))
    coded = cv2.imencode(".jpg", np.full((48, 90, 3), 90, np.uint8))[1].tobytes()
    serving = LiveServer(0, lambda: coded, lambda: {**keeper.as_json(), "picture": 1})
    yield serving
    serving.close()


def status(server: LiveServer, path: str, host: str = "") -> int:
    """Return the status of an answer."""
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}")
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=5.0) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_it_listens_on_this_machine_s_own_address_alone(server: LiveServer) -> None:
    socket.create_connection(("127.0.0.1", server.port), timeout=5.0).close()
    with pytest.raises(ConnectionRefusedError):  # whoever listens everywhere listens here too
        socket.create_connection(("127.0.0.2", server.port), timeout=5.0)


@pytest.mark.parametrize(
    ("path", "host", "wanted"),
    [
        ("/", "", 200),
        ("/state.json", "localhost", 200),
        ("/", "elsewhere.example", 403),
        ("/state.json", "elsewhere.example:80", 403),
        ("/../secret", "", 404),
    ],
)
def test_only_who_asks_for_this_host_is_answered(
    server: LiveServer, path: str, host: str, wanted: int
) -> None:
    assert status(server, path, host) == wanted


def test_nobody_looks_until_somebody_asks_for_the_picture(server: LiveServer) -> None:
    assert not server.looked_at
    status(server, "/")
    assert not server.looked_at
    status(server, "/image.jpg")
    assert server.looked_at


def test_a_port_that_is_taken_is_named(server: LiveServer) -> None:
    with pytest.raises(ValueError, match=f"port {server.port} of 127.0.0.1 cannot be used"):
        LiveServer(server.port, lambda: b"", dict)


@pytest.mark.slow
def test_a_browser_shows_stage_picture_and_every_task(server: LiveServer, tmp_path: Path) -> None:
    page = dom_of(f"http://127.0.0.1:{server.port}/", tmp_path)
    assert "The hand: " in page
    assert "mug 1" in page
    assert 'src="image.jpg?1"' in page
    for task in ("pouring 0.50", "hand-over 0.20", "none of these 0.20"):
        assert f"</i>{task}</li>" in page


def test_the_page_says_that_what_is_meant_sums_to_one() -> None:
    assert 'With "none of these" the\nprobabilities of the tasks sum to one.' in PAGE

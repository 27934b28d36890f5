"""The page behind an address: who may come in, and that every tab keeps its own state."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from clbrdf.viz.serve import allowed, is_loopback
from tests.viz.browsing import comes_true

TOKEN = "correct-horse"
VIEW = (sys.executable, "-m", "clbrdf.cli", "view")


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        *((name, True) for name in ("127.0.0.1", "127.1.2.3", "::1", "localhost")),
        *((name, False) for name in ("0.0.0.0", "192.168.1.4", "example.org", "::")),
    ],
)
def test_loopback(host, loopback):
    assert is_loopback(host) is loopback


@pytest.mark.parametrize(
    ("host", "origin", "query", "token", "expected"),
    [
        ("127.0.0.1:8080", "", "", None, True),
        ("localhost:8080", "http://localhost:8080", "", None, True),
        ("[::1]:8080", "", "", None, True),
        ("127.0.0.1:8080", "http://evil.example", "", None, False),  # a web page elsewhere
        ("127.0.0.1:8080", "null", "", None, False),
        ("evil.example:8080", "", "", None, False),  # a name that was turned to this machine
        ("[broken", "", "", None, False),
        ("", "", "", None, False),
        ("10.0.0.2:8080", "", TOKEN, TOKEN, True),
        ("10.0.0.2:8080", "http://10.0.0.2:8080", TOKEN, TOKEN, True),
        ("10.0.0.2:8080", "", "", TOKEN, False),
        ("10.0.0.2:8080", "", "wrong", TOKEN, False),
        ("10.0.0.2:8080", "", "ö", TOKEN, False),
        ("10.0.0.2:8080", "http://evil.example", TOKEN, TOKEN, False),
        ("127.0.0.1:8080", "", "", TOKEN, False),
    ],
)
def test_who_may_come_in(host, origin, query, token, expected):
    assert allowed(host, origin, query, token) is expected


@pytest.fixture
def serve(foil_file):
    """Start `clbrdf view --serve` with more words; give its process and the address it prints."""
    started = []

    def start(*words):
        process = subprocess.Popen(
            [*VIEW, str(foil_file), "--serve", "--port", "0", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        line = process.stderr.readline()
        address = re.search(r"http\S+", line)
        assert address, line + process.stderr.read()
        return process, address.group()

    yield start
    for process in started:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()
        process.stderr.close()


def status(address, **headers):
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=20) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        with error:
            return error.code


def test_on_the_loopback_interface_only_unless_told_otherwise(serve):
    process, address = serve()
    assert address.startswith("http://127.0.0.1:")
    assert status(address) == 200
    assert status(address, Host="evil.example") == 403
    assert status(address, Origin="http://evil.example") == 403
    assert status(f"{address}other") == 404
    assert status(f"{address}../../etc/passwd") == 404
    port = int(re.search(r":(\d+)/", address).group(1))
    others = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for other in others - {"127.0.0.1"}:
        with socket.socket() as probe:
            probe.settimeout(2.0)
            assert other.startswith("127.") or probe.connect_ex((other, port)) != 0
    process.send_signal(signal.SIGINT)
    assert process.wait(20) in (0, 130)
    assert "Traceback" not in process.stderr.read()


def test_elsewhere_it_needs_the_token(serve):
    _, address = serve("--host", "0.0.0.0")
    plain, token = address.split("?token=")
    here = plain.replace("0.0.0.0", "127.0.0.1")
    assert len(token) >= 32
    assert status(here) == 403
    assert status(f"{here}?token=wrong") == 403
    assert status(f"{here}?token={token}") == 200
    assert status(f"{here}?token={token}", Origin="http://evil.example") == 403


def test_a_port_in_use_is_said(foil_file):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = subprocess.run(
            [*VIEW, str(foil_file), "--serve", "--port", str(port)],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"cannot listen on 127.0.0.1 port {port}" in done.stderr


def test_two_tabs_are_independent(serve, browser):
    _, address = serve("--host", "0.0.0.0", "--theta-i", "45")
    here = address.replace("0.0.0.0", "127.0.0.1")
    browser.get(f"{here}#nm=450&theta_i=30")
    first = browser.current_window_handle
    browser.switch_to.new_window("tab")
    try:
        browser.get(f"{here}#nm=650&theta_i=60")
        angle = "return clbrdf.state.thetaI"
        assert comes_true(lambda: browser.execute_script(angle) == 60)
        second = browser.current_window_handle
        browser.switch_to.window(first)
        assert browser.execute_script(angle) == 30
        assert browser.execute_script("return clbrdf.state.column") == 0
        browser.switch_to.window(second)
        assert browser.execute_script("return clbrdf.state.column") == 2
    finally:
        browser.close()
        browser.switch_to.window(first)

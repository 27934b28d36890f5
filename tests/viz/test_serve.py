"""The browser viewer: who may come in, and that it works in a real browser."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

import numpy as np
import pytest

from clbrdf.viz.serve import allowed, is_loopback
from tests.viz.test_html import coloured, picture, settled

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
    ("host", "origin", "query", "cookie", "token", "expected"),
    [
        ("127.0.0.1:8080", "", "", "", None, True),
        ("localhost:8080", "http://localhost:8080", "", "", None, True),
        ("127.0.0.1:8080", "http://evil.example", "", "", None, False),  # a web page elsewhere
        ("evil.example:8080", "", "", "", None, False),  # a name that was turned to this machine
        ("10.0.0.2:8080", "", TOKEN, "", TOKEN, True),
        ("10.0.0.2:8080", "http://10.0.0.2:8080", "", f"clbrdf_token={TOKEN}", TOKEN, True),
        ("10.0.0.2:8080", "", "", "", TOKEN, False),
        ("10.0.0.2:8080", "", "wrong", f"clbrdf_token={TOKEN}", TOKEN, False),
        ("10.0.0.2:8080", "http://evil.example", TOKEN, "", TOKEN, False),
        ("127.0.0.1:8080", "", "", "", TOKEN, False),
    ],
)
def test_who_may_come_in(host, origin, query, cookie, token, expected):
    assert allowed(host, origin, query, cookie, token) is expected


@pytest.fixture
def serve(gl, foil_file):
    """Start `clbrdf view --serve` with more words; give its process and the address it prints."""
    pytest.importorskip("trame", reason="trame is not installed (extra 'web')")
    started = []

    def start(*words):
        process = subprocess.Popen(
            [*VIEW, str(foil_file), "--serve", "--port", "0", "--size", "900x600", "--radius", "log", *words],
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
            return answer.status, answer.headers.get("Set-Cookie", "")
    except urllib.error.HTTPError as error:
        with error:
            return error.code, ""


def test_on_the_loopback_interface_only_unless_told_otherwise(serve):
    process, address = serve()
    assert address.startswith("http://127.0.0.1:")
    assert status(address)[0] == 200
    assert status(address, Host="evil.example")[0] == 403
    assert status(address.replace("index.html", "ws"), Origin="http://evil.example")[0] == 403
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
    assert status(here)[0] == 403
    assert status(f"{here}?token=wrong")[0] == 403
    code, cookie = status(f"{here}?token={token}")
    assert code == 200
    assert "HttpOnly" in cookie
    assert status(here.replace("index.html", "ws"))[0] == 403


def test_a_port_in_use_is_said(gl, foil_file):
    pytest.importorskip("trame", reason="trame is not installed (extra 'web')")
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


def comes_true(claim):
    """Whether a claim about the page comes true, given some time."""
    patience = time.monotonic() + 30.0
    while not claim():
        if time.monotonic() > patience:
            return False
        time.sleep(0.1)
    return True


def test_in_a_browser(serve, browser):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    browser.get_log("browser")
    _, address = serve("--host", "0.0.0.0")
    browser.get(address.replace("0.0.0.0", "127.0.0.1"))
    assert comes_true(lambda: len(browser.find_elements(By.CSS_SELECTOR, "[role=slider]")) == 2)
    sliders = browser.find_elements(By.CSS_SELECTOR, "[role=slider]")
    before = settled(browser, lambda image: coloured(image) > 3000)
    assert coloured(before) > 3000
    sliders[1].send_keys(Keys.END)
    below = slice(120, None)
    after = settled(browser, lambda image: (np.abs(image - before)[below].max(axis=2) > 60).sum() > 3000)
    assert (np.abs(after - before)[below].max(axis=2) > 60).sum() > 3000
    assert comes_true(lambda: "θi = 85°" in browser.page_source)
    sliders[0].send_keys(Keys.HOME)
    assert comes_true(lambda: "λ = 450 nm" in browser.page_source)
    assert picture(browser).std() > 10
    # Chromium's own remarks on its software rendering are not the page's.
    loud = [line for line in browser.get_log("browser") if line["level"] in ("SEVERE", "WARNING")]
    assert [line for line in loud if line["source"] != "rendering"] == []

"""The process: how it starts, what it refuses, how it ends; what every response carries."""

from __future__ import annotations

import http.client
import os
import signal
import socket
import sys
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import psutil
import pytest
from tests.data_sets import refused
from tests.endpoint import CLIENT, serving


def told(*arguments: object) -> str:
    """Return the one line that a server says which does not begin."""
    said = refused("serve", *arguments)
    assert said.startswith("irtwin: ") and said.count("\n") == 1
    return said


@pytest.mark.slow
def test_a_workspace_that_is_not_there(tmp_path: Path) -> None:
    assert "no graph here; run `irtwin run DATASET`" in told("--workspace", tmp_path / "none", "--port", 0)
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_a_port_that_is_taken(new_graph: Callable[[], Path]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        message = told("--workspace", new_graph().parent, "--port", port)
    assert f"cannot listen on 127.0.0.1, port {port}: Address already in use; --port 0 picks a free one" in message


@pytest.mark.slow
def test_a_host_that_is_not_ours(new_graph: Callable[[], Path]) -> None:
    assert "cannot listen on 203.0.113.1" in told("--workspace", new_graph().parent, "--host", "203.0.113.1")


@pytest.mark.slow
@pytest.mark.parametrize(("content", "message"), [(None, "token: cannot be read"), (b" \n", "the token file is empty")])
def test_a_token_file_that_says_nothing(
    tmp_path: Path, new_graph: Callable[[], Path], content: bytes | None, message: str
) -> None:
    file = tmp_path / "token"
    if content is not None:
        file.write_bytes(content)
    assert message in told("--workspace", new_graph().parent, "--port", 0, "--token-file", file)


def test_a_query_has_a_day_at_most(tmp_path: Path) -> None:
    said = refused("serve", "--workspace", tmp_path, "--timeout", 1e300)
    assert "Invalid value for '--timeout'" in said.splitlines()[-1]


ELSEWHERE = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
LINK = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}


@pytest.mark.parametrize(
    ("method", "headers", "status"),
    [
        ("GET", ELSEWHERE, 403),
        ("GET", {**ELSEWHERE, "Sec-Fetch-Site": "same-site"}, 403),
        ("GET", {**LINK, "Sec-Fetch-Dest": "iframe"}, 403),
        ("GET", {"Origin": "http://evil.example"}, 403),
        ("POST", {"Origin": "http://evil.example"}, 403),
        ("POST", {"Origin": "null"}, 403),
        ("POST", {"Origin": "http://["}, 403),
        ("POST", LINK, 403),
        ("OPTIONS", {"Origin": "http://evil.example", "Access-Control-Request-Method": "POST"}, 403),
        ("GET", LINK, 200),
        ("GET", {"Sec-Fetch-Site": "none", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}, 200),
        ("POST", {"Sec-Fetch-Site": "same-origin", "Origin": "https://a.proxy.example"}, 200),
        ("POST", {"Origin": "own"}, 200),
        ("POST", {}, 200),
    ],
)
def test_pages_of_other_sites_get_no_answer(server, method: str, headers: dict[str, str], status: int) -> None:
    said = {name: server.url if value == "own" else value for name, value in headers.items()}
    if method == "POST":
        response = CLIENT.post(server.sparql, data={"query": "ASK {}"}, headers=said)
    else:
        response = CLIENT.request(method, f"{server.sparql}?query=ASK{{}}", headers=said)
    assert response.status_code == status
    if status == 403:
        assert response.text == "this server does not answer to other sites' pages\n"


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's filter is Linux'")
def test_workers_have_no_network(server) -> None:
    for worker in server.workers():
        assert "Seccomp:\t2" in Path(f"/proc/{worker}/status").read_text()


def test_it_listens_on_this_machine_alone(server) -> None:
    port = urlsplit(server.url).port
    listening = [c for c in psutil.Process(server.process.pid).net_connections() if c.status == psutil.CONN_LISTEN]
    assert [(c.laddr.ip, c.laddr.port) for c in listening] == [("127.0.0.1", port)]


@pytest.mark.slow
def test_a_signal_ends_it_and_its_workers(new_graph: Callable[[], Path]) -> None:
    with serving(new_graph()) as running:
        assert running.update("CLEAR ALL").status_code == 204  # its process stays for the next
        workers = list(running.workers())
        assert len(workers) > 3
        os.kill(running.process.pid, signal.SIGTERM)
        assert running.process.wait(timeout=30) == 0
        assert not any(psutil.pid_exists(worker) for worker in workers)
        with pytest.raises(httpx.ConnectError):
            CLIENT.get(running.url)


@pytest.mark.slow
def test_clients_that_hang_are_broken_off_in_one_line(new_graph: Callable[[], Path]) -> None:
    with serving(new_graph()) as running:
        parts, workers = urlsplit(running.url), list(running.workers())
        asked = ["GET /live/Arm_A/events HTTP/1.1\r\n"] * 2
        asked += ["POST /sparql HTTP/1.1\r\nContent-Type: application/sparql-query\r\nContent-Length: 99\r\n"]
        clients = [socket.create_connection((parts.hostname, parts.port)) for _ in asked]
        for client, request in zip(clients, asked, strict=True):
            client.sendall(f"{request}Host: {parts.netloc}\r\n\r\n".encode())
        for page in clients[:2]:
            assert b"text/event-stream" in page.recv(1000)
        os.kill(running.process.pid, signal.SIGINT)
        assert running.process.wait(timeout=30) == 0
        assert not any(psutil.pid_exists(worker) for worker in workers)
        assert running.process.stderr.read() == "ERROR:    broken off after 3 s: 1 of the answers under way\n"
        for client in clients:
            client.close()


PATHS = ("/", "/sparql", "/sparql?query=ASK{}", "/sparql?query=rubbish", "/irtwin", "/assets/query.js", "/nowhere")


@pytest.mark.parametrize("path", PATHS)
def test_every_response_has_the_security_headers(server, path: str) -> None:
    headers = server.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert headers["content-security-policy"].startswith("default-src 'none'")
    assert "access-control-allow-origin" not in headers
    assert "server" not in headers


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "localhost.evil"])
def test_other_names_of_this_machine_get_nothing(server, host: str) -> None:
    response = server.get("/sparql?query=ASK{}", Host=host)
    assert (response.status_code, response.text) == (421, "this server answers to localhost only\n")


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1234", "127.0.0.1", "[::1]:80"])
def test_its_own_names_do(server, host: str) -> None:
    assert server.get("/sparql?query=ASK{}", Host=host).status_code == 200


@pytest.mark.parametrize(
    "path",
    [
        "/assets/../server.py",
        "/assets/%2e%2e/server.py",
        "/assets/..%2f..%2fcli.py",
        "/assets/%2fetc%2fpasswd",
        "/assets//etc/passwd",
        "/assets/query.js%00.css",
        "/assets/README.md",
        "/assets/",
        "/irtwin/../../etc/passwd",
        "/irtwin/..%2f..%2fpyproject.toml",
        "/irtwin/robots/kuka_kr6_r700",
        "/irtwin/robot.ttl",
        "/irtwinned",
        "/..",
        "//etc/passwd",
        "/%c0%ae%c0%ae/etc/passwd",
    ],
)
def test_no_path_leads_elsewhere(server, path: str) -> None:
    connection = http.client.HTTPConnection(urlsplit(server.url).netloc, timeout=20)  # sends a path as it is
    connection.request("GET", path)
    response = connection.getresponse()
    body = response.read()
    assert response.status == 404
    assert b"root:" not in body and len(body) < 1000

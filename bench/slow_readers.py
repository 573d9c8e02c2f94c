"""How long a small query takes beside clients that read nothing: `python bench/slow_readers.py [CLIENTS] [ROWS]`.

All clients ask for ROWS rows (a million by default) from one address, 127.0.1.1, and then read nothing. A small query
is asked every 0.2 s from another address, before, while and after. Prints the median and the greatest of its times.
"""

from __future__ import annotations

import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import small_robots

IRTWIN = [sys.executable, "-m", "irtwin"]
LARGE = "SELECT * {{ ?a ?b ?c . ?d ?e ?f }} LIMIT {}"
SMALL = "ASK { ?robot a irt:Industrial_Robot }"
SECONDS = 20.0  # of asking in each part


def main(clients: int, rows: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        place = folder / "workspace"
        data_set = small_robots.data_set(folder / "First", "First")
        subprocess.run([*IRTWIN, "run", data_set, "--workspace", place], check=True, capture_output=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        server = subprocess.Popen([*IRTWIN, "serve", "--workspace", str(place), "--port", str(port)])
        try:
            wait_for(port)
            report("alone", port)
            holding = [ask_and_read_nothing(port, rows) for _ in range(clients)]
            report(f"beside {clients} that do not read", port)
            for held in holding:
                held.close()
            report("after they left", port)
        finally:
            server.terminate()
            server.wait()


def report(what: str, port: int) -> None:
    taken, end = [], time.monotonic() + SECONDS
    while time.monotonic() < end:
        began = time.perf_counter()
        ask(port)
        taken.append(time.perf_counter() - began)
        time.sleep(0.2)
    print(
        f"{what}: median {statistics.median(taken):.3f} s, greatest {max(taken):.3f} s, {len(taken)} queries",
        flush=True,
    )


def ask(port: int) -> None:
    address = f"http://127.0.0.1:{port}/sparql?query={urllib.parse.quote(SMALL)}"
    with urllib.request.urlopen(address, timeout=120) as answer:
        answer.read()


def ask_and_read_nothing(port: int, rows: int) -> socket.socket:
    client = socket.create_connection(("127.0.0.1", port), source_address=("127.0.1.1", 0))
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.sendall(
        f"GET /sparql?query={urllib.parse.quote(LARGE.format(rows))} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
        "Accept: application/sparql-results+json\r\n\r\n".encode()
    )
    return client


def wait_for(port: int) -> None:
    for _ in range(300):
        try:
            return ask(port)
        except OSError:
            time.sleep(0.1)
    raise SystemExit("the server does not answer")


if __name__ == "__main__":
    main(*map(int, (*sys.argv[1:], *("20", "1000000")[len(sys.argv) - 1 :])))

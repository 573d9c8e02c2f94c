"""How far the live page lags behind a robot, and how fast it draws.

python bench/live_page.py WORKSPACE LOG ROBOT [SECONDS] [--picture FILE]

`irtwin live` plays the log at true speed, `irtwin serve` serves the page, Chromium shows it without a screen and draws
by software. The stamp of a sample is the time at which it is played, so one clock measures all. `lag` is that to the
page's script, `picture` that to the end of the frame in which the robot stands there; `frame` is from frame to frame,
`script` the page's own part of it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
from playwright.sync_api import Page, sync_playwright

CHROMIUM = "/usr/bin/chromium"
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"]


@contextmanager
def irtwin(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([sys.executable, "-m", "irtwin", *map(str, arguments)], stdout=-1, stderr=-2, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(60)


def processor_time(name: str) -> float:
    """Return the seconds that this process' descendants of a name have worked."""
    mine = [one for one in psutil.Process().children(recursive=True) if name in " ".join(one.cmdline())]
    return sum(sum(one.cpu_times()[:2]) for one in mine)


def measured(page: Page, seconds: float) -> dict[str, list[float]]:
    """Return what the page notes over so many seconds, after the first two."""
    until = time.monotonic() + 60
    while page.evaluate("irtwinLive.drawn") <= 10:  # the page's policy forbids what waits for a function
        assert time.monotonic() < until, "the page shows nothing"
        time.sleep(0.1)
    time.sleep(2.0)
    page.evaluate("for (const name of ['lags', 'drawnLags', 'frames', 'work']) irtwinLive[name].length = 0")
    used = processor_time("chromium"), processor_time("irtwin live"), processor_time("irtwin")
    time.sleep(seconds)
    browser, live, all_of_ours = (
        processor_time(name) - before for name, before in zip(("chromium", "irtwin live", "irtwin"), used, strict=True)
    )
    frames = len(page.evaluate("irtwinLive.frames"))
    print(f"processors: Chromium {browser / seconds:.2f}, {1000 * browser / max(frames, 1):.0f} ms a frame;", end=" ")
    print(f"irtwin live {live / seconds:.2f}, irtwin serve {(all_of_ours - live) / seconds:.2f}")
    said = "({lag: irtwinLive.lags, picture: irtwinLive.drawnLags, frame: irtwinLive.frames, script: irtwinLive.work})"
    return dict(page.evaluate(said))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workspace", type=Path)
    parser.add_argument("log", type=Path)
    parser.add_argument("robot")
    parser.add_argument("seconds", type=float, nargs="?", default=15.0)
    parser.add_argument("--size", default="1440x900")
    parser.add_argument("--picture", type=Path)
    said = parser.parse_args()
    width, height = map(int, said.size.split("x"))
    with irtwin("serve", "--workspace", said.workspace, "--port", 0) as server, sync_playwright() as playwright:
        assert server.stdout is not None
        address = server.stdout.readline().split()[1].rstrip(".,").removesuffix("/sparql")
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": width, "height": height})
        page.on("console", lambda message: print("console:", message.text) if message.type == "error" else None)

        page.on("pageerror", lambda error: print("page error:", error))
        page.goto(f"{address}/live/{said.robot}")
        replay = ("live", "--workspace", said.workspace, "--replay", said.log, "--robot", said.robot)
        with irtwin(*replay) as live:
            found = measured(page, said.seconds)
            if said.picture:
                page.screenshot(path=said.picture, full_page=True)
            live.wait(120)
            assert live.stdout is not None
            print(live.stdout.read().strip())
        browser.close()
    print(f"{said.size}, load {os.getloadavg()[0]:.1f}, {len(found['lag'])} samples in {said.seconds:g} s")
    for name, values in found.items():
        middle, late = np.percentile(values, [50, 99])
        print(f"{name}, ms: median {middle:.0f}, p99 {late:.0f}, max {max(values):.0f} ({len(values)})")


if __name__ == "__main__":
    main()

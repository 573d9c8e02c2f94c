"""What is to be told of ROS and RViz where their picture is not what it should be."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
from tests.system.ros_screen import Screen

_MOST = 1500  # characters of a log or of the list of windows


def facts(peer: Screen, picture: np.ndarray, folder: Path, package: Path) -> str:
    """Return what the screen shows, its windows, what RViz' threads wait for, and the ends of a folder's logs."""
    logs = [*folder.glob("*.log"), *(folder / "home").rglob("*.log")]
    told = {
        "colours": _colours(picture),
        "windows": _windows(peer)[-_MOST:],
        "RViz": _threads(package),
        **{log.name: log.read_text(errors="replace")[-_MOST:] for log in sorted(logs) if log.stat().st_size},
    }
    return "\n".join(f"--- {name}\n{said}" for name, said in told.items())


def _windows(peer: Screen) -> str:
    if shutil.which("xwininfo") is None:
        return "not known: no xwininfo"
    command = ["xwininfo", "-root", "-tree"]
    return subprocess.run(command, env=dict(peer.environment), capture_output=True, text=True, check=False).stdout


def _colours(picture: np.ndarray) -> str:
    """Return the colours that most of a picture has, (H, W, 3), with their shares."""
    found, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    most = np.argsort(counts)[::-1][:5]
    return ", ".join(f"{tuple(found[at].tolist())}: {counts[at] / counts.sum():.3f}" for at in most)


def _threads(package: Path) -> str:
    """Return the threads of the RViz that shows a package, each with its state and what it waits for."""
    said = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_bytes().split(b"\0")
            if command[0].endswith(b"/rviz") and any(str(package).encode() in one for one in command):
                said += [_thread(one) for one in sorted((process / "task").iterdir())]
        except OSError:  # it has ended meanwhile
            continue
    return ", ".join(said) or "no process"


def _thread(task: Path) -> str:
    name, state = ((task / file).read_text().strip() for file in ("comm", "stat"))
    return f"{name} {state.rpartition(')')[2].split()[0]} {(task / 'wchan').read_text()}"

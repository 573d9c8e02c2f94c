"""ROS 1 itself: its launch file starts, tf puts the flange where the twin has it, and RViz draws the robot there."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy import ndimage
from tests.signals.bags import of_run, write
from tests.system.ros_facts import facts
from tests.system.ros_screen import HEIGHT, WIDTH, screen, started

from irtwin import resources
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import link_placements, placements
from irtwin.robot.structure import Solid, structure_of
from irtwin.robot.urdf import read_urdf
from irtwin.ros.ros_package import write_package
from irtwin.signals.channels import Signals
from irtwin.signals.samples import read_signals

PEER = Path(__file__).parent / "ros_peer.py"
PACKAGE = "kuka_kr6_r700_description"
LAUNCHED = 120.0  # s until RViz shows the robot, at most
STARTED = 60.0  # s until RViz draws anything, at most: it takes 2 to 7
GREY = 48  # RViz' background
ALIKE = 0.95  # of where the robot is drawn and where it is to be, what both have
FIELD = np.pi / 4  # rad: RViz' field of view, upright


def installed() -> bool:
    """Whether Debian's ROS is there."""
    if not all(map(shutil.which, ("roslaunch", "rviz", "Xvfb"))):
        return False
    needed = "import rosbag, rospy, sensor_msgs.msg, tf2_ros"
    return subprocess.run(["/usr/bin/python3", "-c", needed], capture_output=True, env={}).returncode == 0


pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.skipif(not installed(), reason="needs Debian's ROS")]


@pytest.fixture(scope="module")
def robot() -> Robot:
    """The demo's robot."""
    return read_urdf(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf")


@pytest.fixture(scope="module")
def run(robot: Robot) -> Signals:
    """A part of a run of the demo, which ends far from where it begins."""
    signals, _ = read_signals(resources.folder("demo") / "kuka_kr6_r700" / "runs" / "exciting_1.parquet", robot)
    return signals.rows(slice(0, 400))


def points(shape: Solid) -> np.ndarray:
    """Return points all over a shape's surface, (N, 3) m in the link's frame."""
    grid = np.linspace(-0.5, 0.5, 25)
    turn, high = (part.ravel() for part in np.meshgrid(np.linspace(0, 2 * np.pi, 60), grid))
    if shape.kind == "box":
        u, v = (part.ravel() for part in np.meshgrid(grid, grid))
        side = np.full_like(u, 0.5)
        faces = [np.roll(np.column_stack([u, v, sign * side]), axis, axis=1) for axis in range(3) for sign in (1, -1)]
        found = np.concatenate(faces) * shape.size
    elif shape.kind == "cylinder":
        radius, length = shape.size
        mantle = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), length * high])
        within = np.abs(2 * high)[:, None] * mantle * [1, 1, 0]
        ends = [within + np.array([0, 0, sign * length / 2]) for sign in (1, -1)]
        found = np.concatenate([mantle, *ends])
    else:
        tilt = np.pi * high
        ball = [np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)]
        found = shape.size[0] * np.column_stack(ball)
    place = shape.origin.transform
    return found @ place[:3, :3].T + place[:3, 3]


def expected(robot: Robot, q: np.ndarray, view: dict[str, float]) -> np.ndarray:
    """Return where the robot is to be seen: (HEIGHT, WIDTH), by the orbit of RViz' camera."""
    places = link_placements(robot, q)
    shapes = [one for one in structure_of(robot).solids if one.purpose == "visual" and one.kind != "mesh"]
    cloud = np.concatenate([points(one) @ places[one.link][:3, :3].T + places[one.link][:3, 3] for one in shapes])
    yaw, pitch = view["Yaw"], view["Pitch"]
    back = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    seen = cloud - np.array([view["X"], view["Y"], view["Z"]]) - view["Distance"] * back
    scale = HEIGHT / 2 / np.tan(FIELD / 2) / -(seen @ back)
    x = np.round(WIDTH / 2 + scale * (seen @ right)).astype(int)
    y = np.round(HEIGHT / 2 - scale * (seen @ np.cross(back, right))).astype(int)
    mask = np.zeros((HEIGHT, WIDTH), dtype=bool)
    mask[np.clip(y, 0, HEIGHT - 1), np.clip(x, 0, WIDTH - 1)] = True
    return np.asarray(ndimage.binary_closing(mask, iterations=3))


def drawn(picture: np.ndarray) -> np.ndarray:
    """Return where a picture of RViz is neither background nor a line of its grid: (HEIGHT, WIDTH)."""
    other = (np.abs(picture.astype(int) - GREY) > 3).any(axis=2)
    return np.asarray(ndimage.binary_opening(other, iterations=2))


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share that two masks have in common of what either has."""
    return float((one & other).sum() / (one | other).sum())


def view_of(file: Path) -> dict[str, float]:
    """Return the camera's values in an RViz file."""
    names = ("Distance", "X", "Y", "Z", "Pitch", "Yaw")
    words = [line.strip().split(": ") for line in file.read_text().splitlines()]
    return {word[0]: float(word[1]) for word in words if word[0] in names}


@dataclass(frozen=True)
class Shown:
    """The last picture of RViz while ROS played a bag, what ROS said and wrote meanwhile, and facts for who is lost."""

    picture: np.ndarray
    said: Path
    copy: Path
    facts: str

    @property
    def by_rviz(self) -> bool:
        """Whether RViz has drawn at all: else the screen is black, or has a dialog or a splash in its midst."""
        return has_background(self.picture)


def has_background(picture: np.ndarray) -> bool:
    """Whether most of a picture is RViz' background."""
    return float((~drawn(picture)).mean()) > 0.5


def played(folder: Path, package: Path, bag: Path, awaited: np.ndarray) -> Shown:
    """Play a bag on a screen of its own until RViz shows what is awaited, or the time is over."""
    folder.mkdir()
    said, copy = folder / "said.json", folder / "copy.bag"
    with screen(folder, package.parent) as peer:
        launch = ["roslaunch", "-p", str(peer.port), PACKAGE, "display.launch", "sliders:=false"]
        with started([*launch, "rviz_args:=--fullscreen"], peer.environment, folder / "launch.log"):
            replay = ["/usr/bin/python3", str(PEER), str(bag), str(copy), str(said), "base_link", "flange"]
            with started(replay, peer.environment, folder / "replay.log"):
                began = time.monotonic()
                picture = peer.picture()
                while overlap(drawn(picture), awaited) < ALIKE or not said.exists():
                    if time.monotonic() - began > (LAUNCHED if has_background(picture) else STARTED):
                        break
                    time.sleep(0.5)
                    picture = peer.picture()
                return Shown(picture, said, copy, facts(peer, picture, folder, package))


def test_rviz_shows_the_robot_in_the_runs_last_pose(robot: Robot, run: Signals, tmp_path: Path) -> None:
    package = tmp_path / "packages" / "kr6"
    write_package(robot, package)
    bag = tmp_path / "run.bag"
    write(bag, *of_run(robot, run))
    last = run.q[-1]
    view = view_of(package / "rviz" / "KUKA_KR6_R700.rviz")
    awaited = expected(robot, last, view)
    shown = played(tmp_path / "1", package, bag, awaited)
    if not shown.by_rviz:  # seen once, on a busy machine, though ROS was well; why is not known
        warnings.warn(f"RViz has drawn nothing and is started again: {shown.facts}", stacklevel=1)
        shown = played(tmp_path / "2", package, bag, awaited)
    assert shown.said.exists(), shown.facts
    said = json.loads(shown.said.read_text())
    assert (said["messages"], said["topics"][:2]) == (8 * len(run.time), ["/joint_states", "/power"])
    assert said["seconds"] == pytest.approx(run.time[-1] - run.time[0], abs=1e-6)
    (flange,) = placements(robot, last[None])
    assert said["translation"] == pytest.approx(flange[:3, 3], abs=1e-9)
    assert pin.Quaternion(np.array(said["rotation"])).matrix() == pytest.approx(flange[:3, :3], abs=1e-9)
    assert overlap(drawn(shown.picture), awaited) >= ALIKE, shown.facts
    assert overlap(drawn(shown.picture), expected(robot, run.q[0], view)) < 0.7  # the measure tells poses apart
    signals, _ = read_signals(shown.copy, robot)  # as ROS wrote it, compressed
    assert np.array_equal(signals.q, run.q)
    assert np.array_equal(signals.power, run.power)

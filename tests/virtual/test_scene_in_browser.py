"""The scene in headless Chromium: it draws and moves, its numbers are right, nothing is fetched or complained of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import mesh_robots
from tests.mesh_robots import HAND
from tests.playing import play
from tests.screens import complaints_of
from tests.virtual.scene_data import HOSTILE, bare, kr6, run

from irtwin.providers.mesh_files import mesh_copies
from irtwin.report.page import content_policy
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import link_placements
from irtwin.robot.meshes import Mesh, read_mesh
from irtwin.virtual.performance import Performance
from irtwin.virtual.scene import apart_html, scene_html

pytestmark = pytest.mark.system

PAGE = '<!DOCTYPE html><html><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{}">'
SEEK = "time => document.dispatchEvent(new CustomEvent('irtwin:time', {detail: {time}}))"
PLACES = """count => {
  const viewer = document.querySelector('.irtwin-scene').irtwinScene.viewer, places = [];
  viewer.scene.updateMatrixWorld(true);
  let path = ['robot'];
  for (let joint = 0; joint < count; joint++) {
    path = [...path, 'joint ' + joint];
    places.push(viewer.scene_tree.find(path).object.matrixWorld.elements.slice());
  }
  return { world: viewer.scene.matrixWorld.elements.slice(), places };
}"""
COLOURS = """() => {
  const source = document.querySelector('.irtwin-scene').irtwinScene.viewer;
  source.render();
  const copy = document.createElement('canvas');
  copy.width = 160; copy.height = 120;
  const context = copy.getContext('2d');
  context.drawImage(source.renderer.domElement, 0, 0, 160, 120);
  return Array.from(context.getImageData(0, 0, 160, 120).data);
}"""


def open_page(
    browser: Any, folder: Path, robot: Robot, *more: Performance, meshes: Mapping[str, Mesh] | None = None
) -> tuple[Any, list[str]]:
    """Open the scene of runs as a file; return the page and whatever it complains of or asks for."""
    path = folder / "scene.html"
    fragment = scene_html(robot, [run(robot), *more], meshes=meshes)
    path.write_text(PAGE.format(content_policy(fragment.scripts)) + fragment.html, encoding="utf-8")
    # A window of its own for each takes as long as the scene, and an earlier one would draw on.
    pages = [page for context in browser.contexts for page in context.pages]
    page = pages[0] if pages else browser.new_page(viewport={"width": 720, "height": 420})
    page.emulate_media(media="screen")
    complaints = complaints_of(page, mine=())
    page.goto(path.as_uri())
    page.wait_for_function("document.querySelector('.irtwin-scene').irtwinScene")
    assert complaints == [path.as_uri()]
    complaints.clear()
    return page, complaints


def pixels(page: Any) -> np.ndarray:
    return np.array(page.evaluate(COLOURS), dtype=float).reshape(120, 160, 4)[:, :, :3]


@pytest.fixture(scope="module")
def arm(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, list[str]]:
    """The scene of the KR6, for the tests that come first: others leave it."""
    return open_page(browser, tmp_path_factory.mktemp("arm"), kr6())


def test_the_robot_is_drawn_and_moves_and_its_numbers_are_right(arm: tuple[Any, list[str]]) -> None:
    robot = kr6()
    page, complaints = arm
    first = pixels(page)
    orange = (first[:, :, 0] > 150) & (first[:, :, 2] < 90)
    assert orange.mean() > 0.01
    shown = run(robot)
    time, energy, power = shown.time, shown.energy, shown.power
    page.evaluate(SEEK, 6.5)
    assert np.abs(pixels(page) - first).max() > 50
    assert page.inner_text(".is-time") == "6.5"
    assert 3600 * float(page.inner_text(".is-energy")) == pytest.approx(np.interp(6.5, time, energy), abs=0.6)
    assert float(page.inner_text(".is-power")) == pytest.approx(np.interp(6.5, time, power), abs=3)
    page.evaluate(SEEK, 1e9)
    assert 3600 * float(page.inner_text(".is-energy")) == pytest.approx(energy[-1], abs=0.6)
    assert complaints == []


def test_the_joints_stand_where_the_kinematics_say(arm: tuple[Any, list[str]]) -> None:
    joints_stand_where_the_kinematics_say(arm[0], kr6())


def joints_stand_where_the_kinematics_say(page: Any, robot: Robot) -> None:
    time, q = run(robot).time, run(robot).q
    for sample in (0, 360, 800):
        page.evaluate(SEEK, float(time[sample]))
        answer = page.evaluate(PLACES, len(robot.joints))
        world = np.array(answer["world"]).reshape(4, 4).T
        known = link_placements(robot, q[sample])
        links = [robot.links[1 + joint].name for joint in range(len(robot.joints))]
        for place, link in zip(answer["places"], links, strict=True):
            np.testing.assert_allclose(np.linalg.solve(world, np.array(place).reshape(4, 4).T), known[link], atol=2e-4)


def test_it_plays_tells_the_time_and_stops_at_the_end(arm: tuple[Any, list[str]]) -> None:
    page, complaints = arm
    page.evaluate("document.addEventListener('irtwin:time', (event) => { window.heard = event.detail.time; })")
    page.evaluate(SEEK, 3.0)
    play(page)
    assert page.evaluate("window.heard") == pytest.approx(11.0)
    assert complaints == []


def test_a_joint_beyond_its_limits_is_marked(browser: Any, tmp_path: Path) -> None:
    robot = bare()
    narrow = replace(robot, joints=(robot.joints[0], replace(robot.joints[1], lower=-0.5, upper=0.5)))
    page, _ = open_page(browser, tmp_path, narrow)
    outside = "Array.from(document.querySelectorAll('.is-joints tr'), (row) => row.classList.contains('is-outside'))"
    assert page.evaluate(outside) == [False, False]
    page.evaluate(SEEK, 4.0)
    assert page.evaluate(outside) == [False, True]


@pytest.mark.nightly
def test_joints_that_slide_stand_right_and_a_curve_of_each_follows_the_time(browser: Any, tmp_path: Path) -> None:
    robot = bare(kind="prismatic")
    page, complaints = open_page(browser, tmp_path, robot)
    joints_stand_where_the_kinematics_say(page, robot)
    shown = run(robot)
    page.evaluate(SEEK, 7.0)
    places = "cursors => cursors.map((cursor) => Number(cursor.getAttribute('x1')))"
    assert page.eval_on_selector_all(".is-joints .is-now", places) == [50, 50]

    def values() -> list[str]:
        return [text.replace("\u2212", "-") for text in page.locator(".is-joints td:last-child").all_inner_texts()]

    at = [np.interp(7.0, shown.time, column) for column in shown.q.T]
    assert values() == [f"{at[0]:.3f} m", f"{np.degrees(at[1]):.1f}°"]
    before = page.eval_on_selector(".is-joints path", "path => path.getAttribute('d')")
    page.select_option(".is-quantity", "torque")
    at = [np.interp(7.0, shown.time, column) for column in shown.torque.T]
    assert values() == [f"{at[0]:.1f} N", f"{at[1]:.1f} N m"]
    assert page.eval_on_selector(".is-joints path", "path => path.getAttribute('d')") != before
    page.select_option(".is-quantity", "velocity")
    speed = np.interp(7.0, shown.time, np.gradient(shown.q[:, 0], shown.time))
    assert float(values()[0].removesuffix(" m/s")) == pytest.approx(speed, abs=2e-3)
    page.select_option(".is-quantity", "power")
    at_first = np.interp(7.0, shown.time, shown.torque[:, 0]) * speed
    assert float(values()[0].removesuffix(" W")) == pytest.approx(at_first, abs=0.6)
    assert complaints == []


@pytest.mark.nightly
def test_links_take_the_colour_of_torque_or_power(browser: Any, tmp_path: Path) -> None:
    robot = kr6()
    page, complaints = open_page(browser, tmp_path, robot)
    page.evaluate(SEEK, 6.5)
    own, legend = pixels(page), page.locator(".is-legend")
    assert legend.is_hidden()
    page.select_option(".is-colour", "torque")
    assert " ".join(legend.inner_text().split()) == "0 20 N m"
    torque = pixels(page)
    page.select_option(".is-colour", "power")
    assert "brakes" in legend.inner_text() and "W drives" in legend.inner_text()
    assert min(np.abs(torque - own).max(), np.abs(pixels(page) - torque).max()) > 50
    page.select_option(".is-colour", "own")
    assert legend.is_hidden() and np.abs(pixels(page) - own).max() < 10
    assert complaints == []


@pytest.mark.nightly
def test_meshes_are_drawn_in_their_colour(browser: Any, tmp_path: Path) -> None:
    robot = mesh_robots.robot()
    copies, _ = mesh_copies(mesh_robots.write(tmp_path / "data"))
    meshes = {name: read_mesh(copy.content, Path(copy.path).suffix, name) for name, copy in copies.items()}
    page, complaints = open_page(browser, tmp_path, robot, meshes=meshes)
    drawn = pixels(page)
    red = (drawn[:, :, 0] > 90) & (drawn[:, :, 1] < 60) & (drawn[:, :, 2] < 60)
    assert red.mean() > 0.002
    page.evaluate(SEEK, 7.0)
    assert np.abs(pixels(page) - drawn).max() > 50
    assert HAND in page.inner_text(".is-note")
    page.select_option(".is-colour", "power")
    after = pixels(page)
    assert not ((after[:, :, 0] > 90) & (after[:, :, 1] < 40) & (after[:, :, 2] < 40)).any()
    assert complaints == []


def test_another_run_can_be_chosen_here_or_elsewhere(browser: Any, tmp_path: Path) -> None:
    robot = kr6()
    longer, bare_run = run(robot, seconds=12.0, name="longer"), replace(run(robot, name="bare"), torque=None)
    page, complaints = open_page(browser, tmp_path, robot, longer, bare_run)
    page.evaluate("document.addEventListener('irtwin:run', (event) => { window.heard = event.detail.run; })")
    page.select_option(".is-run", label="longer")
    assert page.evaluate("window.heard") == 1
    page.evaluate(SEEK, 1e9)
    assert page.inner_text(".is-time") == "15.0"
    assert 3600 * float(page.inner_text(".is-energy")) == pytest.approx(longer.energy[-1], abs=0.6)
    page.select_option(".is-colour", "power")
    page.select_option(".is-quantity", "torque")
    page.evaluate("document.dispatchEvent(new CustomEvent('irtwin:run', {detail: {run: 2, source: null}}))")
    assert page.locator(".is-run").input_value() == "2"
    assert page.inner_text(".is-time") == "3.0"
    assert page.locator(".is-quantity").input_value() == "position"  # no torque was modelled
    assert page.locator(".is-colour").input_value() == "own" and page.locator(".is-legend").is_hidden()
    assert complaints == []


@pytest.mark.nightly
def test_a_print_shows_a_picture(browser: Any, tmp_path: Path) -> None:
    page, _ = open_page(browser, tmp_path, kr6())
    page.evaluate(SEEK, 7.0)
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert page.is_visible(".is-still")
    assert page.evaluate("document.querySelector('.is-still').naturalWidth") > 300
    assert not page.is_visible(".is-controls")


def test_hostile_names_stay_text(browser: Any, tmp_path: Path) -> None:
    page, complaints = open_page(browser, tmp_path, bare(HOSTILE), run(bare(), name=HOSTILE))
    assert page.inner_text(".is-joints tr:first-child th span") == HOSTILE
    assert page.locator(".is-run option").all_inner_texts() == ["sweep", HOSTILE]
    assert page.evaluate("window.hacked === undefined")
    assert complaints == []


def test_a_robot_and_its_simulator_are_drawn_in_one_picture_a_pose(browser: Any, tmp_path: Path) -> None:
    poses = {"as it is": np.array([0.3, -0.2]), "with the robot's numbers": np.array([0.11, 0.19])}
    fragment = apart_html(bare(), np.array([0.1, 0.2]), poses)
    policy = content_policy(fragment.scripts)
    (tmp_path / "p.html").write_text(f"{PAGE.format(policy)}</head><body>{fragment.html}</body></html>")
    page = browser.new_page()
    complaints = complaints_of(page)
    page.goto((tmp_path / "p.html").as_uri())
    page.locator(".ia-picture img[src]").nth(1).wait_for(state="attached")
    drawn = "() => [...document.querySelectorAll('.ia-picture img')].map(each => each.naturalWidth)"
    assert all(width > 0 for width in page.evaluate(drawn))
    assert complaints == []
    page.close()

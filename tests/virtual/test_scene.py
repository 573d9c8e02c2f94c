import re

import numpy as np
import pinocchio as pin
import pytest
from tests.virtual.scene_data import HOSTILE, bare, embedded, kr6, run

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements
from irtwin.robot.urdf import parse_urdf
from irtwin.virtual.scene import scene_html

KR6 = kr6()


def placed(values: list[float]) -> np.ndarray:
    return np.array(values).reshape(4, 4).T


def joint_placements(data: dict, q: np.ndarray) -> list[np.ndarray]:  # type: ignore[type-arg]
    """What the page's script does with the data."""
    places: list[np.ndarray] = []
    for joint, position in zip(data["joints"], q, strict=True):
        axis, own = np.array(joint["axis"]), np.eye(4)
        if joint["unit"] == "m":
            own[:3, 3] = position * axis
        else:
            own[:3, :3] = pin.AngleAxis(position, axis).toRotationMatrix()
        parent = np.eye(4) if joint["parent"] < 0 else places[joint["parent"]]
        places.append(parent @ placed(joint["placement"]) @ own)
    return places


@pytest.mark.parametrize("robot", [KR6, bare(), bare(kind="prismatic")])
def test_the_chain_in_the_page_is_the_robots_kinematics(robot: Robot) -> None:
    time, q, energy, power = run(robot)
    data = embedded(scene_html(robot, time, q, energy, power))
    for sample in q[::200]:
        places, known = joint_placements(data, sample), link_placements(robot, sample)
        tip = data["flange"]
        at = places[tip["joint"]] @ placed(tip["placement"])
        np.testing.assert_allclose(at, known[flange(robot)], atol=1e-6)


def test_signals_are_those_of_the_run_at_25_frames_a_second() -> None:
    time, q, energy, power = run(KR6)
    data = embedded(scene_html(KR6, time, q, energy, power))
    frames = data["start"] + data["step"] * np.arange(len(data["energy"]))
    assert (frames[0], frames[-1]) == pytest.approx((time[0], time[-1]))
    assert data["step"] == pytest.approx(0.04)
    np.testing.assert_allclose(data["energy"], np.interp(frames, time, energy), rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(data["q"][:, 2], np.interp(frames, time, q[:, 2]), atol=1e-6)
    assert data["energy"][-1] == pytest.approx(energy[-1], rel=1e-6)


def test_power_shown_adds_up_to_the_energy_even_with_a_peak_between_frames() -> None:
    time, q, _, power = run(KR6)
    power[402] = 50_000.0
    energy = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time))])
    data = embedded(scene_html(KR6, time, q, energy, power))
    shown = data["step"] * (data["power"].sum() - (data["power"][0] + data["power"][-1]) / 2)
    assert shown == pytest.approx(energy[-1], rel=1e-3)


def test_without_power_the_slope_of_energy_is_shown() -> None:
    time, q, energy, power = run(KR6)
    data = embedded(scene_html(KR6, time, q, energy))
    frames = data["start"] + data["step"] * np.arange(len(data["power"]))
    np.testing.assert_allclose(data["power"], np.interp(frames, time, power), rtol=0.03)


def test_a_long_run_stays_small() -> None:
    time, q, energy, power = run(KR6, seconds=3600, rate=10)
    assert len(scene_html(KR6, time, q, energy, power)) < 1_600_000


def test_shapes_of_the_urdf_are_drawn_where_the_robot_has_them() -> None:
    data = embedded(scene_html(KR6, *run(KR6)))
    assert len(data["parts"]) == sum(len(link.shapes) for link in KR6.links)
    assert {part["joint"] for part in data["parts"]} >= set(range(-1, 6))


def test_a_robot_without_shapes_gets_a_skeleton_from_joint_to_joint() -> None:
    robot = bare()
    parts = embedded(scene_html(robot, *run(robot)))["parts"]
    tubes = [part for part in parts if part["kind"] == "cylinder" and part["joint"] == 1]
    towards = [placed(part["placement"])[:3, 2] * part["size"][1] for part in tubes]
    assert any(np.allclose(tube, [0.1, 0, 0.3], atol=1e-4) for tube in towards)
    assert {part["joint"] for part in parts} == {-1, 0, 1}


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
@pytest.mark.parametrize("count", [1, 2, 40])
def test_a_robot_of_any_axes_is_drawn(count: int, kind: str) -> None:
    links = "".join(f'<link name="l{number}"/>' for number in range(count + 1))
    joints = "".join(
        f'<joint name="j{number}" type="{kind}"><parent link="l{number}"/><child link="l{number + 1}"/>'
        '<axis xyz="0 1 0"/></joint>'
        for number in range(count)
    )
    robot = parse_urdf(f'<robot name="odd">{links}{joints}</robot>')
    data = embedded(scene_html(robot, *run(robot)))
    assert [joint["axis"] for joint in data["joints"]] == [[0.0, 1.0, 0.0]] * count


def test_names_cannot_break_out_of_the_page() -> None:
    robot = bare(HOSTILE)
    fragment = scene_html(robot, *run(robot), title=HOSTILE)
    assert embedded(fragment)["joints"][0]["name"] == HOSTILE
    assert HOSTILE not in fragment
    assert len(re.findall(r"<script", fragment)) == len(re.findall(r"</script", fragment)) == 4
    assert "<img src=x" not in fragment


def test_the_fragment_loads_nothing() -> None:
    fragment = scene_html(KR6, *run(KR6))
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", fragment)
    assert "@import" not in fragment
    assert set(re.findall(r"https?://[\w./]+", fragment)) <= {
        "http://www.w3.org/1999/xhtml",
        "http://www.w3.org/2000/svg",
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t, q, e, p: (t, q[:, :5], e, p), r"q has the shape .*801, 5.*, not .*801, 6"),
        (lambda t, q, e, p: (t, q, e[1:], p), "energy has the shape"),
        (lambda t, q, e, p: (t, q, e, np.where(p > 300, np.nan, p)), "power holds values that are not finite"),
        (lambda t, q, e, p: (t[::-1], q, e, p), "time does not rise"),
        (lambda t, q, e, p: (t[:1], q[:1], e[:1], p[:1]), "time does not rise"),
    ],
)
def test_signals_that_do_not_fit_are_refused(change, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=message):
        scene_html(KR6, *change(*run(KR6)))

import base64
import json
import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from tests import mesh_robots
from tests.mesh_robots import ARM, HAND, SLIDE
from tests.virtual.scene_data import HOSTILE, bare, embedded, kr6, run, unpack

from irtwin.packing import Fragment
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements
from irtwin.robot.meshes import Mesh
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.virtual.scene import apart_html, scene_html

KR6 = kr6()
FIELDS = ("time", "q", "energy", "power", "torque")


def scene_of(robot: Robot, meshes: Mapping[str, Mesh] | None = None) -> Fragment:
    """The scene of one run of a robot."""
    return scene_html(robot, [run(robot)], meshes=meshes)


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
    shown = run(robot)
    data = embedded(scene_html(robot, [shown]))
    for sample in shown.q[::200]:
        places, known = joint_placements(data, sample), link_placements(robot, sample)
        tip = data["flange"]
        at = places[tip["joint"]] @ placed(tip["placement"])
        np.testing.assert_allclose(at, known[flange(robot)], atol=1e-6)


def test_signals_are_those_of_the_run_at_25_frames_a_second() -> None:
    shown = run(KR6)
    (data,) = embedded(scene_html(KR6, [shown]))["runs"]
    frames = data["start"] + data["step"] * np.arange(len(data["energy"]))
    assert (frames[0], frames[-1]) == pytest.approx((shown.time[0], shown.time[-1]))
    assert data["step"] == pytest.approx(0.04)
    np.testing.assert_allclose(data["energy"], np.interp(frames, shown.time, shown.energy), rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(data["q"][:, 2], np.interp(frames, shown.time, shown.q[:, 2]), atol=3e-5)
    np.testing.assert_allclose(data["torque"][:, 5], np.interp(frames, shown.time, shown.torque[:, 5]), atol=6e-4)
    assert data["energy"][-1] == pytest.approx(shown.energy[-1], rel=1e-6)


def test_power_shown_adds_up_to_the_energy_even_with_a_peak_between_frames() -> None:
    shown = run(KR6)
    shown.power[402] = 50_000.0
    work = (shown.power[1:] + shown.power[:-1]) / 2 * np.diff(shown.time)
    energy = np.concatenate([[0.0], np.cumsum(work)])
    (data,) = embedded(scene_html(KR6, [replace(shown, energy=energy)]))["runs"]
    added = data["step"] * (data["power"].sum() - (data["power"][0] + data["power"][-1]) / 2)
    assert added == pytest.approx(energy[-1], rel=1e-3)


def test_a_run_without_torque_has_none_and_absent_samples_stay_absent() -> None:
    shown = run(KR6)
    torque = np.full(shown.q.shape, np.nan)
    torque[400:, 1] = 3.0
    first, second = embedded(scene_html(KR6, [replace(shown, torque=None), replace(shown, torque=torque)]))["runs"]
    assert first["torque"] is None
    assert np.isnan(second["torque"][:, 0]).all()
    assert np.isnan(second["torque"][:90, 1]).all() and (second["torque"][110:, 1] == 3.0).all()


def test_long_runs_and_many_of_them_stay_small() -> None:
    assert len(scene_html(KR6, [run(KR6, seconds=3600, rate=10)]).html) < 1_200_000
    many = [run(KR6, seconds=600, rate=10, name=f"run {number}") for number in range(40)]
    fragment = scene_html(KR6, many, opens=3)
    assert len(fragment.html) < 2_200_000
    data = embedded(fragment)
    assert data["opens"] == 3 and [one["name"] for one in data["runs"]] == [one.name for one in many]
    assert data["runs"][3]["step"] == pytest.approx(0.05, abs=0.011) and data["runs"][4]["step"] > 0.1
    for one, shown in zip(data["runs"], many, strict=True):
        assert one["energy"][-1] == pytest.approx(shown.energy[-1], rel=1e-6)


def test_shapes_of_the_urdf_are_drawn_where_the_robot_has_them() -> None:
    data = embedded(scene_of(KR6))
    assert len(data["parts"]) == sum(solid.purpose == "visual" for solid in structure_of(KR6).solids)
    assert {part["joint"] for part in data["parts"]} >= set(range(-1, 6))


def test_a_robot_without_shapes_gets_a_skeleton_from_joint_to_joint() -> None:
    parts = embedded(scene_of(bare()))["parts"]
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
    data = embedded(scene_of(parse_urdf(f'<robot name="odd">{links}{joints}</robot>')))
    assert [joint["axis"] for joint in data["joints"]] == [[0.0, 1.0, 0.0]] * count


def test_names_cannot_break_out_of_the_page() -> None:
    robot = bare(HOSTILE)
    html = scene_html(robot, [run(robot, name=HOSTILE), run(robot)]).html
    assert embedded(Fragment(html, ()))["joints"][0]["name"] == HOSTILE
    assert HOSTILE not in html
    assert len(re.findall(r"<script", html)) == len(re.findall(r"</script", html)) == 6
    assert "<img src=x" not in html


def test_the_fragment_loads_nothing() -> None:
    fragment = scene_of(KR6)
    for text in (fragment.html, *fragment.scripts):
        assert not re.findall(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", text)
        assert "@import" not in text
        names = {"http://www.w3.org/1999/xhtml", "http://www.w3.org/2000/svg"}
        assert set(re.findall(r"https?://[\w./]+", text)) <= names


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: {"q": r.q[:, :5]}, r"sweep: q has the shape .*801, 5.*, not .*801, 6"),
        (lambda r: {"energy": r.energy[1:]}, "energy has the shape"),
        (lambda r: {"torque": r.torque[:, 1:]}, "torque has the shape"),
        (lambda r: {"power": np.where(r.power > 300, np.nan, r.power)}, "power holds values that are not finite"),
        (lambda r: {"time": r.time[::-1]}, "time does not rise"),
        (lambda r: {name: getattr(r, name)[:1] for name in FIELDS}, "does not rise"),
    ],
)
def test_signals_that_do_not_fit_are_refused(change, message: str) -> None:  # type: ignore[no-untyped-def]
    shown = run(KR6)
    with pytest.raises(ValueError, match=message):
        scene_html(KR6, [replace(shown, **change(shown))])


BOX = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]), np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]]))


def test_meshes_are_drawn_and_shapes_stand_in_for_those_that_are_missing() -> None:
    fragment = scene_of(mesh_robots.robot(), {SLIDE: BOX, ARM: BOX})
    data = embedded(fragment)
    kinds = [(part["joint"], part["kind"], part["mesh"]) for part in data["parts"]]
    assert kinds == [(-1, "box", None), (0, "mesh", 0), (1, "mesh", 1), (2, "cylinder", None), (2, "sphere", None)]
    slide = data["parts"][1]
    assert slide["size"] == [0.001] * 3 and slide["colour"] == [0.9, 0.05, 0.05, 1]
    np.testing.assert_allclose(placed(slide["placement"])[:3, 3], [0, 0, 0.1])
    drawn = data["meshes"][0]
    np.testing.assert_allclose(np.column_stack([unpack(axis) for axis in drawn["points"]]), BOX.points, atol=1e-4)
    assert np.frombuffer(base64.b64decode(drawn["faces"]), "<u4").reshape(-1, 3).tolist() == BOX.faces.tolist()
    assert "1 of the robot\u2019s meshes is not in its data set" in fragment.html and HAND in fragment.html


def test_without_any_of_its_meshes_a_robot_is_seen_by_its_collision_shapes() -> None:
    fragment = scene_of(mesh_robots.robot())
    kinds = [(part["joint"], part["kind"]) for part in embedded(fragment)["parts"]]
    assert kinds == [(-1, "box"), (1, "box"), (2, "cylinder"), (2, "sphere")]
    assert "3 of the robot\u2019s meshes are not in its data set" in fragment.html


def test_a_robot_whose_meshes_are_missing_and_that_has_no_shapes_gets_a_skeleton() -> None:
    text = mesh_robots.URDF.replace("<collision>", "<!--").replace("</collision>", "-->")
    parts = embedded(scene_of(parse_urdf(text)))["parts"]
    assert {part["joint"] for part in parts} == {-1, 0, 1, 2} and len(parts) > 5
    assert "not in its data set" not in scene_of(KR6).html


@pytest.mark.slow
def test_large_meshes_are_drawn_with_few_triangles() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5)
    mesh = Mesh(np.array(ball.vertices), np.array(ball.faces))
    assert len(mesh.faces) > 20_000
    fragment = scene_of(mesh_robots.robot(), {SLIDE: mesh, ARM: mesh})
    assert all(len(base64.b64decode(one["faces"])) <= 8_000 * 12 for one in embedded(fragment)["meshes"])
    assert len(fragment.html) < 1_000_000


POSES = {"as it is": np.array([0.3, -0.2]), "with the robot's numbers": np.array([0.11, 0.19])}


def test_each_pose_of_a_robot_and_its_simulator_has_a_picture_with_its_caption() -> None:
    html = str(apart_html(bare(), np.array([0.1, 0.2]), POSES).html)
    assert html.count('class="ia-picture"') == 2
    assert re.findall(r"<figcaption>(.*?)</figcaption>", html) == ["as it is", "with the robot&#39;s numbers"]
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])
    assert (data["robot"], data["simulators"]) == ([0.1, 0.2], [[0.3, -0.2], [0.11, 0.19]])


def test_a_name_of_a_pose_stays_a_name() -> None:
    html = str(apart_html(bare(HOSTILE), np.array([0.1, 0.2]), {HOSTILE: np.zeros(2)}).html)
    assert "<script>window.hacked" not in html
    assert "<img src=x" not in html

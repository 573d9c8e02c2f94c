"""The physics without a workspace: the examples of the docstrings, run."""

import doctest
import functools
import inspect
import json
import subprocess
import sys
from xml.etree import ElementTree

import pyarrow.parquet as pq
import pytest

import irtwin
import irtwin.errors
from irtwin import modelling
from irtwin.workflow import unpack_demo
from tests.small_robots import data_set


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    return unpack_demo(tmp_path_factory.mktemp("library"))


@pytest.mark.slow
def test_examples_hold(demo, monkeypatch):
    monkeypatch.setattr(irtwin, "identify", functools.cache(irtwin.identify))  # two examples ask for the same twin
    result = doctest.testmod(modelling, extraglobs={"demo": demo})
    assert result.attempted > 0
    assert result.failed == 0


def test_completion_offers_each_name():
    assert set(irtwin.__all__) <= set(dir(irtwin))


@pytest.mark.parametrize("name", irtwin.__all__)
def test_every_name_is_there(name):
    assert getattr(irtwin, name).__doc__


def test_a_name_that_is_not_there_is_told():
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = irtwin.nothing


def test_effects_go_by_name():
    assert irtwin.catalogue()["stribeck_friction"].family == "friction"


@pytest.mark.slow
def test_a_faulty_model_has_one_rotor_with_half_its_inertia(demo, tmp_path):
    twin = irtwin.identify(demo, ["rigid_body", "rotor_inertia"])
    modelling.write_model(twin, "mjcf", tmp_path / "right.xml")
    modelling.write_faulty_model(twin, "joint_a2", tmp_path / "faulty.xml")
    right, faulty = (
        {one.get("name"): float(one.get("armature")) for one in ElementTree.parse(tmp_path / file).iter("joint")}
        for file in ("right.xml", "faulty.xml")
    )
    assert faulty == right | {"joint_a2": right["joint_a2"] / 2}


WITHOUT_GRAPH = """
import json, sys
import irtwin
imported = list(sys.modules)
diagnose = irtwin.diagnose
named = list(sys.modules)
diagnose(sys.argv[1], json_file=sys.argv[2])
print(json.dumps([imported, named, list(sys.modules)]))
"""


@pytest.mark.slow
def test_a_diagnosis_alone_imports_no_graph_database_or_page(tmp_path):
    data, gap = data_set(tmp_path / "data", "Arm", joints=1), tmp_path / "gap.json"
    done = subprocess.run([sys.executable, "-c", WITHOUT_GRAPH, data, gap], capture_output=True, text=True, check=True)
    imported, named, diagnosed = map(set, json.loads(done.stdout))
    assert not imported & {"numpy", "scipy", "pinocchio", "pyarrow"}
    assert not [name for name in named if name.startswith(("scipy.special", "scipy.linalg", "mujoco"))]
    heavy = {"sqlalchemy", "pyoxigraph", "rdflib", "pyshacl", "owlready2", "jinja2", "starlette"}
    assert not diagnosed & {*heavy, "scipy.stats", "scipy.signal"}
    assert gap.exists()


@pytest.mark.slow
def test_a_prediction_can_be_kept(tmp_path):
    data = data_set(tmp_path / "data", "Arm")
    twin = irtwin.identify(irtwin.read_data_set(data), effects=["rigid_body", "coulomb_friction", "viscous_friction"])
    run = data / "runs" / "swing_1.parquet"
    table = irtwin.predict(twin, run, tmp_path / "out.parquet")
    assert pq.read_table(tmp_path / "out.parquet").equals(table)
    assert "power" not in table.column_names


@pytest.mark.parametrize("name", [name for name in irtwin.__all__ if inspect.isfunction(getattr(irtwin, name))])
def test_each_path_may_be_text(name):
    hints = inspect.signature(getattr(irtwin, name)).parameters.values()
    paths = [str(it.annotation) for it in hints if "Path" in str(it.annotation)]
    assert all("str" in hint for hint in paths)


@pytest.mark.slow
def test_paths_as_text_are_read_and_written(demo, tmp_path):
    assert irtwin.read_urdf(str(demo / "robot.urdf")).name == "KUKA_KR6_R700"
    assert irtwin.read_data_set(str(demo)).robot.name == "KUKA_KR6_R700"
    with pytest.raises(irtwin.errors.InputError, match="cannot be read"):
        irtwin.read_urdf("none.urdf")
    with pytest.raises(irtwin.errors.InputError, match="no such file or folder"):
        irtwin.diagnose("none", json_file=str(tmp_path / "gap.json"), report=str(tmp_path / "gap.html"))


@pytest.mark.slow
def test_a_workspace_that_cannot_be_used_is_refused_before_a_diagnosis(demo, tmp_path, monkeypatch):
    (tmp_path / "workspace").mkdir()
    (tmp_path / "workspace" / "irtwin.db").write_bytes(b"no database" * 1000)
    monkeypatch.setattr("irtwin.gap.diagnosis.diagnose", lambda *_, **__: pytest.fail("diagnosed all the same"))
    with pytest.raises(irtwin.errors.InputError, match=r"irtwin\.db"):
        irtwin.diagnose(demo, workspace=tmp_path / "workspace", json_file=tmp_path / "gap.json")
    assert not (tmp_path / "gap.json").exists()

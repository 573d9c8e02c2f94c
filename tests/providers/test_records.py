"""What is taken in is given back."""

import re
import unicodedata
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from sqlalchemy import select
from tests import rows

from irtwin.errors import InputError
from irtwin.providers.records import check_name, find_robot, identifier, ingest, load_robot, load_run
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, Run
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Run as Row

URDF = """<robot name="one"><link name="base"/><link name="l1"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/></joint></robot>"""


def run(name: str = "first", **changes: object) -> Run:
    time = np.linspace(0.0, 1.0, 30)
    signals = Signals(time, np.sin(time)[:, None], torque=np.cos(time)[:, None], power=time * 10)
    made = Run(name, Path(f"{name}.csv"), "0" * 64, "observed", 1.5, (0.0, 0.1, 0.2), None, None, {}, signals)
    return replace(made, **changes)  # type: ignore[arg-type]


def data_set(*runs: Run) -> DataSet:
    robot = parse_urdf(URDF)
    joints = (replace(robot.joints[0], gear_ratio=50.0, acceleration=40.0),)
    robot = replace(robot, name="One arm", joints=joints, weight=3.0)
    return DataSet(Path(), robot, runs, ("rigid_body",), 21.0, "mains", True, {"note": "kept"})


@pytest.mark.parametrize("on_server", [False, pytest.param(True, marks=pytest.mark.system)])
def test_a_data_set_comes_back_as_it_was(on_server, tmp_path, request):
    first = run(started=datetime(2026, 3, 1, 13, 0, 0, 250_001, timezone(timedelta(hours=1))))
    second = run("second", repeat_of="first")
    url = request.getfixturevalue("new_postgresql_database")() if on_server else None
    with Workspace(tmp_path, url) as workspace:
        assert ingest(workspace, data_set(second, first)) == "new"
        assert ingest(workspace, data_set(second, first)) == "unchanged"
        robot = load_robot(workspace, identifier("One arm"))
        assert robot == replace(data_set(first).robot)
        back = load_run(workspace, robot, f"{identifier('One arm')}.second")
        with workspace.reading() as session:
            said = session.get_one(Row, f"{identifier('One arm')}.first")
            unsaid = session.get_one(Row, f"{identifier('One arm')}.second")
    began = datetime(2026, 3, 1, 12, 0, 0, 250_001, UTC)
    assert (said.started, said.ended) == (began, began + timedelta(seconds=1))
    assert (unsaid.started, unsaid.ended, unsaid.start_time_from) == (None, None, "ingest")
    assert (back.name, back.payload_mass, back.payload_com, back.repeat_of) == ("second", 1.5, (0.0, 0.1, 0.2), "first")
    assert np.array_equal(back.signals.q, first.signals.q)
    assert np.array_equal(back.signals.torque, first.signals.torque)
    assert np.array_equal(back.signals.power, first.signals.power)
    assert back.signals.dq is None


def test_a_joint_that_has_lost_its_row_is_told(tmp_path):
    with Workspace(tmp_path) as workspace:
        ingest(workspace, data_set(run()))
        with workspace.engine.begin() as connection:
            connection.exec_driver_sql("DELETE FROM joint")
        with pytest.raises(InputError, match='no row of joint "a" of "One arm"; run its data set again, or restore'):
            load_robot(workspace, identifier("One arm"))


def test_plain_names_are_their_own_identifiers():
    for name in ("KUKA_KR6_R700", "R-1", "a" * 200):
        assert identifier(name) == name


@pytest.mark.slow
@given(st.lists(st.text(), min_size=2, max_size=2, unique_by=lambda name: unicodedata.normalize("NFC", name)))
@example(["机器人", "人器机"])
@example(["R 1", "R_1"])
@example(["a.b", "a b"])
@example(["a" * 250, "a" * 251])
def test_names_that_differ_have_identifiers_that_differ(names):
    one, other = map(identifier, names)
    assert one != other
    assert all(re.fullmatch(r"[A-Za-z0-9_~-]{1,200}", each) for each in (one, other))


def test_an_identifier_never_reads_as_a_plain_name():
    assert identifier(identifier("R 1")) != identifier("R 1")


def test_the_same_letters_in_two_forms_are_one_name():
    assert identifier("Jos\u00e9") == identifier("Jose\u0301")


def test_runs_that_differ_in_punctuation_alone_are_two(tmp_path):
    with Workspace(tmp_path) as workspace:
        ingest(workspace, data_set(run("a b"), run("a.b"), run("a_b")))
        with workspace.reading() as session:
            found = session.scalars(select(Row.run_id)).all()
    assert len(set(found)) == 3
    assert all(run_id.count(".") == 1 for run_id in found)


@pytest.mark.parametrize("name", ["ONE ARM", "One\u00a0arm", "Ｏne arm"])
def test_a_name_that_looks_the_same_is_refused(tmp_path, name):
    with Workspace(tmp_path) as workspace:
        ingest(workspace, data_set(run()))
        check_name(workspace, "One arm")
        check_name(workspace, "One arm 2")
        with pytest.raises(InputError, match='differs from "One arm" there in upper and lower case'):
            check_name(workspace, name)


@pytest.mark.parametrize("name", ["One arm", "One_arm"])
def test_an_identifier_of_an_earlier_version_is_told(tmp_path, name):
    with Workspace(tmp_path) as workspace:
        workspace.ingest(rows.robot(robot_id="One_arm", name="One arm"), [], [], {})
        with pytest.raises(InputError, match=r'has the identifier One_arm of an earlier irtwin.*drop "One arm"'):
            check_name(workspace, name)
        assert find_robot(workspace, "One arm") == "One_arm"


def test_a_robot_is_found_by_its_name(tmp_path):
    with Workspace(tmp_path) as workspace:
        with pytest.raises(InputError, match='no robot "Two arms" here; it has none'):
            find_robot(workspace, "Two arms")
        ingest(workspace, data_set(run()))
        assert find_robot(workspace, "One arm") == find_robot(workspace, identifier("One arm")) == identifier("One arm")
        with pytest.raises(InputError, match='no robot "Two arms" here; the nearest is "One arm"'):
            find_robot(workspace, "Two arms")

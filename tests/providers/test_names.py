"""Robots and runs go by one name each, in whatever letters."""

import re
import unicodedata

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sqlalchemy import select
from tests.providers.test_records import data_set, run

from irtwin.errors import InputError
from irtwin.providers.names import check_name, find_robot, identifier
from irtwin.providers.records import ingest
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunRow as Row


def test_plain_names_are_their_own_identifiers():
    for name in ("KUKA_KR6_R700", "R-1", "a" * 200):
        assert identifier(name) == name


@pytest.mark.slow
@settings(max_examples=40)
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
        found = workspace.all(select(Row.run_id))
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


def test_a_robot_is_found_by_its_name(tmp_path):
    with Workspace(tmp_path) as workspace:
        with pytest.raises(InputError, match='no robot "Two arms" here; it has none'):
            find_robot(workspace, "Two arms")
        ingest(workspace, data_set(run()))
        assert find_robot(workspace, "One arm") == find_robot(workspace, identifier("One arm")) == identifier("One arm")
        with pytest.raises(InputError, match='no robot "Two arms" here; the nearest is "One arm"'):
            find_robot(workspace, "Two arms")

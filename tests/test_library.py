"""The physics without a workspace: the examples of the docstrings, run."""

import doctest

import pyarrow.parquet as pq
import pytest

import irtwin
from irtwin import modelling
from irtwin.workflow import unpack_demo


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    return unpack_demo(tmp_path_factory.mktemp("library"))


@pytest.mark.slow
def test_examples_hold(demo):
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
def test_a_prediction_can_be_kept(demo, tmp_path):
    twin = irtwin.identify(irtwin.read_data_set(demo), effects=["rigid_body", "coulomb_friction", "viscous_friction"])
    run = demo / "runs" / "exciting_1.parquet"
    table = irtwin.predict(twin, run, tmp_path / "out.parquet")
    assert pq.read_table(tmp_path / "out.parquet").equals(table)
    assert "power" not in table.column_names

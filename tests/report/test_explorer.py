from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from tests.report.robots import Factory, answers, power_only, six_axis
from tests.virtual.scene_data import unpack

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.explorer import Columns, explorer


def drawn(graph: KnowledgeGraph, factory: Factory) -> dict[str, Any]:
    return explorer(answers(graph, factory), factory.read_series)


def test_the_page_opens_on_a_held_out_run(graph: KnowledgeGraph):
    curves = drawn(graph, six_axis(graph))
    run = curves["runs"][curves["opens"]]
    assert run["name"] in ("exciting_5", "cycle_6") and run["part"] == "held_out"


def test_curves_keep_the_extremes_of_the_samples(graph: KnowledgeGraph):
    factory = six_axis(graph)
    curves = drawn(graph, factory)
    run = curves["runs"][curves["opens"]]
    assert [chart["title"] for chart in run["torque"]] == factory.names
    assert run["held_out"] == [[0.0, 20.0]]
    samples = factory.series[f"series/{run['name']}.parquet"]["tau_joint_3"].to_numpy()
    shown = unpack(run["torque"][2]["measured"])
    assert len(shown) <= curves["points"] <= 2_000
    np.testing.assert_allclose([shown.min(), shown.max()], [samples.min(), samples.max()], rtol=1e-3)


def test_a_chart_has_the_unit_of_its_joint(graph: KnowledgeGraph):
    factory = six_axis(graph)
    given = answers(graph, factory)
    given["joints"].rows[1]["kind"] = "prismatic"
    curves = explorer(given, factory.read_series)
    run = curves["runs"][0]
    assert [chart["unit"] for chart in run["torque"]] == ["N m", "N", "N m", "N m", "N m", "N m"]
    assert (run["power"]["unit"], run["energy"]["unit"]) == ("W", "Wh")


@pytest.mark.slow
def test_many_runs_share_the_page(graph: KnowledgeGraph):
    factory = six_axis(graph, runs=30)
    curves = drawn(graph, factory)
    assert len(curves["runs"]) == 30
    assert 300 <= curves["points"] < 700


def test_a_column_that_marks_the_held_out_part_is_shaded(graph: KnowledgeGraph):
    factory = power_only(graph)
    table = factory.series["series/pick.parquet"]
    marks = (table["time"].to_numpy() > 12.0) & (table["time"].to_numpy() < 18.0)
    factory.series["series/pick.parquet"] = table.append_column("held_out", pa.array(marks))
    curves = drawn(graph, factory)
    assert curves["runs"][0]["torque"] == []
    [[start, end]] = curves["runs"][0]["held_out"]
    np.testing.assert_allclose([start, end], [12.0, 18.0], atol=0.01)


def test_without_power_the_modelled_one_stands_alone(graph: KnowledgeGraph):
    factory = Factory("TX40", "TX40", power=False, joints=7).robot().run("a").twin([], [], both=["a"]).into(graph)
    curves = drawn(graph, factory)
    assert curves["runs"][0]["power"]["measured"] is None
    assert len(curves["runs"][0]["torque"]) == 7
    assert curves["runs"][0]["held_out"] == []


def test_time_runs_from_the_start_and_empty_columns_are_absent():
    columns = Columns.of(pa.table({"time": [5.0, 6.0], "tau_a_model": [1.0, 2.0], "power": [None, None]}))
    assert columns.get("power") is None and columns.get("energy") is None
    assert columns.joints == ("a",)
    assert columns["time"].tolist() == [5.0, 6.0]

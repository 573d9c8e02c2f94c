import json
from typing import Any

import pytest
from tests.report.robots import Factory, answers, power_only

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.colours import effect_colour
from irtwin.report.energy.figures import figures
from irtwin.report.questions import Answers
from irtwin.report.traces import plain


@pytest.fixture(scope="module")
def drawn(six_answers: Answers) -> dict[str, Any]:
    return figures(six_answers)


def test_energy_per_run_shows_measured_beside_modelled(drawn: dict[str, Any]):
    figure = drawn["energy_per_run"]
    measured, modelled = figure["data"]
    assert len(measured["x"]) == len(modelled["x"]) == 6
    assert modelled["y"] == [2.5] * 6  # Wh
    assert figure["layout"]["yaxis"]["title"]["text"] == "energy, Wh"


def test_energy_error_tells_held_out_runs_from_fitted_ones_and_shows_the_seed(drawn: dict[str, Any]):
    figure = drawn["energy_error"]
    held_out, fitted = figure["data"]
    assert sorted(held_out["y"]) == [2.0, 3.0]
    assert sorted(fitted["y"]) == [2.0, 3.0, 4.0, 5.0]
    assert [line["y0"] for line in figure["layout"]["shapes"]] == [6.54]


def test_stacks_by_effect_and_by_joint_sum_to_the_modelled_energy(drawn: dict[str, Any]):
    total = 6 * 2.5  # Wh
    for name in ("energy_per_effect", "energy_per_joint_and_effect"):
        assert sum(sum(trace["y"]) for trace in drawn[name]["data"]) == pytest.approx(total, rel=1e-4)
    by_joint = drawn["energy_per_joint"]
    assert len(by_joint["data"]) == 6
    assert sum(sum(trace["y"]) for trace in by_joint["data"]) == pytest.approx(6 * 6.0 / 3.6, rel=1e-4)


def test_effects_are_named_by_the_ontology_and_have_their_colour_in_each_figure(drawn: dict[str, Any]):
    colours = [
        {trace["name"]: trace["marker"]["color"] for trace in drawn[name]["data"]}
        for name in ("energy_per_effect", "energy_per_joint_and_effect")
    ]
    assert colours[0] == colours[1]
    for name, effect in (("Coulomb friction", "coulomb_friction"), ("standby power", "standby_power")):
        assert colours[0][name] == effect_colour(effect)
    assert drawn["energy_per_joint_and_effect"]["layout"]["xaxis"]["categoryarray"][-1] == "whole robot"


def test_without_power_there_is_no_error_and_no_measured_bar(graph: KnowledgeGraph):
    factory = Factory("TX40", "TX40", power=False).robot().run("a").twin([], [], both=["a"]).into(graph)
    drawn = figures(answers(graph, factory))
    assert drawn["energy_error"] is None
    assert [trace["name"] for trace in drawn["energy_per_run"]["data"]] == ["modelled by the twin"]


def test_one_day_is_no_figure_and_no_twin_is_none_at_all(graph: KnowledgeGraph):
    assert figures(answers(graph, power_only(graph)))["energy_per_day"] is None
    bare = Factory("NEW", "NEW").robot().run("a").into(graph)
    assert set(figures(answers(graph, bare, twin=False)).values()) == {None}


def test_names_are_text_to_plotly(graph: KnowledgeGraph):
    assert plain("<b>&") == "&lt;b&gt;&amp;"
    factory = Factory("ODD", "ODD", joint_name="<img src=x{}>").robot().run("a").twin(["a"], []).into(graph)
    assert "<img" not in json.dumps(figures(answers(graph, factory)))

import pytest
from robots import Factory, answers, power_only, six_axis

from irtwin.knowledge.graph import KnowledgeGraph
from irtwin.report import verdict
from irtwin.report.questions import Answers


def sentence(found: Answers) -> str:
    return verdict.sentence(found).replace("\N{NO-BREAK SPACE}", " ")


def test_the_twin_is_judged_on_what_it_never_saw(graph: KnowledgeGraph):
    found = answers(graph, six_axis(graph))  # held out: R² 0.965 to 0.915, errors 2 % and 3 %
    assert sentence(found) == (
        "The twin explains 94 % of joint-torque variance on data it never saw and misses the energy of runs it never "
        "saw by 2.5 %; the seed paper (Yan et al., 2018) reached 6.54 %."
    )
    torque, energy = verdict.torque(found), verdict.energy(found)
    assert torque and torque.row["r_squared"] == pytest.approx(0.94)
    assert energy and energy.row["runs"] == 2


def test_a_run_cut_in_time_is_said_to_be_so(graph: KnowledgeGraph):
    text = sentence(answers(graph, power_only(graph)))
    assert "misses the energy of the part of a run that it never saw by 2.0 %" in text
    assert text.endswith("No joint torque was measured, so its torque is not checked.")


def test_without_power_energy_is_not_checked(graph: KnowledgeGraph):
    factory = Factory("TX40", "TX40", power=False).robot().run("a").twin([], [], both=["a"]).into(graph)
    text = sentence(answers(graph, factory))
    assert text.startswith("The twin explains 94 % of joint-torque variance on data it never saw. No electrical power")


def test_a_robot_without_twin(graph: KnowledgeGraph):
    factory = Factory("NEW", "NEW").robot().run("a").into(graph)
    assert sentence(answers(graph, factory, twin=False)).startswith("No twin of this robot has been identified yet")

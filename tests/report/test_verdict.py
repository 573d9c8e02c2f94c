import pytest
from tests.html_elements import plain
from tests.report.robots import Factory, answers, power_only, six_axis

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy import verdict
from irtwin.report.questions import Answers


def sentence(found: Answers) -> str:
    return plain(verdict.sentence(found))


def test_the_twin_is_judged_on_what_it_never_saw(six_answers: Answers):
    assert sentence(six_answers) == (  # held out: R² 0.965 to 0.915, errors 2 % and 3 %
        "The twin explains 96 % of joint-torque variance on data it never saw and misses the energy of runs it never "
        "saw by 2.5 %; the seed paper (Yan et al., 2018) reached 6.54 %."
    )
    errors = [(8.0 / k) ** 2 for k in range(1, 7)]
    variances = [error / (0.035 + 0.01 * k) for k, error in enumerate(errors)]
    pooled = 1 - sum(errors) / sum(variances)
    assert verdict.torque(six_answers)["r_squared"] == pytest.approx(pooled)
    assert verdict.energy(six_answers)["runs"] == 2


def test_a_run_cut_in_time_is_said_to_be_so(graph: KnowledgeGraph):
    text = sentence(answers(graph, power_only(graph)))
    assert "misses the energy of the part of a run that it never saw by 2.0 %" in text
    assert text.endswith("No joint torque was measured, so its torque is not checked.")


def test_without_power_energy_is_not_checked(graph: KnowledgeGraph):
    factory = Factory("TX40", "TX40", power=False).robot().run("a").twin([], [], both=["a"]).into(graph)
    text = sentence(answers(graph, factory))
    assert text.startswith("The twin explains 96 % of joint-torque variance on data it never saw. No electrical power")


def test_a_robot_without_twin(graph: KnowledgeGraph):
    factory = Factory("NEW", "NEW").robot().run("a").into(graph)
    assert sentence(answers(graph, factory, twin=False)).startswith("No twin of this robot has been identified yet")


def test_a_joint_that_the_twin_does_not_follow_is_named(graph: KnowledgeGraph):
    factory = six_axis(graph)
    factory.say(
        f"[] a irt:Torque_Fit ; irt:fit_of {factory._twin} ; irt:of_Run {factory._run('cycle_6')} ; irt:Fit_Part"
        f' "held_out" ; irt:of_Joint {factory._joint(6)} ; irt:R_Squared -5.0e0 ; irt:Torque_RMSE 9.0e0 .'
    )
    text = sentence(answers(graph, factory.into(graph)))
    assert "on data it never saw, though little of joint_6, and misses" in text


def test_a_limit_that_is_changed_in_the_graph_is_changed_on_the_page(graph: KnowledgeGraph):
    factory = six_axis(graph)
    graph.update(
        """DELETE { ?limit irt:Limit_Value ?old } INSERT { ?limit irt:Limit_Value ?new } WHERE {
            ?limit irt:Limit_Value ?old
            VALUES (?limit ?new) { (limit:seed_energy_error 5.0e0) (limit:torque_explained 0.94e0) } }"""
    )
    text = sentence(answers(graph, factory))
    assert "though little of joint_4, joint_5 and joint_6," in text
    assert text.endswith("(Yan et al., 2018) reached 5.00 %.")

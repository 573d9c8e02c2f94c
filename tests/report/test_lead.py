"""The energy report speaks to the plant first; what it says was reckoned by hand."""

from __future__ import annotations

import pytest
from tests.html_elements import plain
from tests.report.robots import Factory, answers, power_only, six_axis

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy import lead
from irtwin.report.questions import Answers

# Of `six_axis`: 6 runs of 20 s, 9 kJ modelled each, measured less by 2 to 5, 2 and 3 %.
JOULES = sum(9000 / (1 + error / 100) for error in (2, 3, 4, 5, 2, 3))


def test_what_was_taken_and_what_an_hour_takes(six_answers: Answers) -> None:
    said = f"This robot took {JOULES / 3600:.1f} Wh in 6 runs of 2 min 0 s, measured: {JOULES / 120 / 1000:.3f} kWh"
    assert plain(lead.taken(six_answers)) == f"{said} for each hour of such work."


def test_a_constant_power_stands_beside_the_twin(six_answers: Answers) -> None:
    mean = sum(9000 / (1 + error / 100) for error in (2, 3, 4, 5)) / 4  # J, of runs equally long
    misses = [100 * abs(mean * (1 + error / 100) / 9000 - 1) for error in (2, 3)]
    constant = lead.constant_power(six_answers)
    assert constant["error_percent"] == pytest.approx(sum(misses) / 2, rel=1e-4)
    assert constant["mean_power_w"] == pytest.approx(mean / 20, rel=1e-4)
    assert (constant["runs"], constant["error_worst_percent"]) == (2, pytest.approx(max(misses), rel=1e-4))
    assert "A constant power, the mean of the runs that the twin was fitted to, would miss" in lead.trust(six_answers)


def test_a_run_cut_in_time_has_no_constant_power_beside_it(graph: KnowledgeGraph) -> None:
    found = answers(graph, power_only(graph))
    assert lead.constant_power(found) is None
    assert "constant" not in lead.trust(found)


def test_switching_off_while_waiting_has_an_interval_or_is_not_said(graph: KnowledgeGraph) -> None:
    factory = six_axis(graph)  # 150 W of standby, 0.1 W up or down; a quarter of 120 s at rest
    reason(graph)
    found = answers(graph, factory)["waiting"].rows[0]
    assert (found["energy_j"], found["lower_j"], found["upper_j"]) == pytest.approx((4500.0, 4497.0, 4503.0))
    assert found["waiting_share"] == pytest.approx(0.25)
    assert found["share"] == pytest.approx(4500 / JOULES, rel=1e-4)
    said = plain(lead.could_save(answers(graph, factory)))
    assert "It stood still for 25 % of the time." in said
    assert "up to 1.25 Wh (95 % interval 1.25 Wh to 1.25 Wh), 8.6 % of the energy" in said
    factory.text = [text for text in factory.text if "of_Effect effect:standby_power" not in text]
    factory.say(
        f"[] a irt:Twin_Parameter ; irt:parameter_of {factory._twin} ; irt:of_Effect effect:standby_power ;"
        ' irt:Parameter_Name "P0" ; irt:Parameter_Value 150.0e0 ; qudt:hasUnit unit:W .'
    )
    factory.into(graph)
    reason(graph)
    assert lead.could_save(answers(graph, factory)) is None


def test_the_timing_that_saves_most_is_said(graph: KnowledgeGraph) -> None:
    factory = six_axis(graph)
    run = next(iter(answers(graph, factory)["modelled_series"].rows))
    for name, times, low, high in (("a", 1.25, 900.0, 1100.0), ("b", 1.5, 1700.0, 1900.0), ("c", 2.0, -10.0, 9000.0)):
        plan = f"<{factory.iri}/{name}>"
        factory.say(
            f"{plan} a irt:Planned_Run ; irt:run_of <{factory.iri}> ; irt:Run_Name '{name}' ;"
            f" irt:time_scaling_of <{run['run']}> ; irt:Time_Scale {times}e0 ; irt:priced_by {factory._twin} ;"
            f" irt:Planned_Saving {(low + high) / 2}e0 ; irt:Planned_Saving_Lower {low}e0 ;"
            f" irt:Planned_Saving_Upper {high}e0 . <{factory.iri}> irt:has_RunProcess {plan} ."
        )
    said = plain(lead.retimed(answers(graph, factory.into(graph))))
    assert said == (
        f"Timed as b, in 1.5 times its time, {run['run_name']} would save 0.500 Wh each time (95 % interval 0.472 to "
        "0.528 Wh), 20 % of what it takes, where the robot waits after it anyway."
    )


def test_what_a_piece_took(graph: KnowledgeGraph) -> None:
    factory = six_axis(graph)
    runs = answers(graph, factory)["energy_per_run"].rows
    factory.say(f"<{runs[0]['run']}> irt:Product 'bracket' ; irt:Piece_Count 10 ; irt:Cycle_Count 1 .")
    each = runs[0]["measured_j"] / 10
    assert lead.retimed(answers(graph, factory)) is None
    piece, cycle = map(plain, lead.made(answers(graph, factory.into(graph))))
    assert piece == (
        f"Each bracket took {each / 3600:.3g} Wh, measured: the mean of 10 pieces, waiting within the runs included."
    )
    assert cycle.startswith(f"Each cycle of bracket took {each / 100 / 3.6:.3g} Wh, measured: the mean of 1 cycle,")


def test_mechanical_energy_is_called_so_and_never_added(graph: KnowledgeGraph) -> None:
    factory = Factory("M", "M", power=False).robot().run("a").run("b").twin(["a", "b"], [])
    said = plain(lead.taken(answers(graph, factory.into(graph))))
    assert said == (
        "The joints of this robot did 5.00 Wh of mechanical work in 2 runs of 40.0 s, by its twin. "
        "What that took from the supply is not known: no electrical power was measured."
    )
    electrical = [text.replace('"mechanical"', '"modelled"') if "/M.b>" in text else text for text in factory.text]
    factory.text = electrical
    assert "has no sum" in lead.taken(answers(graph, factory.into(graph)))


def test_a_robot_of_which_little_is_known(graph: KnowledgeGraph) -> None:
    empty = answers(graph, Factory("E", "E").robot().into(graph), twin=False)
    assert lead.taken(empty) == "No run of this robot is known yet."
    logged = answers(graph, Factory("L", "L").robot().run("a").into(graph), twin=False)
    assert "is not known: no power was measured and no twin models it" in lead.taken(logged)


def sentence(found: Answers) -> str:
    return plain(lead.verdict(found))


def test_the_twin_is_judged_on_what_it_never_saw(six_answers: Answers):
    assert sentence(six_answers) == (  # held out: R² 0.965 to 0.915, errors 2 % and 3 %
        "The twin explains 96 % of joint-torque variance on data it never saw and misses the energy of runs it never "
        "saw by 2.5 %; the seed paper (Yan et al., 2018) reached 6.54 %."
    )
    errors = [(8.0 / k) ** 2 for k in range(1, 7)]
    variances = [error / (0.035 + 0.01 * k) for k, error in enumerate(errors)]
    pooled = 1 - sum(errors) / sum(variances)
    assert lead.torque(six_answers)["r_squared"] == pytest.approx(pooled)
    assert lead.energy(six_answers)["runs"] == 2


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

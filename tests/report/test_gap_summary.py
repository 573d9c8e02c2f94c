"""What the terminal says of a diagnosis: its verdict in a line, its largest finding first, and tables."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests import gap_cases

from irtwin.document.document import Document, FrictionSpread
from irtwin.report.gap import summary
from irtwin.simulator.differences import not_held

CAUSES = (
    "(96 % sure): viscous friction (70 %) and stribeck friction (96 %). Adding this to the twin closes 93 % of the gap "
    "on held-out runs (95 % interval 88 % to 97 %)."
)
BESIDE_SIMULATOR = CAUSES.replace("twin closes 93 % of the gap", "simulator closes 93 % of its gap to the robot")


@pytest.mark.parametrize(
    ("verdict", "against", "said"),
    [
        ("no_gap", None, "There is no gap: away from reversals the twin explains the data down to the noise floor."),
        (
            "unexplained",
            "reference",
            "There is a gap in the torque of joint_a3, mostly in the regime “low speed”, and no effect in the "
            "catalogue closes it.",
        ),
        ("attributed", "reference", f"Friction of joint_a3 changed since the reference runs {CAUSES}"),
        ("attributed", "simulated", f"Friction of joint_a3 differs from the simulator’s {BESIDE_SIMULATOR}"),
        (
            "ambiguous",
            "reference",
            "Friction of joint_a3 differs from the twin’s (52 % sure): stribeck friction (52 %) or nonlinear viscous "
            "friction (16 %) and nonlinear viscous friction (44 %) or stribeck friction (13 %). Adding this to the "
            "twin closes 90 % of the gap on held-out runs (95 % interval 85 % to 94 %).",
        ),
    ],
)
def test_the_verdict_is_one_sentence(verdict, against, said):
    assert summary.line(gap_cases.document(verdict), against) == f"{verdict}: {said}"


def test_what_is_no_gap_but_far_from_noise_is_said():
    diagnosis = gap_cases.diagnosis("no_gap")
    joint = next(iter(diagnosis["gap"]["torque"]))
    diagnosis["gap"]["torque"][joint]["excess"] = 142.0
    document = Document.from_json(diagnosis)
    much = f"12.0 times the noise floor at {joint}"
    assert summary.line(document, "reference") == (
        f"no_gap: Nothing changed since the reference runs. Of these, too, the twin leaves {much}."
    )
    assert summary.line(document, None) == (
        f"no_gap: There is no gap away from reversals. With them the twin leaves {much}: how dry friction changes "
        "where a joint turns back is not known."
    )


def test_a_simulator_that_is_right_agrees_beside_what_the_twin_leaves_of_both():
    diagnosis = gap_cases.diagnosis("no_gap")
    torque = {"before": 0.42, "after": 0.42, "noise_floor": 0.4, "interval95_after": None}
    diagnosis["shrink"] |= {"torque_rmse": torque}
    said = summary.line(Document.from_json(diagnosis), "simulated")
    agrees = "the simulator agrees with the robot, beside the 0.42 N m RMS that no effect explains."
    assert said == f"no_gap: There is no gap: {agrees}"


def test_a_robots_own_effect_and_what_the_simulator_lacks_are_told_apart():
    diagnosis = gap_cases.diagnosis("attributed")
    diagnosis["causes"][0] |= {"scope": "missing", "joints": [], "effect": "base_tilt"}
    said = summary.line(Document.from_json(gap_cases.with_findings(diagnosis)), "simulated")
    assert "Environment differs from the twin’s: base tilt (70 % sure); " in said
    assert "friction of joint_a3 differs from the simulator’s: stribeck friction (96 % sure)." in said


def test_what_was_refused_has_a_line_each():
    assert summary.refused(gap_cases.document("attributed")) == [
        "refused: torque constant error on joint_a2: g = 2.1 (2.05 to 2.16); 0.7 to 1.4 is possible",
        "refused: payload: m = -9 kg (-9.2 to -8.8); at least -3 is possible",
    ]
    assert summary.refused(gap_cases.document("no_gap")) == []


def test_the_gap_stands_before_and_after_with_its_unit():
    diagnosis = gap_cases.document("attributed")
    rows = summary.gap(diagnosis).rows
    assert [(row["gap"], row["unit"]) for row in rows][:2] == [("torque (RMSE)", "N m"), ("power (RMSE)", "W")]
    change = diagnosis.shrink.torque_rmse
    assert (rows[0]["before"], rows[0]["after"]) == pytest.approx((change.before, change.after), rel=0.01)


def test_the_filter_is_said_where_it_is_known():
    (said,) = summary.filtered(gap_cases.document("attributed"))
    assert said == "Signals were low-pass filtered at 9.79 Hz (found: 10 times the bandwidth of the motion)."
    assert summary.filtered(gap_cases.document("ambiguous")) == []


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["tau_a2 has the wrong sign"], "tau_a2 has the wrong sign."),
        (list("abcde"), "a; b; c; and 2 more, which `irtwin check` lists."),
    ],
)
def test_what_was_done_with_the_logs_is_said(lines, said):
    document = replace(gap_cases.document("ambiguous"), mended="\n".join(lines))
    assert summary.filtered(document) == [f"Of the logs, when they were read: {said}"]


@pytest.mark.parametrize(
    ("dry", "viscous", "said"),
    [
        (0.028, 0.04, ["dry by 2.8 % and viscous by 4 %"]),
        (0.0025, 0.113, ["viscous by 11 %"]),
        (0.02, None, ["dry by 2 %"]),
        (0.0, 0.0025, []),
    ],
)
def test_how_much_friction_differs_from_run_to_run_is_said(dry, viscous, said):
    spread = FrictionSpread(dry=dry, viscous=viscous)
    lines = summary.filtered(replace(gap_cases.document("ambiguous"), friction_spread=spread))
    assert lines == [f"Friction differs from run to run, {each} (one standard deviation): noise." for each in said]


def test_what_the_simulators_model_keeps_is_said_in_its_tracking_error():
    said = gap_cases.diagnosis("attributed")
    said["causes"][0]["parameters"][0]["name"] = "dead_band"
    left_out, with_all = [2.1e-3, 2.1e-3], [3e-4, 3e-4]
    said["shrink"]["by_cause"][0] |= {"channel": "position", "rmse_when_left_out": left_out, "rmse_with_all": with_all}
    document = Document.from_json(said)
    played, measured = summary.not_held(document.causes[:2], document)
    assert "keeps that difference, 2.1 mrad (mm) RMS where 0.3 are left with irtwin.simulator.callback." in played
    assert measured.endswith("the simulator's model keeps that difference.")


def test_of_a_cause_that_the_model_holds_in_part_the_rest_is_said_with_the_reason():
    cause = gap_cases.document("attributed").causes[0]
    number = gap_cases.parameter(-0.7, (-0.9, -0.6), 8.8)
    warm = replace(number, name="k", simulator=None, robot=None)
    dry = replace(cause, effect="coulomb_friction", scope="changed", joints=("joint_a2", "joint_a3"), folded_away=None)
    dry = replace(dry, confidence=0.9, parameters=(number, replace(number, joint="joint_a3", simulator=None)))
    warm = replace(dry, effect="temperature_dependent_friction", parameters=(number, replace(warm, joint="joint_a3")))
    told = gap_cases.document("attributed")
    document = replace(told, causes=(dry, replace(warm, id=told.causes[1].id), *told.causes[2:]))
    assert summary.not_held(not_held(document), document) == [
        "The simulator's model keeps its own Fc of joint_a3 (coulomb friction): its format has none, or another is not "
        "sure to be better in it, without what no number holds.",
        "No number of a joint holds temperature dependent friction (k of joint_a3): the simulator's model keeps that "
        "difference.",
    ]


def test_a_number_that_may_be_the_simulators_is_not_in_the_line():
    cause = replace(gap_cases.document("attributed").causes[0], scope="changed", confidence=0.9, folded_away=None)
    numbers = (gap_cases.parameter(-0.7, (-0.9, -0.6), 8.8), gap_cases.parameter(0.1, (-0.1, 0.3), 4.0))
    told = gap_cases.document("attributed")
    document = replace(told, causes=(replace(cause, parameters=numbers), *told.causes[1:]))
    said = summary.line(document, "simulated")
    assert "simulator: frictionloss (Fc) of joint_a2 8.10 N m in place of 8.80. " in said.replace(
        "\N{NO-BREAK SPACE}", " "
    )


def test_that_a_split_between_links_is_the_descriptions_is_said_beside_a_simulator():
    told = gap_cases.document("attributed")
    causes = (
        replace(told.causes[0], effect="rigid_body", joints=()),
        replace(told.causes[1], effect="servo_dead_band"),
    )
    alone, beside = (replace(told, causes=causes, simulator=simulator) for simulator in (None, "arm"))
    (said,) = summary.meanings(beside)
    assert said.startswith("Torque shows sums over links") and summary.meanings(alone) == []
    assert summary.causes(beside, "simulated").rows[0]["parameter"] == "Fs of joint_a3"


def test_each_cause_is_said_once_and_each_parameter_has_its_unit():
    rows = summary.causes(gap_cases.document("attributed"), "reference").rows
    assert [(row["cause"], row["joints"], row["sure, %"]) for row in rows if row["cause"]] == [
        ("viscous friction", "joint_a3", 70),
        ("stribeck friction", "joint_a3", 96),
    ]
    assert (rows[0]["parameter"], rows[0]["value"], rows[0]["95 % from"], rows[0]["to"], rows[0]["unit"]) == (
        ("Fs", 1.82, 1.6, 2.04, "Nm")
    )
    assert rows[1] == {**dict.fromkeys(rows[1]), "parameter": "d", "value": 1.0, "unit": ""}


def test_a_value_is_a_change_beside_logs_of_a_simulator():
    row = summary.causes(gap_cases.document("attributed"), "simulated").rows[0]
    assert (row["simulator"], row["robot"], row["change"]) == (None, None, 1.82)


def test_a_guess_is_called_one_and_what_closes_little_is_not_listed():
    said = gap_cases.diagnosis("attributed")
    said["causes"][0]["confidence"] = 0.3
    rows = summary.causes(Document.from_json(said), "reference").rows
    assert [row["cause"] for row in rows if row["cause"]] == ["perhaps viscous friction", "stribeck friction"]
    for finding in said["findings"]:
        finding["matters"] = False
    assert not summary.causes(Document.from_json(said), "reference")


@pytest.mark.parametrize("verdict", ["no_gap", "unexplained"])
def test_where_nothing_is_to_blame_nothing_is_tabled_or_explained(verdict):
    assert not summary.causes(gap_cases.document(verdict), "reference")
    assert summary.meanings(gap_cases.document(verdict)) == []


def test_what_to_log_next_has_a_line_each():
    assert all(line.startswith("To log next: ") for line in summary.next_steps(gap_cases.document("ambiguous")))
    for settled in ("no_gap", "attributed"):
        said = gap_cases.diagnosis("ambiguous") | {"verdict": settled}
        assert summary.next_steps(Document.from_json(said)) == []


def test_of_many_motions_to_log_the_rest_is_counted():
    said = gap_cases.diagnosis("ambiguous")
    said["next_experiment"]["motions"] = [f"motion {k}" for k in range(5)]
    lines = summary.next_steps(Document.from_json(said))
    assert lines[2:] == ["To log next: motion 2", "2 more to log are in the report (--report)"]


def test_each_parameter_is_told_once_with_what_it_means():
    assert summary.meanings(gap_cases.document("attributed")) == [
        "Fs of stribeck friction: Friction above Coulomb's at standstill.",
        "d of stribeck friction: Stribeck exponent.",
    ]


def test_numbers_of_links_are_told_by_what_the_ontology_says_of_bodies():
    told = gap_cases.diagnosis("attributed")
    for cause in told["causes"]:
        if cause["effect"] == "stribeck_friction":
            names = ("mass (link_3)", "centre_x (upper_arm)", "inertia_xy (link_3)")
            cause["effect"], own = "rigid_body", cause["parameters"][0]
            cause["parameters"] = [own | {"name": name} for name in names]
    assert [line.partition(":")[0] for line in summary.meanings(Document.from_json(told))] == [
        "mass of rigid body", "centre of rigid body", "inertia of rigid body",
    ]  # fmt: skip

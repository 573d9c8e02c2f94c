"""The tables that the terminal shows of a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests import gap_cases

from irtwin.document.document import Document, FrictionSpread
from irtwin.report.gap import summary


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


def test_each_cause_is_said_once_and_each_parameter_has_its_unit():
    rows = summary.causes(gap_cases.document("attributed")).rows
    assert [(row["cause"], row["joints"], row["sure, %"]) for row in rows if row["cause"]] == [
        ("viscous friction", "joint_a3", 70),
        ("stribeck friction", "joint_a3", 96),
    ]
    assert (rows[0]["parameter"], rows[0]["value"], rows[0]["95 % from"], rows[0]["to"], rows[0]["unit"]) == (
        ("Fs", 1.82, 1.6, 2.04, "Nm")
    )
    assert rows[1] == {**dict.fromkeys(rows[1]), "parameter": "d", "value": 1.0, "unit": ""}


def test_a_guess_is_called_one_and_what_closes_little_is_not_listed():
    said = gap_cases.diagnosis("attributed")
    said["causes"][0]["confidence"] = 0.3
    rows = summary.causes(Document.from_json(said)).rows
    assert [row["cause"] for row in rows if row["cause"]] == ["perhaps viscous friction", "stribeck friction"]
    for finding in said["findings"]:
        finding["matters"] = False
    assert not summary.causes(Document.from_json(said))


@pytest.mark.parametrize("verdict", ["no_gap", "unexplained"])
def test_where_nothing_is_to_blame_nothing_is_tabled_or_explained(verdict):
    assert not summary.causes(gap_cases.document(verdict))
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

"""Each rule about a gap, from individuals to what is to be done."""

from __future__ import annotations

import pytest
from pyoxigraph import RdfFormat, parse
from tests.knowledge.graphs import reasoned_over

SOURCE = "https://w3id.org/irtwin/graph/source/rules"
MODEL, AGAIN = "model the effect", "identify the twin again"

# a cause: effect, scope -> what is to be done, besides modelling what is missing and identifying what changed
REMEDIES = {
    ("payload", "missing"): {"measure the payload"},
    ("payload", "changed"): {"measure the payload"},
    ("viscous_friction", "changed"): {"check the gear oil and temperature"},
    ("nonlinear_viscous_friction", "changed"): {"check the gear oil and temperature"},
    ("temperature_dependent_friction", "changed"): {"check the gear oil and temperature"},
    ("temperature_dependent_friction", "missing"): {"measure cold and warm"},
    ("coulomb_friction", "changed"): {"check the gear and its brake for wear"},
    ("local_wear", "changed"): {"check the gear and its brake for wear"},
    ("joint_limit_spring", "missing"): {"check the hose package"},
    ("stribeck_friction", "changed"): {"check the gear and its brake for wear"},
    ("stribeck_friction", "missing"): set(),
    ("backlash", "changed"): {"check the gear for play"},
    ("backlash", "missing"): set(),
    ("torque_ripple", "changed"): {"check the gear for play"},
    ("base_tilt", "missing"): {"mount the robot upright, or state its tilt"},
    ("torque_constant_error", "changed"): {"calibrate the torque constant"},
    ("torque_offset", "changed"): {"zero the torque signal"},
    ("torque_drift", "changed"): {"zero the torque signal"},
    ("encoder_offset", "missing"): {"master the joint again"},
    ("time_delay", "changed"): {"align the clocks of the log"},
    ("meter_gain", "missing"): {"calibrate the power meter"},
    ("meter_lag", "changed"): {"calibrate the power meter"},
    ("cable_drag", "missing"): {"check the hose package"},
    ("gravity_compensation", "changed"): {"check the counterbalance"},
    ("external_contact", "missing"): {"look for contact with the surroundings"},
    ("copper_loss", "changed"): {"check motor and drive"},
    ("copper_loss", "missing"): set(),
    ("no_regeneration", "changed"): {"check brake chopper and DC bus"},
    ("standby_power", "changed"): {"look for loads that run all the time"},
    ("rotor_inertia", "changed"): set(),
}
# a diagnosis: verdict, closed fraction, whether a twin was saved -> what is to be done about it
VERDICTS = {
    ("no_gap", None, True): {"keep the twin as it is"},
    ("unexplained", None, True): {"look for an effect outside the catalogue"},
    ("unexplained ; irt:unexplained_for_Reason reason:does_not_repeat", None, True): {
        "look for an effect outside the catalogue"
    },
    ("unexplained ; irt:unexplained_for_Reason reason:unsure", 0.9, True): {"log more before acting"},
    ("ambiguous", 0.9, True): {"measure what tells the rivals apart"},
    ("attributed", 0.9, True): {"adopt the twin with the causes added"},
    ("attributed", 0.9, False): set(),
    ("attributed", 0.1, True): set(),
    ("attributed", None, True): set(),
}


def individuals() -> str:
    """Turtle of a diagnosis for each case, of a robot with reference runs; and of one beside a simulator."""
    lines = [
        "@prefix irt: <https://w3id.org/irtwin#> . @prefix effect: <https://w3id.org/irtwin/effect/> .",
        "@prefix scope: <https://w3id.org/irtwin/scope/> . @prefix verdict: <https://w3id.org/irtwin/verdict/> .",
        "@prefix : <https://w3id.org/irtwin/id/> . @prefix reason: <https://w3id.org/irtwin/reason/> .",
        f"<{SOURCE}> {{",
        ':arm irt:has_RunProcess :r1 . :r1 irt:Run_Role "reference" .',
        ':drawn irt:has_RunProcess :r2 . :r2 irt:Run_Role "simulated" .',
    ]
    for robot in ("arm", "drawn"):
        lines.append(f":d_{robot} a irt:Gap_Diagnosis ; irt:diagnosis_of :{robot} .")
        for effect, scope in REMEDIES:
            lines.append(
                f":{robot}_{effect}_{scope} a irt:Gap_Cause ; irt:cause_of :d_{robot} ; "
                f"irt:caused_by_Effect effect:{effect} ; irt:has_Scope scope:{scope} ."
            )
    for scope, matters in (("missing", "true"), ("missing", "false"), ("changed", "false")):
        lines.append(
            f":{scope}_{matters} a irt:Gap_Cause ; irt:cause_of :d_arm ; irt:caused_by_Effect effect:payload ; "
            f"irt:has_Scope scope:{scope} ; irt:part_of_Finding :f_{scope}_{matters} . "
            f":f_{scope}_{matters} irt:Matters {matters} ."
        )
    for name, sure in (("guess", "0.49e0"), ("likely", "0.5e0")):
        lines.append(
            f":{name} a irt:Gap_Cause ; irt:cause_of :d_arm ; irt:caused_by_Effect effect:payload ; "
            f"irt:has_Scope scope:changed ; irt:part_of_Finding :f_{name} . :f_{name} irt:Confidence {sure} ."
        )
    for number, (verdict, closed, saved) in enumerate(VERDICTS):
        lines.append(f":v{number} a irt:Gap_Diagnosis ; irt:diagnosis_of :arm ; irt:has_Verdict verdict:{verdict} .")
        if saved:
            lines.append(f':v{number} irt:Twin_File "twin.json" .')
        if closed is not None:
            lines.append(f":v{number} irt:has_Shrinkage :s{number} . :s{number} irt:Closed_Fraction {closed}e0 .")
    return "\n".join([*lines, "}"])


@pytest.fixture(scope="module")
def actions() -> dict[str, set[str]]:
    """What is to be done, by the individual that it is concluded of."""
    graph = reasoned_over(parse(individuals(), format=RdfFormat.TRIG))
    found: dict[str, set[str]] = {}
    rows = graph.query(
        """SELECT ?of ?label WHERE {
           ?action a irt:Recommended_Action ; rdfs:label ?label ; irt:recommended_by ?diagnosis .
           OPTIONAL { ?action irt:follows_from ?cause } BIND(COALESCE(?cause, ?diagnosis) AS ?of) }"""
    )
    for row in rows:
        found.setdefault(row["of"].rpartition("/")[2], set()).add(row["label"])
    return found


@pytest.mark.parametrize(("effect", "scope"), REMEDIES)
def test_a_cause_calls_for_its_remedies(effect, scope, actions):
    expected = REMEDIES[effect, scope] | {MODEL if scope == "missing" else AGAIN}
    assert actions[f"arm_{effect}_{scope}"] == expected


@pytest.mark.parametrize(("effect", "scope"), REMEDIES)
def test_what_a_simulator_lacks_is_mended_there(effect, scope, actions):
    expected = REMEDIES[effect, scope] | {MODEL} if scope == "missing" else {"model the effect in the simulator"}
    assert actions[f"drawn_{effect}_{scope}"] == expected


@pytest.mark.parametrize("number", range(len(VERDICTS)), ids=[" ".join(map(str, case)) for case in VERDICTS])
def test_a_verdict_says_what_to_do(number, actions):
    assert actions.get(f"v{number}", set()) == list(VERDICTS.values())[number]


def test_a_cause_that_closes_little_calls_for_nothing(actions):
    assert actions["missing_true"] == {MODEL, "measure the payload"}
    assert not {"missing_false", "changed_false"} & set(actions)


def test_a_guess_calls_for_nothing(actions):
    assert actions["likely"] == {AGAIN, "measure the payload"}
    assert "guess" not in actions


def test_a_number_of_a_shape_is_no_change() -> None:
    """A dry friction that changed by five deviations, and the speed over which it fades, as sure of itself."""
    lines = [
        "@prefix irt: <https://w3id.org/irtwin#> . @prefix : <https://w3id.org/irtwin/id/> .",
        f"<{SOURCE}> {{",
        ":cause a irt:Gap_Cause ; irt:cause_of :d ; irt:has_Scope <https://w3id.org/irtwin/scope/changed> ;",
        "irt:caused_by_Effect <https://w3id.org/irtwin/effect/stribeck_friction> . :d a irt:Gap_Diagnosis .",
    ]
    for name, value, half in (("Fs", 5.0, 2.0), ("vs", 0.05, 0.02)):
        lines.append(
            f':{name} irt:parameter_of_Cause :cause ; irt:Cause_Parameter_Name "{name}" ; '
            f"irt:Cause_Parameter_Value {value}e0 ; irt:Cause_Parameter_Lower {value - half}e0 ; "
            f"irt:Cause_Parameter_Upper {value + half}e0 ."
        )
    graph = reasoned_over(parse("\n".join([*lines, "}"]), format=RdfFormat.TRIG))
    rows = graph.query("SELECT ?name WHERE { ?changed a irt:Changed_Parameter ; irt:Cause_Parameter_Name ?name }")
    assert [row["name"] for row in rows] == ["Fs"]

"""A fleet's database and graph: robots, runs, twins, ledgers and diagnoses of the sizes that real ones have.

python bench/fleet.py FOLDER [ROBOTS] [RUNS]      writes FOLDER/irtwin.db and FOLDER/graph

The rows are what `irtwin run` and `irtwin diagnose` leave of six-axis robots, the numbers drawn; the graph comes from
the shipped mappings, reasoning and validation. Nothing is thinned out: a run has 31 entries in its ledger, 6 joint
states and 2 activities.
"""

from __future__ import annotations

import random
import sqlite3
import sys
import time
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from irtwin import rewriting
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace
from irtwin.storage.schema import METER, Base, relation_to

JOINTS = [f"joint_a{number}" for number in range(1, 7)]
EFFECTS = {  # of a twin: share of the modelled energy, parameter, unit
    "rigid_body": (0.30, None, ""),
    "rotor_inertia": (0.06, "Ia", "kg m^2"),
    "coulomb_friction": (0.12, "Fc", "N m"),
    "viscous_friction": (0.09, "Fv", "N m s/rad"),
    "copper_loss": (0.05, "R", "ohm"),
}
MODELS = [("KUKA", "KR 6 R700"), ("Staubli", "TX2-60"), ("ABB", "IRB 1200"), ("FANUC", "LR Mate"), ("Yaskawa", "GP8")]
BODY = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
VERDICTS = ["no_gap", "attributed", "attributed", "ambiguous", "unexplained"]
BEGIN = datetime(2026, 1, 5, 6)
SOFTWARE = "irtwin 0.1.0"
Row = tuple[str, dict[str, Any]]  # table, values


def rows(robots: int, runs: int) -> Iterator[Row]:
    """Yield the rows of a fleet, always the same."""
    draw = random.Random(4)
    for number in range(robots):
        yield from _robot(draw, number, runs)


def _robot(draw: random.Random, number: int, runs: int) -> Iterator[Row]:
    robot_id = f"R{number:03d}"
    maker, model = MODELS[number % len(MODELS)]
    burns = number % 5 < 2  # a diode rectifier: what braking gives back is burnt
    yield "robot", {
        "robot_id": robot_id, "name": robot_id, "type": model, "manufacturer": maker, "weight_kg": 45.0 + number % 9,
        "controlled_axes": 6, "arm_movement_type": "RRRRRR", "rated_payload_kg": 6.0, "ambient_temperature_degc": 22.0,
        "power_measured_at": "mains", "simulated": True, "urdf": "<robot/>", "urdf_sha256": f"{number:064x}",
        "notes": "{}",
    }  # fmt: skip
    for position, joint in enumerate(JOINTS, 1):
        yield "joint", {
            "robot_id": robot_id, "name": joint, "position": position, "kind": "revolute", "lower_limit_rad": -3.0,
            "upper_limit_rad": 3.0, "speed_limit_rad_s": 6.0, "torque_limit_nm": 200.0 / position, "gear_ratio": 100.0,
        }  # fmt: skip
    twin_id = f"{robot_id}.{draw.getrandbits(48):012x}"
    standby = draw.uniform(80.0, 160.0)  # W
    drift = draw.choice([0.0, 0.0, 0.0, 0.08, 0.15])  # of the energy, by the last run
    names = [f"{robot_id}.cycle_{k + 1:04d}" for k in range(runs)]
    identification = f"identification.{robot_id}"
    yield from _activity(identification, robot_id, "identification", f"robot/{robot_id}", [])
    yield from _twin(draw, robot_id, twin_id, identification, standby, burns)
    for k, run_id in enumerate(names):
        yield from _run(draw, robot_id, run_id, twin_id, k, runs, standby, drift * k / runs, burns, identification)
    yield from _diagnosis(draw, robot_id, VERDICTS[number % len(VERDICTS)], names)


def _activity(activity_id: str, robot_id: str, provider: str, subject: str, used: list[str]) -> Iterator[Row]:
    yield "activity", {
        "activity_id": activity_id, "robot_id": robot_id, "provider": provider, "subject": subject,
        "started": _text(BEGIN), "ended": _text(BEGIN + timedelta(seconds=2)), "software": SOFTWARE,
    }  # fmt: skip
    for entity in used:
        yield "activity_use", {"activity_id": activity_id, "entity": entity, "relation": relation_to(entity)}


def _twin(draw: random.Random, robot_id: str, twin_id: str, made: str, standby: float, burns: bool) -> Iterator[Row]:
    yield "twin", {
        "twin_id": twin_id, "robot_id": robot_id, "created": _text(BEGIN + timedelta(days=90)),
        "file": f"twins/{twin_id}.json", "sha256": f"{draw.getrandbits(256):064x}", "cutoff_hz": 29.5,
        "condition_number": draw.uniform(10.0, 120.0), "base_parameter_count": 52, "split": "by run",
        "activity_id": made,
    }  # fmt: skip
    for effect in [*EFFECTS, "standby_power", *(["no_regeneration"] if burns else [])]:
        yield "twin_effect", {"twin_id": twin_id, "effect": effect, "activity_id": made}
    of_joints = [(effect, name, unit) for effect, (_, name, unit) in EFFECTS.items() if name]
    of_joints += [("rigid_body", f"{name} of link", "kg m^2") for name in BODY]
    found = [
        (effect, joint, name, unit, draw.uniform(0.1, 9.0)) for effect, name, unit in of_joints for joint in JOINTS
    ]
    for effect, joint, name, unit, value in [*found, ("standby_power", None, "P0", "W", standby)]:
        yield "parameter", {
            "parameter_id": f"{twin_id}.{effect}.{joint or 'robot'}.{name.split()[0]}", "twin_id": twin_id,
            "robot_id": robot_id, "effect": effect, "joint": joint, "name": name, "value": value, "unit": unit,
            "lower": value * 0.96, "upper": value * 1.04, "activity_id": made,
        }  # fmt: skip
    for number in range(1, 53):
        value = draw.uniform(-2.0, 2.0)
        yield "base_parameter", {
            "twin_id": twin_id, "number": number, "combination": f"Izz l{number} + Ia j{number}", "value": value,
            "unit": "kg m^2", "lower": value - 0.1, "upper": value + 0.1, "activity_id": made,
        }  # fmt: skip


def _run(
    draw: random.Random, robot_id: str, run_id: str, twin_id: str, k: int, runs: int,
    standby: float, drift: float, burns: bool, fitted_by: str,
) -> Iterator[Row]:  # fmt: skip
    seconds = draw.uniform(15.0, 120.0)
    idle = draw.random() ** 3
    start = BEGIN + timedelta(days=90 * k / runs)
    part = "fit" if k % 3 else "held_out"
    payload = draw.choice([0.0, 2.0, 4.0])
    series = [f"{draw.getrandbits(256):064x}" for _ in range(2)]
    state, energy, meter = (f"{provider}.{run_id}" for provider in ("run_state", "energy", "energy_meter"))
    yield "run", {
        "run_id": run_id, "robot_id": robot_id, "name": run_id.split(".")[1],
        "kind": "Measured_Run",
        "role": "reference" if k < 20 else "observed",
        "payload_kg": payload, "payload_com_x_m": 0.0, "payload_com_y_m": 0.0, "payload_com_z_m": 0.05,
        "repeat_of": f"{robot_id}.cycle_0001" if k % 10 == 9 else None, "start_time": _text(start),
        "start_time_from": "log", "run_time_s": seconds, "sample_count": int(seconds / 0.012), "sample_rate_hz": 83.33,
        "file": f"runs/cycle_{k + 1:04d}.parquet", "sha256": f"{draw.getrandbits(256):064x}",
    }  # fmt: skip
    columns = ",".join(["time", *(f"{signal}_{joint}" for signal in ("q", "tau") for joint in JOINTS), "power"])
    for kind, series_id, made in zip(["measured", "modelled"], series, [None, energy], strict=True):
        yield "series", {
            "series_id": series_id, "run_id": run_id, "kind": kind, "path": f"series/{series_id}.parquet",
            "row_count": int(seconds / 0.012), "columns": columns, "activity_id": made,
        }  # fmt: skip
    yield from _activity(state, robot_id, "run_state", f"run/{run_id}", [f"run/{run_id}"])
    yield "run_state", {"run_id": run_id, "current_state": "standstill", "idle_share": idle, "activity_id": state}
    for joint in JOINTS:
        yield "joint_state", {
            "run_id": run_id, "joint": joint, "robot_id": robot_id, "joint_position_rad": draw.uniform(-2.0, 2.0),
            "joint_speed_rad_s": 0.0, "joint_acc_rad_s2": 0.0, "joint_torque_nm": draw.uniform(-50.0, 50.0),
            "joint_temperature_degc": draw.uniform(25.0, 60.0), "activity_id": state,
        }  # fmt: skip
        rmse = draw.uniform(0.2, 2.0)
        yield "torque_fit", {
            "twin_id": twin_id, "run_id": run_id, "joint": joint, "part": part, "robot_id": robot_id,
            "rmse_nm": rmse, "r_squared": 1.0 - rmse / 20.0, "activity_id": fitted_by,
        }  # fmt: skip
    yield "twin_run", {"twin_id": twin_id, "run_id": run_id, "part": part, "activity_id": fitted_by}
    yield from _activity(energy, robot_id, "energy", f"run/{run_id}", [f"run/{run_id}", f"twin/{twin_id}"])
    yield from _activity(meter, robot_id, METER, f"run/{run_id}", [f"series/{series[0]}/{run_id}"])
    ledger = _ledger(draw, standby * seconds, burns)
    modelled = sum(ledger.values())
    measured = modelled * (1.0 + drift + draw.gauss(0.0, 0.02))
    returned = modelled * draw.uniform(0.0, 0.15)
    yield "run_energy", {
        "run_id": run_id, "twin_id": twin_id, "part": part, "energy_consumption_j": measured, "energy_from": "measured",
        "run_power_w": measured / seconds, "peak_power_w": 3.0 * measured / seconds, "measured_energy_j": measured,
        "modelled_energy_j": modelled, "energy_error_percent": 100.0 * abs(modelled - measured) / measured,
        "power_rmse_w": draw.uniform(5.0, 30.0), "standby_energy_j": standby * seconds,
        "standby_share": standby * seconds / modelled, "returned_energy_j": returned, "activity_id": energy,
        "taken_activity_id": meter,
    }  # fmt: skip
    for (effect, joint), value in ledger.items():
        yield "energy_share", {
            "twin_id": twin_id, "run_id": run_id, "effect": effect, "place": joint or "robot", "joint": joint or None,
            "robot_id": robot_id, "energy_j": value, "activity_id": energy,
        }  # fmt: skip
    for joint in JOINTS:
        yield "joint_energy", {
            "run_id": run_id, "joint": joint, "robot_id": robot_id, "activity_id": energy,
            "energy_j": sum(value for (_, at), value in ledger.items() if at == joint),
        }  # fmt: skip


def _ledger(draw: random.Random, standby: float, burns: bool) -> dict[tuple[str, str], float]:
    moving = standby * draw.uniform(0.2, 1.2)
    weights = {joint: draw.uniform(0.5, 1.5) / position for position, joint in enumerate(JOINTS, 1)}
    unit = moving / 0.62 / sum(weights.values())
    shares = {(e, joint): share * unit * weights[joint] for e, (share, *_) in EFFECTS.items() for joint in JOINTS}
    return shares | {("standby_power", ""): standby} | ({("no_regeneration", ""): 0.05 * moving} if burns else {})


def _diagnosis(draw: random.Random, robot_id: str, verdict: str, names: list[str]) -> Iterator[Row]:
    made = f"diagnosis.{robot_id}"
    diagnosis_id = f"{robot_id}.{draw.getrandbits(48):012x}"
    of = {"diagnosis_id": diagnosis_id, "activity_id": made}
    at = of | {"robot_id": robot_id}
    used = [f"run/{run_id}" for run_id in names[:40]]
    yield from _activity(made, robot_id, "diagnosis", f"robot/{robot_id}", used)
    checksum = f"{draw.getrandbits(256):064x}"
    yield "gap_diagnosis", at | {
        "verdict": verdict, "created": _text(BEGIN + timedelta(days=91)),
        "energy_error_percent": draw.uniform(1.0, 12.0), "noise_floor_from": "repeats",
        "file": f"diagnoses/{diagnosis_id}.json", "sha256": checksum,
        "evidence_file": f"diagnoses/{diagnosis_id}.evidence.json", "evidence_sha256": checksum,
        "twin_file": f"diagnoses/{diagnosis_id}.twin.json", "twin_sha256": checksum,
    }  # fmt: skip
    for place in [*JOINTS, None]:
        yield "gap_size", at | {
            "channel": "torque" if place else "power", "place": place or "robot", "joint": place,
            "rmse": draw.uniform(0.4, 2.0), "noise_floor": 0.4, "excess": draw.uniform(0.0, 9.0),
            "unit": "N m" if place else "W",
        }  # fmt: skip
    for run_id in names[20:40]:
        yield "gap_held_out", of | {"run_id": run_id}
    for number, effect in enumerate(["payload", "temperature_dependent_friction", "backlash", "cable_drag"], 1):
        yield "gap_not_testable", of | {"number": number, "effect": effect, "why": "the motion does not show it"}
    if verdict == "no_gap":
        return
    for rank, joint in enumerate(draw.sample(JOINTS, 3), 1):
        yield "gap_location", at | {
            "location_id": f"torque@{joint}:low_speed", "rank": rank,
            "channel": "torque", "joint": joint, "regime": "low_speed", "follows": "speed",
            "share": 0.6 / rank, "share_lower": 0.3 / rank, "share_upper": 0.8 / rank, "excess": 9.0,
            "excess_lower": 5.0, "excess_upper": 12.0, "concentration": 2.0, "false_discovery_rate": 0.01,
        }  # fmt: skip
    yield "gap_shrinkage", of | {"closed_fraction": draw.uniform(0.3, 0.97), "lower": 0.2, "upper": 0.99}
    for measure, unit in [("torque_rmse", "N m"), ("power_rmse", "W"), ("energy_error_percent", "%")]:
        yield "gap_change", of | {
            "measure": measure, "part": "together", "place": "all", "before": 2.0, "after": 0.7, "noise_floor": 0.4,
            "lower": 0.6, "upper": 0.8, "unit": unit,
        }  # fmt: skip
    if verdict != "unexplained":
        yield from _causes(draw, robot_id, verdict, of)


def _causes(draw: random.Random, robot_id: str, verdict: str, of: dict[str, Any]) -> Iterator[Row]:
    causes = draw.sample(["stribeck_friction", "viscous_friction", "coulomb_friction", "payload"], 2)
    for rank, effect in enumerate(causes, 1):
        confidence = draw.uniform(0.4, 0.99)
        joint = None if effect == "payload" else draw.choice(JOINTS)
        named = of | {"cause_id": f"{effect}@{joint}" if joint else effect}
        scope = "missing" if verdict == "ambiguous" else "changed"
        yield "gap_cause", named | {
            "robot_id": robot_id, "rank": rank, "effect": effect, "scope": scope, "channel": "torque",
            "confidence": confidence, "share_of_closed": 0.5, "closed_where_it_acts": 0.8,
            "gain": 2.0, "log_odds": 5.0,
        }  # fmt: skip
        if joint:
            yield "gap_cause_joint", named | {"robot_id": robot_id, "joint": joint}
        if verdict == "ambiguous":
            yield "gap_cause_rival", named | {"effect": causes[2 - rank]}
        value = draw.uniform(0.05, 3.0)
        name, unit = {"payload": ("m", "kg"), "viscous_friction": ("Fv", "N m s/rad")}.get(effect, ("Fc", "N m"))
        yield "gap_cause_parameter", named | {
            "robot_id": robot_id, "number": 1, "joint": joint, "name": name, "value": value, "unit": unit,
            "lower": value - 0.5, "upper": value + 0.5,
        }  # fmt: skip
    if verdict == "ambiguous":
        yield "gap_experiment", of | {"purpose": f"tell {causes[0]} from {causes[1]}", "enough": 5.0}
        yield "gap_experiment_instruction", of | {"number": 1, "text": "a ladder of 8 constant speeds, each both ways"}
        for effect in causes:
            yield "gap_experiment_effect", of | {"effect": effect}


def _text(moment: datetime) -> str:
    return moment.isoformat(sep=" ", timespec="microseconds")


def make_database(place: Path, robots: int, runs: int) -> None:
    """Write the fleet into the workspace's database, table by table as the rows come."""
    Workspace(place).close()
    columns = {name: [column.name for column in table.columns] for name, table in Base.metadata.tables.items()}
    texts = {name: f"INSERT INTO {name} VALUES ({', '.join('?' * len(of))})" for name, of in columns.items()}
    waiting: dict[str, list[list[Any]]] = {name: [] for name in columns}
    with sqlite3.connect(place / "irtwin.db") as connection:
        connection.execute("PRAGMA synchronous = OFF")
        for table, values in rows(robots, runs):
            waiting[table].append([values.get(column) for column in columns[table]])
            if len(waiting[table]) == 20_000:
                connection.executemany(texts[table], waiting[table])
                waiting[table].clear()
        for table, left in waiting.items():
            connection.executemany(texts[table], left)


def make_graph(place: Path) -> int:
    """Map the database, reason and validate as `irtwin run` does; return the number of triples."""
    with Workspace.existing(place) as workspace, KnowledgeGraph(workspace.graph_folder, place) as graph:
        graph.load_ontology()
        rewriting.map_rows(workspace, graph)
        rewriting.conclude(graph, print)
        return int(graph.query("SELECT (COUNT(*) AS ?count) { ?s ?p ?o }").rows[0]["count"])


def main(place: Path, robots: int = 100, runs: int = 1000) -> None:
    began = time.perf_counter()
    make_database(place, robots, runs)
    print(f"{robots} robots, {runs} runs each: database in {time.perf_counter() - began:.0f} s", flush=True)
    began = time.perf_counter()
    print(f"{make_graph(place):,} triples in {time.perf_counter() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))

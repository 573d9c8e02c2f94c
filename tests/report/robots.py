"""Robots in a graph, with series: what a report can be given. Numbers are made up, and known."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyarrow as pa
from pyoxigraph import NamedNode, Quad, RdfFormat, parse

from irtwin import resources
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, SH
from irtwin.knowledge.vocabulary import PREFIXES as KNOWN
from irtwin.report.questions import Answer, Answers, PageQuestion, ask, read_questions

PREFIXES = "".join(f"@prefix {name}: <{place}> .\n" for name, place in (KNOWN | {"sh": SH}).items())
EFFECTS = ("rigid_body", "coulomb_friction", "viscous_friction", "standby_power")


@dataclass
class Factory:
    """Writes individuals as Turtle and keeps their series."""

    robot_id: str
    name: str
    joints: int = 6
    torque: bool = True
    power: bool = True
    simulated: bool = False
    seed: int = 1
    joint_name: str = "joint_{}"
    scale_why: str | None = None  # how sure the scale of the twin's torque is
    text: list[str] = field(default_factory=list)
    inferred: list[str] = field(default_factory=list)
    series: dict[str, pa.Table] = field(default_factory=dict)

    @property
    def iri(self) -> str:
        return f"{ID}robot/{self.robot_id}"

    @property
    def names(self) -> list[str]:
        return [self.joint_name.format(number) for number in range(1, self.joints + 1)]

    def say(self, text: str) -> None:
        self.text.append(text)

    def robot(self, note: Mapping[str, str] | None = None, facts: bool = True) -> Factory:
        more = 'irt:Manufacturer "Maker" ; irt:IR_Type "articulated" ; irt:IR_Weight 50.0e0 ; irt:Rated_Payload 6.0e0 ;'
        self.say(
            f"<{self.iri}> a irt:Industrial_Robot ; irt:has_Information <{self.iri}/information> ."
            f"<{self.iri}/information> a irt:IR_Information ; irt:IR_Name {_text(self.name)} ;"
            f' irt:Controlled_Axes {self.joints} ; {more if facts else ""} irt:Power_Measured_At "mains" ;'
            f" irt:Simulated {str(self.simulated).lower()}."
        )
        for name, said in (note or {}).items():
            self.say(
                f"[] a irt:Robot_Note ; irt:note_of <{self.iri}> ;"
                f" irt:Note_Name {_text(name)} ; irt:Note_Text {_text(said)} ."
            )
        for number, name in enumerate(self.names, 1):
            self.say(
                f"<{self.iri}> irt:has_Joint {self._joint(number)} . {self._joint(number)} a irt:Robot_Joint ;"
                f' irt:Joint_Name {_text(name)} ; irt:Joint_Number {number} ; irt:Joint_Kind "revolute" ;'
                f" irt:Lower_Limit -2.967e0 ; irt:Upper_Limit 2.967e0 ; irt:Speed_Limit {6.28 + number}e0 ;"
                f" irt:Gear_Ratio {100 - 10 * number}.0e0 ."
            )
        return self

    def run(self, name: str, role: str = "observed", day: int = 1) -> Factory:
        run = self._run(name)
        self.say(
            f"<{self.iri}> irt:has_RunProcess {run} . {run} a irt:IR_RunProcess ; irt:Run_Name {_text(name)} ;"
            f' irt:Run_Role "{role}" ; irt:Payload 3.0e0 ; irt:Run_Time 20.0e0 ; irt:Sample_Rate 100.0e0 ;'
            " irt:Sample_Count 2000 ;"
            f' irt:Start_Time "2026-03-{day:02}T08:00:00Z"^^xsd:dateTime ; irt:Start_Time_From "log" ;'
            f" irt:Idle_Share 0.25e0 ; irt:has_Series <{run[1:-1]}/measured> ."
            f'<{run[1:-1]}/measured> a irt:Series ; irt:Series_Kind "measured" ; irt:File "series/m_{name}.parquet" ;'
            f' irt:Checksum "{_checksum("m" + name)}" ; irt:Row_Count 2000 .'
        )
        return self

    def twin(self, fit: Sequence[str], held_out: Sequence[str], both: Sequence[str] = ()) -> Factory:
        effects = ", ".join(f"effect:{effect}" for effect in EFFECTS)
        self._activity("identification", 5)
        self._activity("energy", 3)
        self.say(
            f"<{self.iri}> irt:has_Twin {self._twin} . {self._twin} a irt:Energy_Twin ; irt:has_Effect {effects} ;"
            ' irt:Created "2026-03-09T09:00:00Z"^^xsd:dateTime ; irt:Cutoff_Frequency 10.0e0 ;'
            ' irt:Cutoff_Reason "found: 10 times the bandwidth of the motion" ;'
            " irt:Condition_Number 83.2e0 ; irt:Base_Parameter_Count 36 ;"
            f' irt:Data_Split "fitted on {len(fit)} runs, held out {len(held_out)}" ;'
            f' irt:Checksum "{"ab" * 32}" ; prov:wasGeneratedBy {self._act("identification")} .'
        )
        if self.scale_why:
            self.say(f"{self._twin} irt:Torque_Scale_Reason {_text(self.scale_why)} .")
        self._parameters()
        for part, runs in (("fit", fit), ("held_out", held_out), ("both", both)):
            for index, name in enumerate(runs):
                self._fits(name, part)
                self._energy(name, part, 2.0 + index)
        return self

    def conclude(self, idle: str, twin: bool = False) -> Factory:
        run = self._run(idle)
        self.inferred.append(f"{run} a irt:Idle_Heavy_Run ; irt:dominant_Joint {self._joint(2)} .")
        if twin:
            self.inferred.append(f"{self._twin} a irt:Twin_To_Reidentify ; irt:fails_on {run} .")
        return self

    def into(self, graph: KnowledgeGraph) -> Factory:
        base = "https://w3id.org/irtwin/graph/"
        for name, text in ((f"source/{self.robot_id}", self.text), (f"inferred/swrl/{self.robot_id}", self.inferred)):
            triples = parse(input=PREFIXES + "\n".join(text), format=RdfFormat.TURTLE)
            graph.replace([Quad(*quad.triple, NamedNode(base + name)) for quad in triples], base + name)
        return self

    def read_series(self, path: str, checksum: str) -> pa.Table:
        return self.series[path]

    def _fits(self, name: str, part: str) -> None:
        if not self.torque:
            return
        for which in ("fit", "held_out") if part == "both" else (part,):
            for number in range(1, self.joints + 1):
                r2 = (0.99 if which == "fit" else 0.965) - 0.01 * (number - 1)
                self.say(
                    f"[] a irt:Torque_Fit ; irt:fit_of {self._twin} ; irt:of_Run {self._run(name)} ; irt:Fit_Part"
                    f' "{which}" ; irt:of_Joint {self._joint(number)} ; irt:R_Squared {r2:.3f}e0 ;'
                    f" irt:Torque_RMSE {8.0 / number:.3f}e0 ."
                )

    def _energy(self, name: str, part: str, error: float) -> None:
        run = self._run(name)
        modelled = 9000.0
        measured = modelled / (1 + error / 100)
        if self.power:
            self.say(
                f"{run} irt:Measured_Energy {measured:.2f}e0 ; irt:Energy_Error {error}e0 ; irt:Power_RMSE 21.5e0 ."
            )
        self.say(
            f'{run} irt:modelled_by {self._twin} ; irt:Part_In_Twin "{part}" ; irt:Modelled_Energy {modelled}e0 ;'
            f" irt:Energy_Consumption {measured if self.power else modelled:.2f}e0 ;"
            f' irt:Energy_From "{"measured" if self.power else "mechanical"}" ; irt:Run_Power 450.0e0 ;'
            " irt:Peak_Power 1210.0e0 ; irt:Standby_Energy 3000.0e0 ; irt:Standby_Share 0.3333e0 ; irt:Returned_Energy"
            f" 120.0e0 ; irt:has_Series <{run[1:-1]}/modelled> ."
            f'<{run[1:-1]}/modelled> a irt:Series ; irt:Series_Kind "modelled" ; irt:File "series/{name}.parquet" ;'
            f' irt:Checksum "{_checksum(name)}" ; irt:Row_Count 2000 ; prov:wasGeneratedBy {self._act("energy")} .'
        )
        self._share(run, "standby_power", None, 3000.0)
        for number in range(1, self.joints + 1):
            of_joint = 6000.0 * 2 / (self.joints * (self.joints + 1)) * (self.joints + 1 - number)
            self._share(run, "rigid_body", number, -0.1 * of_joint)
            self._share(run, "coulomb_friction", number, 0.5 * of_joint)
            self._share(run, "viscous_friction", number, 0.6 * of_joint)
            self.say(
                f"[] a irt:Joint_Energy ; irt:of_Run {run} ; irt:of_Joint {self._joint(number)} ;"
                f" irt:Energy {of_joint}e0 ."
            )
        self.series[f"series/{name}.parquet"] = self._samples()

    def _share(self, run: str, effect: str, number: int | None, energy: float) -> None:
        joint = f"irt:of_Joint {self._joint(number)} ;" if number else ""
        self.say(
            f"[] a irt:Energy_Share ; irt:of_Run {run} ; irt:by_Twin {self._twin} ; irt:of_Effect effect:{effect} ;"
            f" {joint} irt:Energy {energy}e0 ."
        )

    def _parameters(self) -> None:
        for number in range(1, self.joints + 1):
            for effect, name, unit, value in (
                ("coulomb_friction", "Fc", "N-M", 7.14 / number),
                ("viscous_friction", "Fv", "N-M-SEC-PER-RAD", 8.05 / number if number < 6 else 0.02),
            ):
                self._parameter(effect, name, unit, value, f"irt:of_Joint {self._joint(number)} ;")
        for number in range(1, 13):
            self._parameter("rigid_body", f"base_{number}", "KiloGM-M2", 0.5 * number, "")
        self._parameter("standby_power", "P0", "W", 150.0, "")

    def _parameter(self, effect: str, name: str, unit: str, value: float, joint: str) -> None:
        scaled = f"; irt:Scaled_Interval_Lower {0.9 * value}e0 ; irt:Scaled_Interval_Upper {1.1 * value}e0"
        if self.scale_why is None or unit == "W":
            scaled = ""
        self.say(
            f"[] a irt:Twin_Parameter ; irt:parameter_of {self._twin} ; irt:of_Effect effect:{effect} ; {joint}"
            f' irt:Parameter_Name "{name}" ; irt:Parameter_Value {value}e0 ; qudt:hasUnit unit:{unit} ;'
            f" irt:Interval_Lower {value - 0.1}e0 ; irt:Interval_Upper {value + 0.1}e0 {scaled} ."
        )

    def _activity(self, provider: str, minute: int) -> None:
        self.say(
            f"{self._act(provider)} a irt:Provider_Activity ; prov:wasAssociatedWith provider:{provider} ;"
            f' irt:Software "irtwin 0.1.0" ; prov:startedAtTime "2026-03-09T09:0{minute}:00Z"^^xsd:dateTime ;'
            f' prov:endedAtTime "2026-03-09T09:0{minute}:12Z"^^xsd:dateTime ; prov:wasInformedBy {self._run("x")} .'
        )

    def _samples(self) -> pa.Table:
        random = np.random.default_rng(self.seed)
        self.seed += 1
        time = np.linspace(0.0, 20.0, 5_000)
        columns = {"time": time}
        speed = np.zeros_like(time)
        for number, name in enumerate(self.names, 1):
            phase = random.uniform(0, 6, 3)
            q = sum(np.sin((k + 1) * 0.63 * time + phase[k]) / (k + 1) for k in range(3))
            dq = np.gradient(q, time)
            model = 60 / number * np.cos(q) + 9 / number * np.tanh(20 * dq) + 4 / number * dq
            columns[f"q_{name}"] = q
            if self.torque:
                columns[f"tau_{name}"] = model + random.normal(0, 3 / number, time.size)
            columns[f"tau_{name}_model"] = model
            speed = speed + np.abs(dq)
        power = 150 + 60 * speed
        columns |= {"power_model": power, "energy_model": np.cumsum(power) * (time[1] - time[0])}
        if self.power:
            measured = power * random.uniform(0.95, 1.05) + random.normal(0, 15, time.size)
            columns |= {"power": measured, "energy": np.cumsum(measured) * (time[1] - time[0])}
        return pa.table(columns)

    @property
    def _twin(self) -> str:
        return f"<{ID}twin/{self.robot_id}.1a2b>"

    def _run(self, name: str) -> str:
        return f"<{ID}run/{self.robot_id}.{name}>"

    def _joint(self, number: int) -> str:
        return f"<{ID}joint/{self.robot_id}/{number}>"

    def _act(self, provider: str) -> str:
        return f"<{ID}activity/{provider}.{self.robot_id}>"


def six_axis(graph: KnowledgeGraph, runs: int = 6, scale_why: str | None = None) -> Factory:
    """A robot of six axes with torque and power; the last third of its runs is held out."""
    factory = Factory("KUKA_KR6_R700", "KUKA_KR6_R700", simulated=True, scale_why=scale_why)
    factory.robot(note={"torque": "motor current times torque constant", "supply": "3 x 400 V"})
    names = [f"exciting_{k}" if k % 2 else f"cycle_{k}" for k in range(1, runs + 1)]
    for index, name in enumerate(names):
        factory.run(name, role="reference" if index < runs // 2 else "observed", day=1 + index % 3)
    cut = runs - max(1, runs // 3)
    return factory.twin(names[:cut], names[cut:]).conclude(names[-1], twin=True).into(graph)


def power_only(graph: KnowledgeGraph) -> Factory:
    """A robot with power and no torque, and one run cut in time."""
    factory = Factory("UR3", "UR3", torque=False, power=True)
    return factory.robot(facts=False).run("pick").twin([], [], both=["pick"]).into(graph)


PageOf = Callable[[Factory], str]


def answers(graph: KnowledgeGraph, factory: Factory, twin: bool = True) -> Answers:
    """Ask all questions of the report about a robot, and its twin where it has one."""
    bindings = {"robot": factory.iri}
    if twin:
        bindings["twin"] = f"{ID}twin/{factory.robot_id}.1a2b"
    return ask(graph, read_questions((resources.folder("reports") / "energy").glob("*.rq")), bindings)


def answered(rows: Mapping[str, Iterable[Mapping[str, Any]]]) -> Answers:
    """Give rows as what questions of these names were answered."""
    return {name: Answer(PageQuestion(name, "", (), ""), tuple(of)) for name, of in rows.items()}


def instead(answers: Answers, **rows: Iterable[Mapping[str, Any]]) -> Answers:
    """Return answers with other rows to some questions."""
    return {**answers, **{name: replace(answers[name], rows=tuple(of)) for name, of in rows.items()}}


def _checksum(name: str) -> str:
    return (name.encode().hex() * 64)[:64]


def _text(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'

"""Withhold what is known to act on measured robots: `python bench/withheld.py DATA_FOLDER [--out PAGE.md]`.

A twin is robbed of an effect (`diagnose --withhold`), and the diagnosis has to name it. Measured robots have other gaps
too. So it is done both ways: with the default twin, each answer beside that of the whole twin on the same data; and
with the twin adopted first (`diagnose --save-twin`, then `--twin`), so that those gaps are closed. Shams, in which
nothing is missing, say how often an effect is named for nothing.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from blind.score import wilson
from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Effect
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import DataSet, read_data_set
from irtwin.twin.files import from_json, to_json
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin
from irtwin.twin.validate import validate
from sham import BLOCK, sham

WITHHELD = {
    "staubli_tx40": ("viscous_friction", "coulomb_friction", "rotor_inertia"),
    "ur10": ("coulomb_friction", "viscous_friction"),
    "franka_panda": ("coulomb_friction", "viscous_friction"),
    "ur3_power": ("standby_power", "mechanical_power"),
}
COUPLED = "staubli_tx40"  # its wrist, which the default twin lacks
# as its publishers give them (figaroh-plus, examples/staubli_TX40), joint by joint
PUBLISHED = {
    "viscous_friction": ("Fv", "N m s/rad", (8.05, 5.53, 1.97, 1.11, 1.86, 0.65)),
    "coulomb_friction": ("Fc", "N m", (7.14, 8.26, 6.34, 2.48, 3.03, 0.28)),
}
PUBLISHED_COUPLING = {"Ia": 0.0096, "Fv": 0.616, "Fc": 1.95}
MATTERS = 1.05  # times the RMS residual that is left at a joint with the effect, where that is left without it


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says, `document` in the form of its schema, and after how long, s of the processor."""

    document: dict[str, Any]
    seconds: float

    def place(self, effect: str) -> int | None:
        """Return the effect's rank among the causes, from 1."""
        return next((k for k, cause in enumerate(self.document["causes"], start=1) if cause["effect"] == effect), None)

    def cause(self, effect: str) -> dict[str, Any] | None:
        """Return the cause that names the effect."""
        return next((cause for cause in self.document["causes"] if cause["effect"] == effect), None)

    @property
    def family_first(self) -> str | None:
        """The family of the first cause."""
        return catalogue()[self.named[0]].family if self.named else None

    def stands_for(self, effect: str) -> str | None:
        """Return the cause that names the effect as its rival, where none is the effect itself."""
        causes = [cause["effect"] for cause in self.document["causes"] if effect in cause["indistinguishable_from"]]
        return causes[0] if causes and self.place(effect) is None else None

    def place_among_new(self, effect: str, before: Sequence[str]) -> int | None:
        """Return the effect's rank among the causes that are not those of `before`."""
        new = [name for name in self.named if name == effect or name not in before]
        return new.index(effect) + 1 if effect in new else None

    @property
    def named(self) -> list[str]:
        """The effects of the causes, in their order."""
        return list(dict.fromkeys(cause["effect"] for cause in self.document["causes"]))


@dataclass(frozen=True)
class Adopted:
    """The answers with the adopted twin: of it as it is, and by the effect withheld; where each matters in it."""

    plain: Answer
    withheld: dict[str, Answer]
    matters: dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class Robot:
    """The answers about one robot: of the whole default twin, and by the effect withheld; where each effect matters."""

    name: str
    joints: tuple[str, ...]
    plain: Answer
    withheld: dict[str, Answer]
    matters: dict[str, tuple[str, ...]]
    adopted: Adopted
    shams: dict[str, list[list[str]]] = field(default_factory=dict)  # structure: effects named in each sham


def examine(folder: Path) -> tuple[Robot, Twin]:
    """Diagnose the data set with the whole twin and without each effect; return the twin with its causes too."""
    data_set, effects = read_data_set(folder), WITHHELD[folder.name]
    plain, full = _answered(data_set)
    assert full is not None
    given = from_json(to_json(full), Path("twin.json"))  # as `diagnose --save-twin` and `--twin` hand it on
    withheld = {effect: answer(data_set, (effect,)) for effect in effects}
    robbed = {effect: answer(data_set, (effect,), given) for effect in effects}
    matters = [
        {effect: where_it_matters(data_set, effect, twin) for effect in effects}
        for twin in (BASELINE, given.stack.effects)
    ]
    adopted = Adopted(answer(data_set, (), given), robbed, matters[1])
    return Robot(folder.name, data_set.robot.joint_names, plain, withheld, matters[0], adopted), given


def blame(folder: Path, full: Twin, seeds: Sequence[int]) -> dict[str, list[list[str]]]:
    """Return the effects named in each sham of the data set, by the twin that the shams obey."""
    data_set = read_data_set(folder)
    return {
        name: [answer(sham(data_set, truth, full, seed, centred=centred)).named for seed in seeds]
        for name, (truth, centred) in nulls(data_set, full).items()
    }


def answer(data_set: DataSet, withhold: Sequence[str] = (), twin: Twin | None = None) -> Answer:
    """Diagnose, against a twin if one is given, and take the time."""
    return _answered(data_set, withhold, twin)[0]


def _answered(data_set: DataSet, withhold: Sequence[str] = (), twin: Twin | None = None) -> tuple[Answer, Twin | None]:
    """Return the answer, and the twin with its causes."""
    started = time.process_time()
    diagnosis = diagnose(data_set, twin=twin, withhold=withhold)
    return Answer(diagnosis.to_json(), time.process_time() - started), diagnosis.twin


def nulls(data_set: DataSet, full: Twin) -> dict[str, tuple[Twin, bool]]:
    """Return, by what they are, the twins that shams obey, and whether the runs' mean residuals are taken out.

    The default twin, and that with the causes found, in their default shapes; where there are several runs, the
    default one without the runs' means too.
    """
    motions = [condition(run, full.robot, full.cutoff) for run in data_set.runs]
    known = catalogue()

    def fitted(effects: Sequence[str]) -> Twin:
        return identify(full.robot, motions, [known[each] for each in effects])

    default = fitted(BASELINE)
    found = {"default twin": (default, False)}
    if set(full.effect_ids) - set(BASELINE):
        found["with the causes"] = (fitted(full.effect_ids), False)
    if len(data_set.runs) > 1:
        found["default twin, runs' means out"] = (default, True)
    return found


def where_it_matters(data_set: DataSet, effect: str, twin: Sequence[str | Effect] = BASELINE) -> tuple[str, ...]:
    """Return the joints at which a twin of some effects needs this one: without it there, some joint fits worse.

    Joint by joint: where an effect is left out of all, bodies and friction that make up for it spoil joints that never
    needed it.
    """
    if catalogue()[effect].signal != "torque":
        return ()
    robot, cutoff = data_set.robot, choose_cutoff(data_set.runs)
    motions = [condition(run, robot, cutoff) for run in data_set.runs]

    def left(effects: Sequence[str | Effect]) -> np.ndarray:
        fits = validate(identify(robot, motions, effects), motions)
        return np.sqrt(np.mean([fit.torque_rmse**2 for fit in fits if fit.torque_rmse is not None], axis=0))

    whole = left(twin)
    worse = {name: (left(_without(twin, effect, name, robot.joint_names)) / whole).max() for name in robot.joint_names}
    return tuple(name for name, ratio in worse.items() if ratio >= MATTERS)


def _without(twin: Sequence[str | Effect], effect: str, joint: str, joints: Sequence[str]) -> list[str | Effect]:
    """Return the effects of a twin, this one at the other joints alone."""
    found: list[str | Effect] = []
    for each in twin:
        if (each if isinstance(each, str) else each.id) != effect:
            found.append(each)
            continue
        one = catalogue()[each] if isinstance(each, str) else each
        rest = [name for name in one.joints or joints if name != joint]
        found += [one.on(*rest)] if rest else []
    return found


def page(robots: Sequence[Robot], missing: Sequence[str], command: str) -> str:
    """Return the page of results."""
    lines = [
        "# Effects withheld from measured robots",
        "",
        f"`{command}`, {date.today().isoformat()}; how it is done stands in `withheld.py`, and where the logs come "
        "from with the data.",
        "",
        *_summary(robots),
        "",
        *_both_ways(robots),
        "",
        "## Each effect withheld from the default twin",
        "",
        f"A joint counts where leaving the effect out there raises the RMS residual of the default twin at some joint "
        f"by {100 * (MATTERS - 1):.0f} % or more. New are causes that the whole twin's diagnosis does not give.",
        "",
        "| robot | withheld | verdict | place | among new | joints right | missed | besides | confidence "
        "| not told apart from | gap closed, 95 % interval | processor, s |",
        "| --- " * 12 + "|",
        *(line for robot in robots for line in _rows(robot)),
        "",
        "## What else is named",
        "",
        "| robot | withheld | causes, in their order (new ones **bold**) |",
        "| --- | --- | --- |",
        *(line for robot in robots for line in _beside(robot)),
        *(line for robot in robots if robot.name == COUPLED for line in _published(robot)),
        "",
        *(_shams(robots) if any(robot.shams for robot in robots) else ["No shams were run."]),
    ]
    if missing:
        lines += ["", f"Not in the data folder, or not run yet: {', '.join(missing)}."]
    return "\n".join(lines) + "\n"


def _summary(robots: Sequence[Robot]) -> list[str]:
    pairs = [(answer, effect) for robot in robots for effect, answer in robot.withheld.items()]
    first = sum(answer.place(effect) == 1 for answer, effect in pairs)
    somewhere = sum(answer.place(effect) is not None for answer, effect in pairs)
    in_class = sum(answer.place(effect) == 1 or _leads_with(answer, effect) for answer, effect in pairs)
    on_top = sum(
        answer.place_among_new(effect, robot.plain.named) == 1
        for robot in robots
        for effect, answer in robot.withheld.items()
    )
    lines = [
        f"Of {len(pairs)} effects withheld, the one withheld is the first cause in {first}, in the first cause's class "
        f"in {in_class}, the first of the causes that the whole twin's diagnosis does not give in {on_top}, and named "
        f"by some cause in {somewhere}.",
    ]
    coupled = next((robot for robot in robots if robot.name == COUPLED), None)
    if coupled:
        place = coupled.plain.place("joint_coupling")
        lines[0] += f" TX40's wrist coupling, which nobody withheld, is {_place(place)}."
    return lines


def _both_ways(robots: Sequence[Robot]) -> list[str]:
    """Return the answers with the default twin beside those with the adopted one, and how many are right."""
    ways = [
        [(robot.withheld[effect], effect, robot.matters[effect]) for robot in robots for effect in robot.withheld],
        [
            (one, effect, robot.adopted.matters[effect])
            for robot in robots
            for effect, one in robot.adopted.withheld.items()
        ],
    ]
    names = [robot.name for robot in robots for _ in robot.withheld]
    lines = [
        "## Both ways",
        "",
        "With the default twin, and with the adopted one: the data set is diagnosed, the twin with its causes taken, "
        "the effect taken out of that, and the same data diagnosed again. First: the effect withheld is the first "
        "cause. Family: the first cause is of its family. Joints: all are named on which it matters to that twin; with "
        "a plus those named besides.",
        "",
        "| right with | first | family first | joints |",
        "| --- | --- | --- | --- |",
    ]
    for title, way in zip(("the default twin", "the adopted twin"), ways, strict=True):
        judged = [_judged(*one) for one in way]
        counts = [f"{sum(one[k] for one in judged)} of {len(way)}" for k in range(3)]
        lines.append(f"| {title} | " + " | ".join(counts) + " |")
    lines += [
        "",
        "| robot | withheld | default twin | first cause | joints | adopted twin | first cause | joints |",
        "| --- " * 8 + "|",
    ]
    for name, *pair in zip(names, *ways, strict=True):
        cells = [cell for one in pair for cell in _seen(*one)]
        lines.append(f"| {name} | {pair[0][1]} | " + " | ".join(cells) + " |")
    lines += ["", "What is named with the adopted twin as it is: " + "; ".join(_left(robot) for robot in robots) + "."]
    return lines


def _judged(answer: Answer, effect: str, where: Sequence[str]) -> tuple[bool, bool, bool]:
    """Return whether the effect is first, its family is, and the joints are right."""
    cause = answer.cause(effect)
    family = answer.family_first == catalogue()[effect].family
    return answer.place(effect) == 1, family, cause is not None and set(where) <= set(cause["joints"])


def _seen(answer: Answer, effect: str, where: Sequence[str]) -> list[str]:
    cause = answer.cause(effect)
    joints = cause["joints"] if cause else []
    besides = len(set(joints) - set(where))
    hit = f"{len(set(where) & set(joints))} of {len(where)}" + (f" (+{besides})" if besides else "")
    first = f"{answer.named[0]} ({answer.family_first})" if answer.named else answer.document["verdict"]
    return [_place(answer.place(effect)), first, hit if where or besides else "-"]


def _left(robot: Robot) -> str:
    return f"{robot.name} {_listed(robot.adopted.plain, set(), '') or robot.adopted.plain.document['verdict']}"


def _leads_with(answer: Answer, effect: str) -> bool:
    causes = answer.document["causes"]
    return bool(causes) and effect in (causes[0]["effect"], *causes[0]["indistinguishable_from"])


def _place(place: int | None) -> str:
    return "not named" if place is None else f"cause {place}"


def _rows(robot: Robot) -> list[str]:
    lines = []
    for effect, answer in robot.withheld.items():
        cause, where = answer.cause(effect), robot.matters[effect]
        stand_in = answer.stands_for(effect)
        place = f"rival of {stand_in}" if stand_in else _place(answer.place(effect))
        joints = cause["joints"] if cause else []
        hit = [joint for joint in where if joint in joints]
        cells = [
            robot.name,
            effect,
            answer.document["verdict"],
            place,
            _place(answer.place_among_new(effect, robot.plain.named)),
            f"{len(hit)} of {len(where)}" if where else "-",
            ", ".join(joint for joint in where if joint not in joints) or "-",
            ", ".join(joint for joint in joints if joint not in where) or "-",
            f"{cause['confidence']:.2f}" if cause else "-",
            ", ".join(cause["indistinguishable_from"]) or "none" if cause else "-",
            _closed(answer),
            f"{answer.seconds:.1f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _closed(answer: Answer) -> str:
    closed = answer.document["shrink"]["closed_fraction"]
    if not closed:
        return "-"
    low, high = closed["interval95"]
    return f"{closed['value']:.3f} ({low:.3f} ... {high:.3f})"


def _beside(robot: Robot) -> list[str]:
    before = set(robot.plain.named)
    lines = [f"| {robot.name} | nothing | {_listed(robot.plain, set(), '') or robot.plain.document['verdict']} |"]
    for effect, answer in robot.withheld.items():
        lines.append(f"| {robot.name} | {effect} | {_listed(answer, before, effect)} |")
    return lines


def _listed(answer: Answer, before: set[str], withheld: str) -> str:
    parts = []
    for cause in answer.document["causes"]:
        new = withheld and cause["effect"] not in {*before, withheld}
        name = f"**{cause['effect']}**" if new else cause["effect"]
        parts.append(f"{name} ({', '.join(cause['joints']) or 'robot'}; {cause['confidence']:.2f})")
    return ", ".join(parts)


def _published(robot: Robot) -> list[str]:
    lines = [
        "",
        "## TX40 against what is published",
        "",
        "Each with its 95 % interval. Coulomb and viscous friction come from the diagnosis without them; a joint on "
        "which another form of friction was named has that form's share of them instead.",
        "",
        "| | " + " | ".join(robot.joints) + " |",
        "| --- " * (len(robot.joints) + 1) + "|",
    ]
    for effect, (name, unit, values) in PUBLISHED.items():
        lines.append(f"| {name}, {unit}, published | " + " | ".join(f"{value:.2f}" for value in values) + " |")
        cause = robot.withheld[effect].cause(effect) if effect in robot.withheld else None
        found = {each["joint"]: each for each in cause["parameters"] if each["name"] == name} if cause else {}
        cells = [_quantity(found[joint]) if joint in found else "-" for joint in robot.joints]
        lines.append(f"| {name}, {unit}, {effect} withheld | " + " | ".join(cells) + " |")
    coupling = robot.plain.cause("joint_coupling")
    if coupling is None:
        return [*lines, "", "The diagnosis of the whole twin does not name the wrist's coupling."]
    lines += [
        "",
        f"Coupling, named on {', '.join(coupling['joints']) or 'the robot'} (its term's joint; the pair is joints 5 "
        f"and 6), place {robot.plain.place('joint_coupling')}, confidence {coupling['confidence']:.2f}:",
        "",
        "| | published | diagnosed |",
        "| --- | --- | --- |",
    ]
    told = {each["name"]: each for each in coupling["parameters"]}
    for name, value in PUBLISHED_COUPLING.items():
        lines.append(f"| {name} | {value:g} | {_quantity(told[name], 4) if name in told else '-'} |")
    return lines


def _quantity(quantity: dict[str, Any], digits: int = 2) -> str:
    value, ends = f"{quantity['value']:.{digits}f}", quantity["interval95"]
    return f"{value} ({ends[0]:.{digits}f} ... {ends[1]:.{digits}f})" if ends else value


def _shams(robots: Sequence[Robot]) -> list[str]:
    lines = [
        "## Shams",
        "",
        f"Torque and power are replaced by what a twin says, plus the residual of the diagnosed twin resampled in "
        f"blocks of {BLOCK:g} s (`sham.py`). The diagnosis with a twin of that structure must say `no_gap`; whatever "
        "it names is a false alarm. A run's mean residual stays in it unless taken out: between runs it differs, which "
        "no resampling within runs undoes.",
        "",
        "| robot | twin | shams | false alarms | 95 % interval | named |",
        "| --- " * 6 + "|",
    ]
    total = Counter[bool]()
    for robot in robots:
        for structure, named in robot.shams.items():
            wrong = [effects for effects in named if effects]
            total.update(bool(effects) for effects in named)
            counts = Counter(effect for effects in wrong for effect in effects)
            what = ", ".join(f"{effect} {count}" for effect, count in counts.most_common()) or "-"
            lines.append(f"| {robot.name} | {structure} | {len(named)} | {_share(len(wrong), len(named))} | {what} |")
    if total:
        lines.append(f"| all | | {total.total()} | {_share(total[True], total.total())} | |")
    return lines


def _share(wrong: int, count: int) -> str:
    low, high = wilson(wrong / count, count)
    return f"{wrong} ({100 * wrong / count:.0f} %) | {100 * low:.0f} to {100 * high:.0f} %"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, metavar="DATA_FOLDER", help=f"holds some of {', '.join(WITHHELD)}")
    parser.add_argument("--out", type=Path, metavar="PAGE.md")
    parser.add_argument("--shams", type=int, default=20, help="of each structure and robot (default 20)")
    parser.add_argument("--first-seed", type=int, default=0, help="of the shams (default 0)")
    arguments = parser.parse_args()
    there = [name for name in WITHHELD if (arguments.data / name / "dataset.toml").is_file()]
    if not there:
        parser.error(f"{arguments.data}: holds none of {', '.join(WITHHELD)}")
    missing = [name for name in WITHHELD if name not in there]
    command = f"python bench/withheld.py DATA_FOLDER --shams {arguments.shams}"
    robots: dict[str, Robot] = {}
    twins: dict[str, Twin] = {}

    def tell(line: str) -> None:
        text = page([*robots.values()], [*missing, *there[len(robots) :]], command)
        if arguments.out:
            arguments.out.write_text(text, encoding="utf-8")
        print(line, flush=True)

    for name in there:
        robots[name], twins[name] = examine(arguments.data / name)
        tell(f"{name}: effects withheld")
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.shams)
    for name in there if seeds else ():
        robots[name] = replace(robots[name], shams=blame(arguments.data / name, twins[name], seeds))
        tell(f"{name}: shams")
    print(page([*robots.values()], missing, command))


if __name__ == "__main__":
    main()

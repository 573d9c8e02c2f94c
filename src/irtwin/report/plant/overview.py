"""All robots of a plant: what each does, took, cost and emitted, what is wrong with it, and what would save."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

from irtwin.report.plant.choice import ALL, Selection
from irtwin.report.plant.energies import KINDS, Days, EnergyKind, added_up, by_day, days, kind, kwh, share
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, Row

FIT = 20  # robots that a screen shows in full; more are shown at a glance, too
SCREEN = 102  # robots at a glance on a screen of 1440 x 900: three columns of lines of 20 pixels
TREND = 30  # days in a robot's trend
PLANT_TREND = 90


@dataclass(frozen=True)
class Group:
    """Energies of one kind, the largest first; `kind` is None for robots that have none.

    A line is a robot's: what `robots.rq` and `_robots` say of it, with `runs`, `time_s`, `energy_j` and `trend` of that
    kind; of electrical energy also `cost`, `co2_kg`, `standby` (share of energy) and `saving` (J in a year, were it off
    while it waits, with its 95 % interval; `saving_j` without).
    """

    kind: EnergyKind | None
    lines: tuple[Row, ...]

    def total(self, name: str) -> float | None:
        """Add up a column that can be added up."""
        return _sum(line[name] for line in self.lines)

    @property
    def parts(self) -> tuple[tuple[str, Group], ...]:
        """The lines by what they are grouped by, in its order; none where all are of one."""
        parts = tuple((name, Group(self.kind, tuple(own))) for name, own in groupby(self.lines, key=itemgetter("of")))
        return parts if len(parts) > 1 else ()


@dataclass(frozen=True)
class Overview:
    """What the page of a plant says."""

    groups: tuple[Group, ...]
    trends: tuple[tuple[EnergyKind, Days], ...]
    robots: int
    electrical: Group  # energies of whatever kind
    standby: float | None
    tariff: Row

    @property
    def glance(self) -> tuple[Row, ...]:
        """A line of each robot where they are many: of the first kind of energy that is known, which is its `kind`."""
        lines: dict[str, Row] = {}
        for group in self.groups:
            for line in group.lines:
                lines.setdefault(line["robot"], {**line, "kind": group.kind})
        return tuple(lines.values()) if len(lines) > FIT else ()


def overview(answers: Answers, asked: Selection = ALL) -> Overview:
    """Make the overview of the answers to `reports/plant/*.rq`, of what is asked for."""
    energies = answers["energy"].rows
    groups = tuple(_groups(answers, asked))
    daily = by_day(answers["days"].rows)
    plants = ((energy, days(added_up(of for (_, name), of in daily.items() if name == energy.name), PLANT_TREND))
              for energy in KINDS.values())  # fmt: skip
    electrical = (line for group in groups if group.kind is not None and group.kind.electrical for line in group.lines)
    rows = [row for row in energies if kind(row["energy_from"]).electrical]
    return Overview(
        groups=groups,
        trends=tuple((energy, trend) for energy, trend in plants if trend is not None),
        robots=len({line["robot"] for group in groups for line in group.lines}),
        electrical=Group(None, tuple(electrical)),
        standby=share(_sum(row["standby_j"] for row in rows), _sum(row["modelled_j"] for row in rows)),
        tariff=answers["tariff"].rows[0],
    )


def sheet(plant: Overview) -> Sheet:
    """Return the table of robots, a row for each kind of energy of each."""
    tariff = plant.tariff
    columns = [
        "robot", "iri", "state", "energy_from", "measured_at", "runs", "run_time_s", "energy_kWh",
        *([f"cost_{tariff['currency']}"] if tariff["price"] is not None else []),
        *(["CO2_kg"] if tariff["co2"] is not None else []),
        "standstill_share_of_time", "standby_share_of_energy", "active_alarms", "last_gap", "gap_closed_share",
        *(["saving_a_year_kWh", "saving_lower_kWh", "saving_upper_kWh"] if tariff["hours"] is not None else []),
    ]  # fmt: skip
    rows = [
        (
            line["name"], line["robot"], line["state"]["words"], group.kind.name if group.kind else None,
            line["measured_at"] if group.kind is KINDS["measured"] else None, line["runs"], line["time_s"],
            kwh(line["energy_j"]),
            *([line["cost"]] if tariff["price"] is not None else []),
            *([line["co2_kg"]] if tariff["co2"] is not None else []),
            line["standing"], line["standby"], line["alarms"], line["gap"]["verdict"] if line["gap"] else None,
            line["gap"]["closed"] if line["gap"] else None,
            *(_saving(line) if tariff["hours"] is not None else []),
        )
        for group in plant.groups for line in group.lines
    ]  # fmt: skip
    return Sheet(tuple(columns), rows)


def made_sheet(answers: Answers) -> Sheet:
    """Return what pieces and cycles took, a row for each robot, product and kind of energy."""
    columns = ("robot", "iri", "product", "energy_from", "pieces", "energy_per_piece_J", "cycles", "energy_per_cycle_J")
    return Sheet(
        columns,
        [
            (
                row["name"], row["robot"], row["product"], row["energy_from"], row["pieces"] or None,
                share(row["pieces_j"], row["pieces"]), row["cycles"] or None, share(row["cycles_j"], row["cycles"]),
            )
            for row in answers["made"].rows
        ],
    )  # fmt: skip


def actions(answers: Answers, asked: Selection = ALL) -> tuple[Row, ...]:
    """Return what to do to save energy, as `actions.rq` answers it, of those `robots.rq` that are asked for."""
    robots = {robot["robot"] for robot in answers["robots"].rows if asked.finds(robot)}
    return tuple(row for row in answers["actions"].rows if row["robot"] in robots)


def actions_sheet(rows: tuple[Row, ...]) -> Sheet:
    """Return the actions as a table."""
    columns = (
        "robot", "action", "place", "state", "done_on", "by", "saving_a_year_kWh", "saving_a_run_kWh", "runs_before",
        "runs_after", "compared_for_each", "baseline_adjusted_kWh", "saved_kWh", "lower_kWh", "upper_kWh", "iri",
    )  # fmt: skip
    cells = [
        (
            *(row[name] for name in ("name", "what", "place", "state", "done_on", "by")), kwh(row["year_j"]),
            kwh(row["run_j"]), row["before"], row["after"], row["unit"],
            *(kwh(row[name]) for name in ("adjusted_j", "saved_j", "lower_j", "upper_j")), row["action"],
        )
        for row in rows
    ]  # fmt: skip
    return Sheet(columns, cells)


def _groups(answers: Answers, asked: Selection) -> list[Group]:
    known: dict[str, list[Row]] = {}
    for row in answers["energy"].rows:
        known.setdefault(row["robot"], []).append(row)
    daily = by_day(answers["days"].rows)
    lines: dict[EnergyKind | None, list[Row]] = {}
    for robot in _robots(answers, asked):
        for energy in known.get(robot["robot"], [None]):
            of = kind(energy["energy_from"]) if energy is not None else None
            trend = days(daily.get((robot["robot"], energy["energy_from"]), {}), TREND) if energy is not None else None
            lines.setdefault(of, []).append({**robot, "trend": trend, **_of_energy(robot, energy, of)})
    order = [*KINDS.values(), *(of for of in lines if of is not None and of.name not in KINDS), None]
    return [
        Group(of, tuple(sorted(lines[of], key=lambda line: _place(line, asked.sort)))) for of in order if of in lines
    ]  # fmt: skip


def _robots(answers: Answers, asked: Selection) -> Iterator[Row]:
    """Yield the robots that are asked for, with what is known of each beside its energies.

    `state`: what it does, in `words`, and how its stream goes where it is watched; `standing`: share of time; `alarms`:
    how many are active; `of`: what it is grouped by.
    """
    waiting, gaps, live = ({row["robot"]: row for row in answers[name].rows} for name in ("waiting", "gaps", "live"))
    standing = {row["robot"]: share(row["idle_s"], row["known_s"]) for row in answers["standstill"].rows}
    alarms = Counter(row["robot"] for row in answers["alarms"].rows if row["state"] == "active")
    reidentify = {row["robot"] for row in answers["to_reidentify"].rows}
    for iri, robot in {row["robot"]: row for row in answers["robots"].rows}.items():
        if asked.finds(robot):
            yield {
                **robot,
                "state": live.get(iri) or {"words": robot["words"], "live": None, "began": robot["last_began"]},
                "standing": standing.get(iri),
                "alarms": alarms[iri],
                "reidentify": iri in reidentify,
                "gap": gaps.get(iri),
                "waiting": waiting.get(iri),
                "of": (robot[asked.group] or "not said") if asked.group else "",
            }


def _of_energy(robot: Row, energy: Row | None, of: EnergyKind | None) -> Row:
    """Return what a line says of an energy of a robot; only an electrical one has a price."""
    nothing = dict.fromkeys(("energy_j", "cost", "co2_kg", "standby", "saving", "saving_j"))
    if energy is None or of is None:
        return {**nothing, "runs": robot["runs"] or 0}
    line = {**nothing, **{name: energy[name] for name in ("runs", "time_s", "energy_j")}}
    if of.electrical:
        line |= {name: energy[name] for name in ("cost", "co2_kg")}
        waiting = robot["waiting"]
        line |= {"saving": waiting, "saving_j": waiting and waiting["energy_j"]}
        line |= {"standby": share(energy["standby_j"], energy["modelled_j"])}
    return line


def _place(line: Row, by: str) -> tuple[Any, ...]:
    """Return what a line is sorted by: its group; then what is asked for, else what it could save; then its energy."""
    first = line[{"": "saving_j", "saving": "saving_j", "energy": "energy_j"}.get(by, by)]
    return line["of"], -(first if first is not None else -1.0), -(line["energy_j"] or 0.0), line["name"]


def _saving(line: Row) -> list[float | None]:
    ends = ("energy_j", "lower_j", "upper_j")
    return [None if line["saving"] is None else kwh(line["saving"][end]) for end in ends]


def _sum(values: Any) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) if known else None

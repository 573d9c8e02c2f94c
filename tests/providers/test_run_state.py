"""A meter's log in a workspace: its energy, states and cycles, no twin, and pages that hold."""

from __future__ import annotations

import re
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from sqlalchemy import select

from irtwin.errors import InputError
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.providers.records import load_robot
from irtwin.report.plant import curves, page, robot
from irtwin.report.questions import ask
from irtwin.rewriting import map_rows, rewriting
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import MeteredLoad, SupplyStateRow
from irtwin.storage.schema import RunEnergy, TwinRow
from irtwin.workflow import take_in

pytestmark = pytest.mark.slow

DATA_SET = """
[robot]
name = "Cell_3"
joints = []
power_at = "mains"
[[run]]
file = "day.csv"
started = 2026-03-02T08:30:00Z
"""


def test_a_meters_log(tmp_path: Path) -> None:
    time = np.arange(0.0, 7200.0, 5.0)
    power = np.where(time % 120 < 80, 600.0, 150.0)
    (tmp_path / "dataset.toml").write_text(DATA_SET)
    np.savetxt(tmp_path / "day.csv", np.column_stack([time, power]), delimiter=",", header="time,power", comments="")
    said: list[str] = []
    (tmp_path / "ws").mkdir()
    (tmp_path / "ws/plant.toml").write_text('price_per_kwh = 0.2\ncurrency = "EUR"\nco2_kg_per_kwh = 0.4\n')
    with Workspace(tmp_path / "ws") as place, rewriting(place) as graph:
        take_in(place, read_data_set(tmp_path), said.append)
        assert "  no twin, for a meter alone was logged: which joint, effect or motion takes it stays unknown" in said
        graph.load_ontology()
        map_rows(place, graph)
        reason(graph)
        (energy,) = place.all(select(RunEnergy))
        (load,) = place.all(select(MeteredLoad))
        states = {row.state: row.seconds for row in place.all(select(SupplyStateRow))}
        assert place.all(select(TwinRow)) == []
        whole = float(np.trapezoid(power, time))
        assert (energy.energy_from, energy.energy_consumption_j) == ("measured", pytest.approx(whole))
        assert (load.cycle_count, load.cycle_time_s) == (58, 120.0)
        assert load.standby_power_w == pytest.approx(150.0)
        assert states == {"standby": pytest.approx(2400, rel=0.02), "working": pytest.approx(4800, rel=0.02)}
        hours = [float(joules) for joules in load.energy_by_hour_j.split(",")]
        assert len(hours) == 3 and sum(hours) == pytest.approx(whole, rel=1e-4)
        assert not validate(graph)
        with pytest.raises(InputError, match='of "Cell_3" a meter alone was logged; this needs its joints'):
            load_robot(place, "Cell_3")
        iri, run = graph.iri("robot/Cell_3"), graph.iri("run/Cell_3.day")
        answers = ask(graph, robot.questions(), {"robot": iri})
        beside = {"zone": ZoneInfo("Europe/Berlin"), "trouble": "", "excel": False, "report": None, "gap_report": None}
        said_of = robot.of_robot(answers, beside["zone"])
        html = text(page.render("robot/page.html.jinja", answers, {"robot": iri}, **said_of, **beside))
        assert "early, 6 to 14 h 3 " in html
        assert "150 W at standby; 58 cycles, one in 2 min 0 s, 15.0 Wh each" in html
        assert "What stays unknown" in html and "Twin and gap" not in html
        answers = ask(graph, page.questions("run"), {"run": run})
        drawn = curves.of_run(answers)
        assert drawn is not None and [one["title"] for one in drawn["panels"]] == ["electrical power"]
        html = text(
            page.render("run/page.html.jinja", answers, {"run": run}, curves=drawn, **robot.of_run(answers), **beside)
        )
        assert re.search("working .* 600 W standby .* 150 W", html)


def text(html: str) -> str:
    return " ".join(re.sub(r"<details.*?</details>|<[^>]*>", " ", html, flags=re.DOTALL).split())

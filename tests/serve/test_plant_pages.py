"""/, /robot, /run, /compare, /tables and /reports: what they answer, to whom, and that no name breaks out of them."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import pytest
from httpx import Response
from tests import plants
from tests.endpoint import CLIENT, Server
from tests.html_elements import Elements

from irtwin.errors import InputError
from irtwin.location import Location
from irtwin.serve.pool import Limits
from irtwin.serve.server import serve

pytestmark = pytest.mark.slow

SIDES = "a_to=2026-03-02&b_from=2026-03-03"
PAGES = (
    "/", "/robot/Arm_A", "/robot/Arm_D", "/run/Arm_A.fit_1", "/run/Arm_D.first", "/compare?robot=Arm_D",
    f"/compare?robot=Arm_A&{SIDES}", "/compare?robot=Arm_A&by=run&a_run=Arm_A.fit_1&b_run=Arm_A.idle_1",
    "/irtwin/id/robot/Arm_D/information", "/irtwin/id/robot/Arm_A",
)  # fmt: skip
BROWSER = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}


def paths_of(response: Response) -> set[str]:
    """Where a page leads."""
    return set(Elements(response.text).values("href"))


@pytest.mark.parametrize("path", PAGES)
def test_a_page_has_no_style_within_and_no_script_but_those_that_draw_runs(plant: Server, path: str) -> None:
    response = plant.get(path, **BROWSER)
    assert (response.status_code, response.headers["content-type"]) == (200, "text/html; charset=utf-8")
    policy = response.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    draws = path.startswith("/run/") or "by=run" in path
    assert ("script-src 'self';" in policy) is ("script-src" in policy) is draws
    scripts = ["plotly", "plotting", "curves"] if draws else []
    if path.startswith("/run/"):
        scripts = ["plotly", "plotting", "moment", "curves", "meshcat", "robot"]
    assert re.findall("<script[^>]*>[^<]*", response.text) == [f'<script src="/assets/{name}.js">' for name in scripts]
    elements = Elements(response.text).found
    assert not [tag for tag, said in elements if "style" in (tag, *said)]
    assert not [name for _, said in elements for name in said if name.startswith("on")]


def test_curves_are_answered_by_a_worker(plant: Server) -> None:
    query = "SELECT (series:curve(id:run\\/Arm_A.fit_1, 'power', 0, 1e9) AS ?curve) { }"
    (row,) = plant.ask(query, Accept="application/sparql-results+json").json()["results"]["bindings"]
    curve = json.loads(row["curve"]["value"])
    assert 600 < len(curve) <= 2000 and [12.345, 900.0] in [[round(at, 6), value] for at, value in curve]


@pytest.mark.parametrize("path", ["/", "/robot/Arm_D", "/run/Arm_D.first", "/irtwin/id/robot/Arm_D/information"])
def test_a_hostile_name_is_text(plant: Server, path: str) -> None:
    html = plant.get(path, **BROWSER).text
    assert plants.HOSTILE not in html
    assert "&lt;script&gt;alert(" in html


def test_a_robots_page_leads_to_its_reports(plant: Server) -> None:
    paths = paths_of(plant.get("/robot/Arm_A"))
    assert {"/reports/Arm_A.html", "/reports/Arm_A.gap.html"} <= paths
    assert not [path for path in paths_of(plant.get("/robot/Arm_D")) if "gap.html" in path]


def test_each_link_of_the_plants_page_leads_somewhere(plant: Server) -> None:
    found = set()
    for path in ("/", "/robot/Arm_A", "/run/Arm_A.fit_1"):
        found |= paths_of(plant.get(path))
    inner = {path.partition("#")[0] for path in found if path.startswith("/") and path != "/reports/out.html"}
    of_each_kind = {tuple(path.split("?")[0].split("/")[:4]): path for path in sorted(inner)}
    assert len(of_each_kind) > 15
    for path in of_each_kind.values():
        assert plant.get(path, **BROWSER).status_code == 200, path


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/robot/nobody", 404, "the graph knows no robot https://w3id.org/irtwin/id/robot/nobody"),
        ("/robot/a%3E%20b", 404, "no robot has this name"),
        ("/run/nothing", 404, "the graph knows no run"),
        ("/run/Arm_A", 404, "the graph knows no run"),
        ("/compare", 404, "the graph knows no robot"),
        ("/compare?robot=Arm_A&by=run&a_run=a%3E&b_run=b", 404, "no run has this name"),
        ("/tables/robots.pdf", 404, "this table comes as csv"),
        ("/tables/runs.csv", 404, "the graph knows no robot"),
        ("/tables/comparison.csv?robot=Arm_A", 400, "say both sides"),
        ("/tables/comparison.csv?robot=Arm_A&a_from=x&b_from=y", 400, "'x' is not a day"),
        ("/reports/nothing.html", 404, "no such report"),
        ("/reports/out.html", 404, "no such report"),
        ("/reports/..%2Fplant.toml", 404, ""),
        ("/reports/%2e%2e/plant.toml", 404, ""),
    ],
)
def test_what_there_is_not(plant: Server, path: str, status: int, said: str) -> None:
    response = plant.get(path)
    assert response.status_code == status
    assert response.text.count("\n") <= 1 and said in response.text


@pytest.mark.parametrize("path", ["/robot/nobody", "/compare", "/no/such/page", "/reports/nothing.html"])
def test_a_browser_gets_a_page_that_leads_back(plant: Server, path: str) -> None:
    response = plant.get(path, **BROWSER)
    assert (response.status_code, response.headers["content-type"]) == (404, "text/html; charset=utf-8")
    assert "/" in paths_of(response)
    assert plant.get(path).text.rstrip("\n.") in response.text


def test_what_a_browser_asked_for_is_not_written_into_a_page_as_it_is(plant: Server) -> None:
    assert "<b>" not in plant.get("/tables/robots.<b>", **BROWSER).text


def test_a_day_that_is_none_is_said_on_the_page(plant: Server) -> None:
    response = plant.get("/compare?robot=Arm_A&a_from=<b>&b_from=2026-03-02")
    assert response.status_code == 200
    assert "&#39;&lt;b&gt;&#39; is not a day: write it as 2026-03-02" in response.text


def test_robots_as_csv_and_excel(plant: Server) -> None:
    response = plant.get("/tables/robots.csv")
    assert response.headers["content-disposition"] == 'attachment; filename="robots.csv"'
    rows = list(csv.DictReader(io.StringIO(response.text)))
    assert [(row["robot"], row["energy_from"]) for row in rows] == [
        ("Arm_A", "measured"), ("Arm_B", "measured"), ("Arm_C", "mechanical"), (f"'{plants.HOSTILE}", "")
    ]  # fmt: skip
    assert float(rows[0]["energy_kWh"]) == pytest.approx(4600 / 3.6e6)
    assert float(rows[0]["cost_EUR"]) == pytest.approx(4600 / 3.6e6 * 0.2)
    assert float(rows[0]["CO2_kg"]) == pytest.approx(4600 / 3.6e6 * 0.4)
    assert rows[2]["cost_EUR"] == ""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.load_workbook(io.BytesIO(plant.get("/tables/robots.xlsx").content))
    assert [cell.value for cell in book.active["A"]] == ["robot", "Arm_A", "Arm_B", "Arm_C", plants.HOSTILE]


def test_tables_of_a_robot_of_a_run_and_of_a_comparison(plant: Server) -> None:
    runs = plant.get("/tables/runs.csv?of=Arm_A").text.splitlines()
    assert len(runs) == 5 and runs[0].startswith("run,iri,began_UTC,time_s,payload_kg,energy_from,energy_J")
    assert len(plant.get("/tables/ledger.csv?of=Arm_A.fit_1").text.splitlines()) == 6
    compared = plant.get(f"/tables/comparison.csv?robot=Arm_A&{SIDES}").text
    assert "measured,energy,J,3000.0,1600.0,-1400.0,-46.6" in compared


def test_a_report_is_kept_apart(plant: Server) -> None:
    response = plant.get("/reports/Arm_A.html")
    assert (response.status_code, response.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert response.headers["content-security-policy"].startswith("sandbox allow-scripts")
    assert "allow-same-origin" not in response.headers["content-security-policy"]


@pytest.mark.parametrize("path", ["/", "/robot/Arm_A", "/tables/robots.csv", "/reports/Arm_A.html"])
def test_pages_of_other_sites_get_none_of_it(plant: Server, path: str) -> None:
    assert plant.get(path, Origin="http://evil.example").status_code == 403
    assert plant.get(path, Host="evil.example").status_code == 421
    assert CLIENT.post(plant.url + path).status_code == 405


def test_a_tariff_that_was_spoiled_meanwhile_is_said_beside_what_was_concluded(plant: Server) -> None:
    file = plant.graph.parent / "plant.toml"
    kept = file.read_text(encoding="utf-8")
    try:
        file.write_text("price_per_kwh = -1\n", encoding="utf-8")
        html = plant.get("").text
    finally:
        file.write_text(kept, encoding="utf-8")
    assert "price_per_kwh should be a number of at least 0, not -1" in html
    assert "cost, EUR" in html


def test_a_tariff_that_cannot_be_used_is_said_before_anything_is_served(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text("prise = 1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"plant\.toml: prise is not known"):
        place = Location(plants.make_empty_plant(tmp_path).parent)
        serve(place, "127.0.0.1", 0, token=None, limits=Limits(), announce=print)

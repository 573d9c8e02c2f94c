"""Every number of a gap page is the document's, and each cause's are its own."""

from __future__ import annotations

import html
import itertools
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests import gap_cases
from tests.gap_pages import figures_of, graph_of, page_of
from tests.html_elements import plain
from tests.rows import ROBOT

from irtwin.document.document import Document
from irtwin.providers.names import robot_iri
from irtwin.report import wording
from irtwin.report.gap.page import render_gap
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

NUMBER = re.compile(r"−?\d[\d\u202f]*(?:\.\d+)?(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
CELLS = re.compile(
    r'<(td class="number(?: unsure)?"|small|dd|b|span class="badge[^"]*"|p class="hint")>'
    r"(.*?)</(?:td|dd|b|span|p|small)>"
)
WORDS = {"95", "100", "1", "2", "3", "4", "6"}  # % of intervals, "over 100" deviations, in names of joints and runs


def told_apart(value: Any, count: Iterator[int]) -> Any:
    """Return a diagnosis in which no two numbers are alike."""
    if isinstance(value, dict):
        return {key: told_apart(one, count) for key, one in value.items()}
    if isinstance(value, list):
        return [told_apart(one, count) for one in value]
    return value * (1 - 0.0037 * next(count)) if isinstance(value, float) else value


def numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from numbers(one)
    elif isinstance(value, float):
        yield value


def written(value: float) -> set[str]:
    """Return the ways in which a page may write a number."""
    forms = (wording.number, wording.given, wording.share, wording.percent, wording.duration)
    ways = [*(form(value) for form in forms), wording.number(value, 2), f"{value:.2g}"]
    return {found for way in ways for found in NUMBER.findall(way.replace("\N{NO-BREAK SPACE}", " "))}


def shown(page: str) -> list[str]:
    """Return the numbers of a page's tables, facts, badges and hints."""
    page = page[page.index('id="summary"') : page.index('id="provenance"')]
    page = re.sub(r'<section id="friction".*?</section>', "", page, flags=re.DOTALL)  # of its curves: test_friction
    page = re.sub(r'<details class="questions">.*?</details>', "", page, flags=re.DOTALL)
    cells = [re.sub("<[^>]*>", " ", found[1]) for found in CELLS.findall(page)]
    texts = [html.unescape(cell).replace("\N{NO-BREAK SPACE}", " ") for cell in cells]
    return [found for text in texts for found in NUMBER.findall(re.sub(r"\w+_\w+", "", text))]


@pytest.mark.parametrize("verdict", gap_cases.VERDICTS)
def test_every_number_shown_is_one_of_the_document(tmp_path: Path, verdict: str) -> None:
    said = told_apart(gap_cases.diagnosis(verdict), itertools.count())
    of_document = set().union(*map(written, numbers(said)))
    of_minutes = {f"{one['minutes']:.2g}" for one in (said["next_experiment"] or {}).get("considered", [])}
    seen = shown(page_of(tmp_path, said))
    assert len(seen) >= 20
    assert set(seen) - of_document - of_minutes - WORDS == set()


def test_every_number_that_matters_is_shown(tmp_path: Path) -> None:
    said = told_apart(gap_cases.diagnosis("ambiguous"), itertools.count())
    document = Document.from_json(said)
    seen = set(shown(page_of(tmp_path, said)))
    experiment, shrink = document.next_experiment, document.shrink
    shares = [shrink.closed_fraction.value, *shrink.closed_fraction.interval95]
    plain_ones = [experiment.questions[0].separation_now, experiment.separation_that_is_enough]
    for cause in document.causes:
        why = cause.evidence
        shares += [cause.confidence, why.share_of_what_is_closed or 0.0, *why.probability_of_rivals.values()]
        plain_ones += [why.gain, why.log_odds, why.closed_where_it_acts]
        plain_ones += [number for one in cause.parameters for number in (one.value, *(one.interval95 or ()))]
    for place in document.locations:
        shares += [place.share, *place.share_interval95]
        plain_ones += [place.excess, *place.excess_interval95]
    for size in (document.gap.torque or {}).values():
        plain_ones += [size.rmse, size.noise_floor or 0.0]
    for change in (shrink.torque_rmse, shrink.power_rmse, shrink.energy_error_percent):
        plain_ones += [change.before, change.after, *(change.interval95_after or ())]
    settings = [*(experiment.programme.speeds or {}).values(), *(experiment.programme.amplitudes or {}).values()]
    plain_ones += [number for values in settings for number in values]
    assert [share for share in shares if not written(share) & seen] == []
    assert [number for number in plain_ones if not written(number) & seen] == []


def friction_of(joint: str, share: float, confidence: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a cause of one joint, and what it closes."""
    said = gap_cases.diagnosis("attributed")
    cause, change = said["causes"][1], said["shrink"]["by_cause"][1]
    name = f"stribeck_friction@{joint}"
    cause |= {"id": name, "joints": [joint], "confidence": confidence}
    cause["parameters"] = [{"name": "Fs", "joint": joint, "value": 10 * share, "unit": "N m", "interval95": None}]
    cause["evidence"] |= {"share_of_what_is_closed": share, "log_odds": 100 * share}
    change |= {"cause": name, "joints": [joint], "share": share}
    return cause, change | {"rmse_before": [1.4], "rmse_alone": [share], "rmse_when_left_out": [9 * share]}


def test_two_causes_of_one_effect_are_kept_apart(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    pairs = [friction_of("joint_a5", 0.65, 0.72), friction_of("joint_a2", 0.35, 0.61)]
    said["causes"] = [cause for cause, _ in pairs]
    said["shrink"]["by_cause"] = [change for _, change in reversed(pairs)]  # in another order than the causes
    page = plain(page_of(tmp_path, gap_cases.with_findings(said)))
    parts = page.split('id="which"')[1].split("<h3>")[1:]
    assert [part.split("</h3>")[0] for part in parts[:2]] == [
        "1. Stribeck friction on joint_a5",
        "2. Stribeck friction on joint_a2",
    ]
    for part, confidence, share, value in ((parts[0], "72 %", "65 %", "6.50"), (parts[1], "61 %", "35 %", "3.50")):
        assert f"confidence {confidence}" in part
        assert f"{share} of the closed gap" in part
        assert f'<td class="number unsure">{value}</td>' in part  # without an interval
        assert f"<dd>{10 * float(value):.1f}</dd>" in part
    drawn = figures_of(tmp_path / "p.html")
    alone, without = drawn["by_cause"]["data"]
    assert alone["x"] == ["1. Stribeck friction", "2. Stribeck friction"]
    assert alone["y"] == pytest.approx([0.65, 0.35]) and without["y"] == pytest.approx([5.85, 3.15])


def without_numbers(value: Any) -> Any:
    """Return JSON whose numbers are null."""
    if isinstance(value, dict):
        return {key: without_numbers(one) for key, one in value.items()}
    if isinstance(value, list):
        return [without_numbers(one) for one in value]
    return None if isinstance(value, int | float) and not isinstance(value, bool) else value


def without_curves(page: str) -> tuple[str, dict[str, Any]]:
    """Return a page's text, and what it draws but for curves."""
    data = re.search(r'id="page-data">(.*?)</script>', page)
    drawn = json.loads(data[1])["figures"]
    kept = {name: one for name, one in drawn.items() if not name.startswith("follows_") and name != "experiment"}
    return page.replace(data[1], ""), kept


def test_nothing_but_curves_is_of_the_evidence_file(tmp_path: Path) -> None:
    said = told_apart(gap_cases.diagnosis("ambiguous"), itertools.count())
    drawn = told_apart(gap_cases.evidence("ambiguous"), itertools.count(200))
    page = page_of(tmp_path, said, drawn)
    with Workspace(tmp_path / "w") as workspace:

        def read(path: str, checksum: str) -> bytes:
            assert path.endswith(".evidence.json")  # the diagnosis' own JSON is not read at all
            stripped = without_numbers(json.loads(workspace.read_document(path, checksum)))
            return json.dumps(stripped | {"heat_map": None, "runs": []}).encode()

        render_gap(graph_of(workspace), robot_iri(ROBOT), read, tmp_path / "stripped.html")
    assert without_curves((tmp_path / "stripped.html").read_text()) == without_curves(page)
    cells, bars = (figures_of(tmp_path / "p.html")[name]["data"] for name in ("heat_map", "runs_torque"))
    seen, given = (list(itertools.chain(*of)) for of in (cells[0]["customdata"], drawn["heat_map"]["excess"]))
    assert seen == pytest.approx(given)
    of_joint = [one for one in drawn["runs"] if one["joint"] == said["locations"][0]["joint"]]
    assert bars[0]["y"] == pytest.approx([one["before"] for one in of_joint])
    assert bars[1]["y"] == pytest.approx([one["after"] for one in of_joint])

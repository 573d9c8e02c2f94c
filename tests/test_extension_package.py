"""Packages beside irtwin: table, provider, rule, question and ontology of one, and effect of another, just work."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import text

from irtwin.storage.database import Workspace
from tests import bump_package
from tests.small_robots import data_set
from tests.trusting import trust_all

EXAMPLE = Path(__file__).parents[1] / "examples" / "irtwin-co2"
pytestmark = pytest.mark.nightly
LIMIT = "0.118"  # g; of the three runs one lies above it
# All in one process: the package is to be there from its start, and starting takes longest.
WORK = """
import json, sys
from pathlib import Path
from tests.data_sets import irtwin

place, data, bumped = sys.argv[1:]
heavy = "<https://example.org/irtwin-co2#Heavy_Run>"
ask = f"SELECT ?run {{ ?run a {heavy} }} ORDER BY ?run"
done = [irtwin("run", data, "--workspace", place)]
done.append(irtwin("query", "co2_per_run", "--workspace", place, "--format", "json"))
done.append(irtwin("query", "energy_per_run", "--workspace", place, "--format", "json"))
done.append(irtwin("query", ask, "--workspace", place, "--format", "json"))
done.append(irtwin("explain", "?", "a", heavy, "--workspace", place))
done.append(irtwin("explain", "?", "<https://example.org/irtwin-co2#Emission>", "?", "--workspace", place))
done.append(irtwin("export", "--owl", place + "/whole.owl", "--workspace", place))
done.append(irtwin("workspace", "status", "--workspace", place))
done.append(irtwin("diagnose", bumped, "--workspace", place, "--json", place + "/gap.json"))
cause = "SELECT ?label { ?cause irt:caused_by_Effect ?effect . ?effect rdfs:label ?label }"
done.append(irtwin("query", cause, "--workspace", place, "--format", "json"))
print(json.dumps([[one.status, one.out, one.err] for one in done]))
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("packages")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*command, "--disable-pip-version-check", "--target", target, EXAMPLE], check=True)
    bump_package.install(target)
    return target


@pytest.fixture(scope="module")
def done(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[list]]:
    place = tmp_path_factory.mktemp("emissions")
    data, bumped = data_set(place / "data", "Emitting"), bump_package.data_set(place / "bumped")
    shipped = (EXAMPLE / "src/irtwin_co2/ontology/co2.ttl").read_text(encoding="utf-8")
    own = place / "workspace" / "ontology" / "co2.ttl"  # the workspace's own limit, in place of the package's
    own.parent.mkdir(parents=True)
    own.write_text(shipped.replace('"0.6"', f'"{LIMIT}"'), encoding="utf-8")
    trust_all(place / "workspace")
    path = os.pathsep.join([str(installed), *filter(None, sys.path)])
    said = subprocess.run(
        [sys.executable, "-c", WORK, place / "workspace", data, bumped],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert said.returncode == 0, said.stderr
    return place / "workspace", json.loads(said.stdout)


def test_its_provider_fills_its_table_and_its_question_is_answered(done) -> None:
    _, (run, emissions, energies, *_) = done
    assert run[0] == 0, run[2]
    assert "co2: 3 individuals" in run[2]
    grams = {row["run"]: row["co2_g"] for row in json.loads(emissions[1])}
    joules = {row["run"]: row["energy_Wh"] * 3600 for row in json.loads(energies[1])}
    assert grams == pytest.approx({name: 1000 * 0.4 * energy / 3.6e6 for name, energy in joules.items()})


def test_its_rule_concludes_and_is_explained(done) -> None:
    _, (_, emissions, _, heavy, why, source, *_) = done
    expected = [row["run"] for row in json.loads(emissions[1]) if row["co2_g"] > float(LIMIT)]
    assert len(expected) == 1
    assert [row["run"].rpartition(".")[2] for row in json.loads(heavy[1])] == expected
    assert 'the rule "heavy run", in SHACL' in why[1]
    assert "provider:co2" in source[1]


def test_report_and_export_hold_what_it_adds(done) -> None:
    place, (*_, export, status, _, _) = done
    assert export[0] == 0, export[2]
    owl = (place / "whole.owl").read_text(encoding="utf-8")
    assert "https://example.org/irtwin-co2#Heavy_Run" in owl
    assert (
        "swrl" in owl and "The rule &quot;heavy run&quot;" not in owl
    )  # it is there in SWRL, not among those that SWRL cannot say
    page = (place / "reports" / "Emitting.html").read_text(encoding="utf-8")
    assert "<h3>Heavy run</h3>" in page
    assert "What CO2 does each run stand for?" in page
    assert '<th scope="row">CO2</th>' in page  # among the providers that computed its numbers
    assert status[0] == 0, status[2]
    assert "rules/co2_rules.ttl of irtwin-co2 0.1.0" in status[1]
    assert "ontology/co2.ttl of workspace, in place of " in status[1]
    assert "run_emission, of a package" in status[1]


def test_a_diagnosis_names_the_effect_of_a_package(done) -> None:
    place, (*_, status, diagnosis, cause) = done
    assert "ontology/bump.ttl of bump-package 0.2" in status[1]
    assert diagnosis[0] == 0, diagnosis[2]
    said = json.loads((place / "gap.json").read_text(encoding="utf-8"))
    assert [(one["effect"], one["joints"]) for one in said["causes"]] == [("bump", ["joint_1"])]
    (found,) = said["causes"][0]["parameters"]
    low, high = found["interval95"]
    assert low < 8.0 < high
    assert [row["label"] for row in json.loads(cause[1])] == ["bump"]


def test_without_the_package_its_rows_are_in_nobodys_way(done) -> None:
    place, _ = done
    with Workspace.existing(place) as workspace:
        count = text("SELECT count(*) FROM run_emission")
        with workspace.reading() as session:
            assert session.scalar(count) == 3
        workspace.drop_robot("Emitting")
        with workspace.reading() as session:
            assert session.scalar(count) == 0

"""Where an IRI leads on a page."""

from __future__ import annotations

import pytest

from irtwin.knowledge.vocabulary import ID, IRT
from irtwin.report.plant import links


@pytest.mark.parametrize(
    ("iri", "path"),
    [
        (f"{ID}robot/Arm_A", "/robot/Arm_A"),
        (f"{ID}robot/R%201", "/robot/R%25201"),
        (f"{ID}run/Arm_A.fit_1", "/run/Arm_A.fit_1"),
        (f"{ID}robot/Arm_A/information", "/irtwin/id/robot/Arm_A/information"),
        (f"{ID}twin/t1", "/irtwin/id/twin/t1"),
        (f"{IRT}Run_Time", "/irtwin#Run_Time"),
        ("http://qudt.org/vocab/unit/J", "http://qudt.org/vocab/unit/J"),
        ("javascript:alert(1)", None),
        ("https://w3id.org/irtwinner", "https://w3id.org/irtwinner"),
    ],
)
def test_page_of(iri: str, path: str | None) -> None:
    assert links.page_of(iri, ID) == path


def test_an_individual_is_at_its_iris_path() -> None:
    assert links.individual(f"{ID}robot/Arm_A", ID) == "/irtwin/id/robot/Arm_A"
    assert links.tail(f"{ID}run/a.b", ID) == "a.b"


def test_individuals_of_a_plant_are_at_its_own_path() -> None:
    base = "https://plant.example/energy/"
    assert links.page_of("https://plant.example/energy/robot/Arm_A", base) == "/robot/Arm_A"
    assert links.individual("https://plant.example/energy/twin/t1", base) == "/energy/twin/t1"
    assert links.individual(f"{IRT}Run_Time", base) == "/irtwin#Run_Time"
    assert links.individual(f"{ID}robot/Arm_A", base) == "/irtwin/id/robot/Arm_A"  # told so by an update, maybe
    assert links.individual("https://plant.example/other", base) == "https://plant.example/other"

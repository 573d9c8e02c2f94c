"""What a plant says of its electricity, as triples: they stand beside the ontology, for they hold for all robots."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.vocabulary import DCTERMS, TARIFF, term
from irtwin.storage.tariff import FILE, read_tariff

ELECTRICITY = NamedNode(f"{TARIFF}electricity")


def tariff_of(workspace: Path) -> Iterator[Triple]:
    """Yield what `plant.toml` of a workspace says of the tariff; nothing where it says none. InputError where it is
    at fault."""
    tariff = read_tariff(workspace)
    values: dict[str, float | str | None] = {
        term("Energy_Price"): tariff.price,
        term("Currency"): tariff.currency or None,
        term("Emission_Factor"): tariff.co2,
        term("Operating_Hours"): tariff.hours,
    }
    known = {name: value for name, value in values.items() if value is not None}
    for name, value in known.items():
        yield Triple(ELECTRICITY, NamedNode(name), Literal(value))
    if known:
        yield Triple(ELECTRICITY, NamedNode(f"{DCTERMS}source"), Literal(FILE))

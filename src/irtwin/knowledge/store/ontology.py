"""What the ontology's graph says: the modules of a workspace, its plant and tariff, and a name of their content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import lru_cache
from itertools import chain
from pathlib import Path
from urllib.parse import quote

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import DCTERMS, GRAPH_ONTOLOGY, ONTOLOGY, OWL, RDFS, TARIFF, TYPE, term
from irtwin.resources import Resources
from irtwin.storage.tariff import FILE, Tariff, read_tariff

ELECTRICITY = NamedNode(f"{TARIFF}electricity")
LIMIT_VALUE, SOURCE = NamedNode(term("Limit_Value")), NamedNode(f"{DCTERMS}source")


def quads(resources: Resources, workspace: Path | None, base: str) -> Iterator[Quad]:
    """Yield what the ontology's graph says; the plant is an individual below the base."""
    more = chain(_of_plant(workspace, base), [version(resources, workspace, base)])
    return chain(of_modules(resources), in_graph(more, GRAPH_ONTOLOGY))


def of_modules(resources: Resources) -> tuple[Quad, ...]:
    """Return what the modules say, without plant and tariff."""
    return _read_modules(*_modules(resources))


def limits(resources: Resources) -> dict[tuple[NamedNode, NamedNode], Quad]:
    """Return what the modules say of the value and source of each limit, by limit and property."""
    about = {
        (quad.subject, quad.predicate): quad
        for quad in of_modules(resources)
        if quad.predicate in (LIMIT_VALUE, SOURCE) and isinstance(quad.subject, NamedNode)
    }
    return {(subject, name): quad for (subject, name), quad in about.items() if (subject, LIMIT_VALUE) in about}


def version(resources: Resources, workspace: Path | None, base: str) -> Triple:
    """Return what a graph of these modules, this plant and its tariff says of itself."""
    digest = hashlib.sha256(_modules(resources)[1])
    digest.update("".join(map(str, _of_plant(workspace, base))).encode())
    return Triple(NamedNode(ONTOLOGY), NamedNode(f"{OWL}versionInfo"), Literal(f"sha-256:{digest.hexdigest()}"))


def _modules(resources: Resources) -> tuple[tuple[Path, ...], bytes]:
    """Return the files of the ontology, and their content."""
    paths = tuple(resources.paths("ontology"))
    return paths, b"".join(path.read_bytes() for path in paths)


def _of_plant(workspace: Path | None, base: str) -> Iterator[Triple]:
    """Yield what `plant.toml` says of plant and tariff, which hold for all robots. InputError where it is at fault."""
    tariff = Tariff() if workspace is None else read_tariff(workspace)
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
        yield Triple(ELECTRICITY, SOURCE, Literal(FILE))
    if tariff.plant is not None:
        plant = NamedNode(f"{base}plant/{quote(tariff.plant, safe='')}")
        yield Triple(plant, TYPE, NamedNode(term("Plant")))
        yield Triple(plant, NamedNode(f"{RDFS}label"), Literal(tariff.plant))
        yield Triple(ELECTRICITY, NamedNode(term("tariff_of")), plant)


@lru_cache(maxsize=1)  # a run puts them into two graphs
def _read_modules(paths: tuple[Path, ...], content: bytes) -> tuple[Quad, ...]:
    """Return what modules of the ontology say, which are read anew where their content is another."""
    return tuple(in_graph(chain.from_iterable(map(read_turtle, paths)), GRAPH_ONTOLOGY))

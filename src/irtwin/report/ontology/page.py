"""The ontology's documentation: one HTML page that opens offline, with an anchor for each term."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup
from pyoxigraph import NamedNode, RdfFormat, Store, parse

from irtwin.knowledge.store.table import AnswerTable, table_of
from irtwin.knowledge.vocabulary import ONTOLOGY, OWL, shorten
from irtwin.report.ontology.axioms import Word, axioms
from irtwin.report.page import content_policy
from irtwin.report.templates import environment, style
from irtwin.resources import Resource, Resources, folder, shipped
from irtwin.storage.files import check_place, write

KINDS = {
    "Class": "Classes",
    "ObjectProperty": "Object properties",
    "DatatypeProperty": "Data properties",
    "AnnotationProperty": "Annotation properties",
    "NamedIndividual": "Individuals",
}
_ALIGNED = {  # vocabularies that only the alignment speaks of
    "sosa": "http://www.w3.org/ns/sosa/",
    "ssn": "http://www.w3.org/ns/ssn/",
    "saref": "https://saref.etsi.org/core/",
    "quantitykind": "http://qudt.org/vocab/quantitykind/",
}


@dataclass
class DocumentedTerm:
    """A class, property or individual: what `terms.rq` says of it, and what it leads to, by IRIs or in words."""

    iri: str
    label: str
    said: Mapping[str, Any]
    extends: str | None = None  # the module that it is of, where that does not ship
    links: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    axioms: dict[str, list[list[Word]]] = field(default_factory=lambda: defaultdict(list))
    values: dict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))

    @property
    def anchor(self) -> str:
        """What stands after `#` in the term's address on the page; for a model's term, as in its IRI."""
        if self.extends is not None:
            return f"{self.extends}/{re.split('[/#]', self.iri)[-1]}"
        return self.iri.removeprefix(f"{ONTOLOGY}#").removeprefix(f"{ONTOLOGY}/") if self.own else short(self.iri)

    @property
    def own(self) -> bool:
        """Whether it is a term of the model, not one of another vocabulary."""
        return self.extends is not None or self.iri.startswith(ONTOLOGY)


@dataclass(frozen=True)
class Module:
    """A module of the ontology: its header, its terms by kind, and who brings it where it does not ship."""

    name: str
    origin: str
    header: Mapping[str, Any]
    terms: Mapping[str, list[DocumentedTerm]]


def write_page(out: Path, known: Resources | None = None) -> None:
    """Write the documentation of the ontology that is `known`, or else ships. Raises InputError where it cannot."""
    check_place(out)
    write(out, page(read_modules(known or shipped())).encode())


def read_modules(known: Resources) -> list[Module]:
    """Read the modules of the ontology, in the order in which they build on each other; what extends it comes last."""
    store, files = Store(), dict[str, Resource]()
    for file in known.of("ontology"):
        iri = _module_iri(file)
        store.load(path=str(file.path), format=RdfFormat.TURTLE, to_graph=NamedNode(iri))
        files[iri] = file
    headers = {row["module"]: row for row in _ask(store, "modules")}
    terms = _terms(store, {iri: file for iri, file in files.items() if not iri.startswith(ONTOLOGY)})
    order = [ONTOLOGY, *_imported(store)]
    return [
        Module(_stem(files[iri]), files[iri].origin, headers.get(iri, {"module": iri}), terms.get(iri, {}))
        for iri in [*order, *sorted(files.keys() - order)]
    ]


def _module_iri(file: Resource) -> str:
    """Return the IRI of a module: that of the file of this name which ships, or what the file says that it is."""
    name = _stem(file)
    if not file.is_extension or file.replaces:
        return ONTOLOGY if name == "irtwin" else f"{ONTOLOGY}/{name}"
    ontologies = (quad.subject for quad in parse(path=str(file.path)) if quad.object == NamedNode(f"{OWL}Ontology"))
    return next((node.value for node in ontologies if isinstance(node, NamedNode)), f"urn:module:{name}")


def _stem(file: Resource) -> str:
    return file.name.removesuffix(".ttl")


def page(modules: list[Module]) -> str:
    """Return the page."""
    known = {term.iri: term for module in modules for group in module.terms.values() for term in group}
    templates = environment(shipped()).overlay()
    templates.filters = templates.filters | {
        "link": lambda iri: _link(iri, known),
        "linked": partial(_linked, known=known),
        "short": short,
    }
    return templates.get_template("ontology/page.html.jinja").render(
        modules=modules,
        kinds=KINDS,
        forests=_forests(modules, known),
        count=sum(term.own for term in known.values()),
        policy=content_policy([]),
        style=style(shipped(), "layout/style.css", "ontology/style.css"),
    )


def short(iri: str) -> str:
    """Return an IRI with its prefix, as the page writes it."""
    for prefix, namespace in _ALIGNED.items():
        if iri.startswith(namespace):
            return f"{prefix}:{iri.removeprefix(namespace)}"
    return shorten(iri)


def _terms(store: Store, extensions: Mapping[str, Resource]) -> dict[str, dict[str, list[DocumentedTerm]]]:
    terms: dict[str, dict[str, list[DocumentedTerm]]] = {}
    known: dict[str, DocumentedTerm] = {}
    for row in _ask(store, "terms"):
        kind, extension = row["kind"].removeprefix(OWL), extensions.get(row["module"])
        term = DocumentedTerm(row["term"], row["label"], row, None if extension is None else _stem(extension))
        known[term.iri] = term
        terms.setdefault(row["module"], {}).setdefault(kind, []).append(term)
    for row in _ask(store, "links"):
        if row["term"] in known:
            known[row["term"]].links[row["link"]].append(row["other"])
            if row["back"] and row["other"] in known:
                known[row["other"]].links[row["back"]].append(row["term"])
    for iri, name, words in axioms(store):
        if iri in known:
            known[iri].axioms[name].append(words)
    for row in _ask(store, "values"):
        if row["term"] in known:
            known[row["term"]].values[row["property"]].append(row["value"])
    return terms


def _imported(store: Store) -> list[str]:
    """Return the modules that the whole imports, in its order."""
    text = (folder("ontology") / "irtwin.ttl").read_text(encoding="utf-8")
    imports = {
        quad.object.value
        for quad in store.quads_for_pattern(None, NamedNode(f"{OWL}imports"), None, NamedNode(ONTOLOGY))
        if isinstance(quad.object, NamedNode)
    }
    return sorted(imports, key=text.index)


def _forests(modules: list[Module], known: Mapping[str, DocumentedTerm]) -> dict[str, list[dict[str, Any]]]:
    """Return the trees of each module's classes: a label, the anchor that it leads to, and the classes `below`.

    `beside` are its superclasses that are not of the module.
    """
    forests = {}
    for module in modules:
        classes = [term for term in module.terms.get("Class", []) if term.own]
        if classes:
            forests[module.name] = list(_nodes(classes, None, known))
    return forests


def _nodes(
    classes: list[DocumentedTerm], above: str | None, known: Mapping[str, DocumentedTerm]
) -> Iterator[dict[str, Any]]:
    names = {term.iri for term in classes}
    for term in classes:
        inside = [parent for parent in term.links["subclass of"] if parent in names]
        outside = [parent for parent in term.links["subclass of"] if parent not in names]
        if (inside[0] if inside else None) == above:
            beside = [known[iri].label if iri in known and known[iri].own else short(iri) for iri in outside]
            below = list(_nodes(classes, term.iri, known))
            yield {"label": term.label, "anchor": term.anchor, "beside": beside, "below": below}


def _link(iri: Any, known: Mapping[str, DocumentedTerm]) -> Markup:
    """Return a link to a term's place on the page, or its short name where it has none."""
    term = known.get(iri) if isinstance(iri, str) else None
    if term is None:
        return Markup("<code>{}</code>").format(short(iri) if isinstance(iri, str) else iri)
    return Markup('<a href="#{}">{}</a>').format(term.anchor, term.label if term.own else short(term.iri))


def _linked(words: list[Word], known: Mapping[str, DocumentedTerm]) -> Markup:
    """Return what an axiom says with a link at each term; no blank within parentheses."""
    text = Markup(" ").join(_link(word.value, known) if isinstance(word, NamedNode) else word for word in words)
    return text.replace("( ", "(").replace(" )", ")")


def _ask(store: Store, name: str) -> AnswerTable:
    text = (folder("reports") / "ontology" / f"{name}.rq").read_text(encoding="utf-8")
    return table_of(store.query(text, use_default_graph_as_union=True))

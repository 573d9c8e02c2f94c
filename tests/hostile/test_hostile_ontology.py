"""Ontologies that are broken, too large, contradict themselves, or are meant to do harm."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.hostile.xml_attacks import attacks, entities

PREFIXES = (
    "@prefix : <http://e/> . @prefix owl: <http://www.w3.org/2002/07/owl#> . "
    "@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
)
RDF_XML = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:e="http://e/">{}</rdf:RDF>'
ABOUT = RDF_XML.format('<rdf:Description rdf:about="http://e/{}"/>')


XML = {
    **{name: (text, "XML entity") for name, text in attacks(ABOUT).items()},
    "deep nesting": (RDF_XML.format("<e:A><e:p>" * 50_000 + "</e:p></e:A>" * 50_000), "nested more than"),
    "undefined entity": (ABOUT.format("&none;"), "not well-formed XML"),
    "not closed": (ABOUT.format("x").replace("</rdf:RDF>", ""), "line 1, column .*: not well-formed XML"),
    "wrongly closed": (ABOUT.format("x").replace("</rdf:RDF>", "</rdf:RDG>"), "not well-formed XML"),
    "unknown prefix": (RDF_XML.format("<x:A/>"), "x"),
    "attribute twice": (RDF_XML.format('<e:A rdf:about="http://e/a" rdf:about="http://e/b"/>'), "not well-formed XML"),
    "node with two names": (RDF_XML.format('<e:A rdf:about="http://e/a" rdf:ID="b"/>'), "."),
    "id twice": (RDF_XML.format('<e:A rdf:ID="b"/><e:A rdf:ID="b"/>'), "."),
    "not an IRI": (RDF_XML.format('<e:A rdf:about="http://e/ a"/>'), "IRI"),
}
TURTLE = {
    "cut off": (":a :b", "line 2.*end"),
    "no dot": (":a :b :c", "line 2"),
    "unknown prefix": ("x:a x:b x:c .", "line 2.*prefix"),
    "not an IRI": (":a :b <http://e/ x> .", "line 2.*IRI"),
    "literal as subject": ('"a" :b :c .', "line 2"),
    "literal as property": (':a "b" :c .', "line 2"),
    "blank node as property": (":a [] :c .", "line 2"),
    "open text": (':a :b "c .', "line 2"),
    "wrong escape": (r':a :b "\q" .', "line 2"),
    "half a surrogate": (r':a :b "\uD800" .', "line 2"),
    "open brackets": (":a :b " + "[ :b " * 100_000, "line 2"),
    "closed brackets": (":a :b " + "[" * 100_000, "line 2"),
    "open collection": (":a :b " + "(" * 100_000, "line 2"),
    "triples in triples": (":a :b " + "<<( :a :b " * 100_000 + ":c" + " )>>" * 100_000 + " .", "nested more than"),
    "reified in reified": ("<< " * 100_000, "nested more than"),
    "language that is none": (':a :b "c"@123 .', "line 2"),
    "a term of 20 MB": (f':a :b "{"x" * 20_000_000}" .', "a term of more than 16 MB"),
    "a page": ("<!DOCTYPE html><html><body>404</body></html>", "line 2"),
    "a query": ("SELECT * WHERE { ?s ?p ?o }", "line 2"),
    "ill-typed": (':a :b "soon"^^xsd:dateTime .', "contradict"),
}
OTHER = {
    "deep.jsonld": ('{"http://e/p":' * 200_000 + "1" + "}" * 200_000, "stack size"),
    "array.jsonld": ("[" * 1_000_000, "stack size"),
    "context.jsonld": ('{"@context": "http://127.0.0.1:1/context", "a": 1}', "remote context"),
    "file.jsonld": ('{"@context": "file:///etc/passwd", "a": 1}', "remote context"),
    "open.jsonld": ('{"http://e/p": ', "."),
    "quads.nq": ("<http://e/a> <http://e/b> <http://e/c> <http://e/d> <http://e/e> .", "line 1"),
    "open.nt": ('<http://e/a> <http://e/b> "c', "line 1"),
    "relative.nt": ("<a> <b> <c> .", "line 1"),
    "open.trig": ("<http://e/g> { <http://e/a> <http://e/b> <http://e/c>", "line 1"),
    "formula.n3": ("<http://e/a> <http://e/b> " + "{ " * 10_000, "line 1"),
    "ontology.docx": ("PK", "no RDF format has this suffix"),
    "ontology": ("", "no RDF format has this suffix"),
}


def check(refused: Callable[..., str], folder: Path, name: str, text: str, message: str) -> None:
    (folder / name).write_text(text, encoding="utf-8")
    said = refused("ontology", str(folder), name)
    assert re.search(message, said), said


@pytest.mark.parametrize("name", XML)
def test_rdf_xml(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    check(refused, tmp_path, "in.owl", *XML[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", TURTLE)
def test_turtle(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    text, message = TURTLE[name]
    check(refused, tmp_path, "in.ttl", PREFIXES + text, message)


@pytest.mark.parametrize("name", OTHER)
def test_other_forms(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    check(refused, tmp_path, name, *OTHER[name])


def test_what_is_no_file(refused: Callable[..., str], tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ttl")
    (tmp_path / "device.ttl").symlink_to("/dev/zero")
    (tmp_path / "large.ttl").touch()
    os.truncate(tmp_path / "large.ttl", 100_000_000_000)
    (tmp_path / "bytes.ttl").write_bytes(b"\0" * 1000)
    (tmp_path / "latin.ttl").write_bytes((PREFIXES + ":a :b 'é' .").encode("latin-1"))
    (tmp_path / "wide.owl").write_bytes((entities(9, 10) + ABOUT.format("&e9;")).encode("utf-16"))
    assert "is not a file" in refused("ontology", str(tmp_path), "pipe.ttl")
    assert "is not a file" in refused("ontology", str(tmp_path), "device.ttl")
    assert "is larger than" in refused("ontology", str(tmp_path), "large.ttl")
    assert "cannot be read" in refused("ontology", str(tmp_path), "none.ttl")
    assert "line 1" in refused("ontology", str(tmp_path), "bytes.ttl")
    assert "UTF-8" in refused("ontology", str(tmp_path), "latin.ttl")
    assert "XML entity" in refused("ontology", str(tmp_path), "wide.owl")

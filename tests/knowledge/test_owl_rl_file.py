from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from pyoxigraph import RdfFormat, Triple, parse
from tests.knowledge.graphs import TURTLE, turtle
from tests.knowledge.test_engines import DL

from irtwin.cli import cli
from irtwin.errors import InputError
from irtwin.knowledge.engines import close_file

GIVEN = f"{TURTLE} ex:C rdfs:subClassOf ex:D . ex:a a ex:C ; ex:at 01, [ a ex:C ] ."
WRONG = f"{TURTLE} ex:C owl:disjointWith ex:D . ex:a a ex:C, ex:D ."


def read(path: Path, form: RdfFormat = RdfFormat.TURTLE) -> set[Triple]:
    return {quad.triple for quad in parse(path=str(path), format=form)}


def reasoned(source: Path, out: Path, *options: str) -> Result:
    return CliRunner().invoke(cli, ["workspace", "reason", str(source), "--out", str(out), *options])


def test_file_holds_what_was_given_and_what_follows(tmp_path: Path) -> None:
    source, out = tmp_path / "in.ttl", tmp_path / "out.ttl"
    source.write_text(GIVEN)
    outcome = reasoned(source, out)
    assert outcome.exit_code == 0
    kept = [str(one) for one in read(out)]
    assert '"01"' in str([one for one in kept if "/at" in one])
    types = [one for one in kept if "#type" in one and one.endswith("<https://example.org/D>")]
    assert len(types) == 2  # of ex:a and of the blank node


@pytest.mark.parametrize("suffix", [".nt", ".rdf", ".owl", ".jsonld", ".nq", ".trig"])
def test_suffix_tells_the_format(tmp_path: Path, suffix: str) -> None:
    source, between, out = tmp_path / "in.ttl", tmp_path / f"between{suffix}", tmp_path / "out.nt"
    source.write_text(GIVEN)
    assert close_file(source, between) > 0
    assert close_file(between, out) == 0
    assert len(read(out, RdfFormat.N_TRIPLES)) > 5


def test_contradiction_is_told_by_status_3(tmp_path: Path) -> None:
    source, out = tmp_path / "in.ttl", tmp_path / "out.ttl"
    source.write_text(WRONG)
    outcome = reasoned(source, out)
    assert outcome.exit_code == 3
    assert "cax-dw" in outcome.output
    assert "https://example.org/a" in outcome.output
    assert list(tmp_path.iterdir()) == [source]


ENTITIES = '<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><r/>'


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("in.ttl", b"<a> <b", "in.ttl, line 1"),
        ("in.ttl", b"\xff\xfe", "UTF-8"),
        ("in.csv", b"", "no RDF format"),
        ("in.rdf", ENTITIES.encode(), "XML entity"),
        ("in.rdf", b'<!DOCTYPE r [<!ENTITY a "' + b"a" * 2000 + b'">]><r/>', "XML entity"),
        ("in.rdf", b'<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><r>&a;</r>', "in.rdf"),
    ],
)
def test_unreadable_file_is_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    source = tmp_path / name
    source.write_bytes(content)
    with pytest.raises(InputError, match=message):
        close_file(source, tmp_path / "out.ttl")
    assert list(tmp_path.iterdir()) == [source]


def test_missing_file_and_unfit_place_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        close_file(tmp_path / "none.ttl", tmp_path / "out.ttl")
    source = tmp_path / "in.ttl"
    source.write_text(GIVEN)
    with pytest.raises(InputError, match="no RDF format"):
        close_file(source, tmp_path / "out.doc")


@pytest.mark.slow
def test_classification_by_hermit(tmp_path: Path) -> None:
    source, out = tmp_path / "in.ttl", tmp_path / "out.nt"
    source.write_text(f"{TURTLE} ex:o a owl:Ontology . {DL}")
    assert reasoned(source, out, "--engine", "hermit").exit_code == 0
    assert turtle("ex:C rdfs:subClassOf ex:E .") <= read(out, RdfFormat.N_TRIPLES)


@pytest.mark.slow
def test_ontology_that_is_not_owl_2_dl_is_refused(tmp_path: Path) -> None:
    source = tmp_path / "in.ttl"
    source.write_text(f"{TURTLE} ex:o a owl:Ontology . {DL}" + "ex:D owl:disjointWith ex:D .")
    with pytest.raises(InputError, match="HermiT cannot read this as OWL 2 DL"):
        close_file(source, tmp_path / "out.nt", "hermit")


@pytest.mark.slow
def test_clash_that_only_dl_sees_names_its_statements(tmp_path: Path) -> None:
    source, out = tmp_path / "in.ttl", tmp_path / "out.nt"
    source.write_text(f"{TURTLE} ex:o a owl:Ontology . {DL}" + "ex:D rdfs:subClassOf owl:Nothing .")
    outcome = reasoned(source, out, "--engine", "hermit")
    assert outcome.exit_code == 3
    assert "These statements cannot all be true" in outcome.output
    assert "some D" in outcome.output
    assert list(tmp_path.iterdir()) == [source]

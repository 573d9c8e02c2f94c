"""What a faulty mapping document gets: one line that names the file, the triples map and the term map."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.knowledge.test_mapping import PEOPLE, SUBJECT, mapped, person

from irtwin.errors import InputError
from irtwin.knowledge.mapping.reader import read_document


def refused(folder: Path, mapping: str, message: str, sql: str = PEOPLE) -> None:
    with pytest.raises(InputError) as caught:
        mapped(folder, mapping, sql)
    text = str(caught.value)
    assert text.startswith(f"{folder}/a.r2rml.ttl: ")
    assert re.search(message, text), text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("object_map", "message"),
    [
        ('rr:column "none"', r'<P>, object map of <p>: no column none in its logical table, which has "id", "name"'),
        ('rr:column "Shoe"', r'no column Shoe in its logical table.*"Shoe"'),  # regular: folded to one case
        ('rr:column "a b"', r"'a b' is no SQL identifier"),
        ('rr:column "name" ; rr:template "x"', r"give just one of rr:constant, rr:column and rr:template"),
        ("rr:termType rr:IRI", r"give just one of"),
        ('rr:column "name", "id"', r"2 values of rr:column; give one"),
        ("rr:column ex:name", r"rr:column must be a string"),
        ('rr:column "name" ; rr:termType ex:Odd', r"term type <Odd> is not allowed here"),
        ('rr:column "name" ; rr:termType rr:IRI ; rr:language "en"', r"for literals only"),
        ('rr:column "name" ; rr:language "en" ; rr:datatype xsd:string', r"rr:language or rr:datatype, not both"),
        ('rr:column "name" ; rr:language "english"', r"'english' is no language tag"),
        ('rr:column "name" ; rr:datatype "xsd:double"', r"must be an IRI"),
        ('rr:column "name" ; rr:datatype xsd:double', r"the value 'Ada' is no http://www.w3.org/2001/XMLSchema#double"),
        ('rr:column "name" ; rr:termType rr:IRI', r"the value 'Bo & Co/é' makes no valid IRI; use a template"),
        ('rr:colum "name"', r"rr:colum does not belong here"),
        ('rr:column "name" ; rr:class ex:C', r"rr:class does not belong here"),
        ('rr:template "{id"', r"unpaired '{' in template"),
        ('rr:template "id}"', r"unpaired '}' in template"),
        ('rr:template "{}"', r"'' is no SQL identifier"),
        ("rr:constant [ ]", r"the constant \[...\] must be an IRI or a literal"),
        ("rr:parentTriplesMap <#None>", r"<None>: rr:logicalTable is missing|<None>: has 0 subject maps"),
        ('rr:parentTriplesMap <#P> ; rr:joinCondition [ rr:child "id" ]', r"needs rr:child and rr:parent"),
        (
            'rr:parentTriplesMap <#P> ; rr:joinCondition [ rr:child "id" ; rr:parent "none" ]',
            r"object map of <p>: no column none",
        ),
    ],
)
def test_faults_of_an_object_map(tmp_path: Path, object_map: str, message: str) -> None:
    refused(tmp_path, person(f"rr:objectMap [ {object_map} ]"), message)


@pytest.mark.parametrize(
    ("subject", "message"),
    [
        ('rr:subjectMap [ rr:column "name" ; rr:termType rr:Literal ]', r"rr:Literal is not allowed here"),
        ('rr:subject "text"', r"<P>, subject map: the constant 'text' must be an IRI"),
        (f"{SUBJECT} ; rr:subject ex:s", r"has 2 subject maps"),
        ('rr:subjectMap [ rr:column "id" ; rr:class "C" ]', r"rr:class: 'C' must be an IRI"),
        ('rr:subjectMap [ rr:column "id" ; rr:graph "g" ]', r"graph map: the constant 'g' must be an IRI"),
    ],
)
def test_faults_of_a_subject_map(tmp_path: Path, subject: str, message: str) -> None:
    refused(tmp_path, person('rr:object "o"', subject), message)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('rr:tableName "none"', r"<P>, logical table: the database refuses it: no such table: none"),
        ('rr:tableName "person; DROP TABLE person"', r"is no SQL table name"),
        ('rr:sqlQuery "SELECT 1" ; rr:tableName "person"', r"give either rr:tableName or rr:sqlQuery"),
        ("rr:sqlVersion rr:SQL2008", r"give either rr:tableName or rr:sqlQuery"),
        ('rr:sqlQuery "SELECT * FROM person" ; rr:sqlVersion rr:SQL1979', r"rr:SQL1979 is no SQL version identifier"),
        ('rr:sqlQuery "SELECT FROM"', r"the database refuses it"),
        ('rr:sqlQuery "SELECT id, id FROM person"', r"column id occurs more than once"),
        ('rr:sqlQuery "SELECT * FROM person; DROP TABLE person"', r"more than one statement"),
        ('rr:sqlQuery "DELETE FROM person"', r"the database refuses it"),
        ('rr:sqlQuery "SELECT * FROM person) ; DELETE FROM person --"', r"more than one statement"),
    ],
)
def test_faults_of_a_logical_table(tmp_path: Path, table: str, message: str) -> None:
    refused(tmp_path, person('rr:object "o"', table=table), message)


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ("", r"has no rr:TriplesMap"),
        ("<#P> a rr:TriplesMap .", r"<P>: has 0 subject maps"),
        (f"<#P> {SUBJECT} .", r"rr:logicalTable is missing"),
        (person(""), r"predicate-object map <p> needs a predicate and an object"),
        (person('rr:object "o"').replace("ex:p", '"p"'), r"predicate map of 'p': the constant 'p' must be an IRI"),
    ],
)
def test_faults_of_a_document(tmp_path: Path, mapping: str, message: str) -> None:
    refused(tmp_path, mapping, message)


def test_a_document_that_is_not_there_or_no_turtle(tmp_path: Path) -> None:
    document = tmp_path / "a.ttl"
    with pytest.raises(InputError, match=r"a\.ttl: cannot be read \(No such file"):
        read_document(document)
    document.write_text("<#P>\n rr:logicalTable")
    with pytest.raises(InputError, match=r"a\.ttl, line 2: "):
        read_document(document)
    document.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"a\.ttl, line 1: "):
        read_document(document)

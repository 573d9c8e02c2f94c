"""The mapping of a diagnosis in R2RML, made of what its fields tell: `make mappings` writes `mappings/gap.r2rml.ttl`.

Units are joined to it in `mappings/units.r2rml.ttl`, and what concerns the record itself is in `diagnosis.r2rml.ttl`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from irtwin.document.tables import TABLES, Column, Table

_HEAD = """\
# A diagnosis of the gap between twin and robot: where it lies, its causes, how far it shrinks, what to measure next.
# Made by `make mappings` of the fields of src/irtwin/document: change those.
@prefix rr: <http://www.w3.org/ns/r2rml#> .
@prefix irt: <https://w3id.org/irtwin#> .
@prefix prov: <http://www.w3.org/ns/prov#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix : <https://w3id.org/irtwin/mapping/gap#> .
"""
_GRAPH = 'rr:graphMap [ rr:template "https://w3id.org/irtwin/graph/activity/{activity_id}" ]'
_DATATYPES = {float: " ; rr:datatype xsd:double", int: " ; rr:datatype xsd:integer", bool: " ; rr:datatype xsd:boolean"}


def r2rml() -> str:
    """Return the document, as Turtle."""
    return "\n".join([_HEAD, *(text for table in TABLES for text in _maps(table))])


def _maps(table: Table) -> Iterator[str]:
    """Yield the triples maps of a table: what its individuals say."""
    individual, whole = table.individual, table.whole
    if individual is None:
        (column,) = table.columns
        yield _map(f"{table.name}", table, table.iri, [_says(column.term, _object(column))])
        return
    says = [_says(individual.of, _template(whole.iri))] if whole else []
    says += [_says(name, f'rr:constant "{value}"') for name, value in individual.constants]
    says += [_says(column.term, _object(column)) for column in table.columns if column.term]
    says.append(_predicate("prov:wasGeneratedBy", _template("activity/{activity_id}")))
    yield _map(individual.name, table, table.iri, says, f"rr:class irt:{individual.name} ; ")


def _map(name: str, table: Table, subject: str, says: list[str], kind: str = "") -> str:
    of = f'rr:logicalTable [ rr:tableName "{table.name}" ]'
    about = f'    rr:subjectMap [ rr:template "{subject}" ; {kind}{_GRAPH} ]'
    return " ;\n".join([f":{name} {of}", about, *says]) + " .\n"


def _says(term: str, value: str) -> str:
    return _predicate(f"irt:{term}", value)


def _predicate(term: str, value: str) -> str:
    return f"    rr:predicateObjectMap [ rr:predicate {term} ; rr:objectMap [ {value} ] ]"


def _object(column: Column) -> str:
    if column.names is None:
        return f'rr:column "{column.name}"{_DATATYPES.get(column.kind, "")}'
    return _template(column.names.iri.replace("{}", f"{{{column.name}}}"))


def _template(iri: str) -> str:
    return f'rr:template "{iri}"'


if __name__ == "__main__":
    sys.stdout.write(r2rml())

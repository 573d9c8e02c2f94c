"""From an individual to what it was made of: its activities, their providers, what they used, and its file."""

from __future__ import annotations

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import Row
from irtwin.knowledge.vocabulary import XSD, shorten

_OF_ACTIVITY = """
SELECT ?activity ?provider ?software ?finished
WHERE {
  GROUP
  OPTIONAL { ?activity irt:Software ?software }
  OPTIONAL { ?activity prov:endedAtTime ?finished }
}
ORDER BY ?finished ?activity"""
_ACTIVITY = _OF_ACTIVITY.replace("GROUP", "OPTIONAL { ?activity prov:wasAssociatedWith ?provider }")
_MAKERS = _OF_ACTIVITY.replace(
    "GROUP", "?thing prov:wasGeneratedBy ?activity . ?activity prov:wasAssociatedWith ?provider ."
)

_INPUTS = "SELECT ?entity WHERE { ?activity prov:used|prov:wasInformedBy ?entity } ORDER BY ?entity"

_FILES = """
SELECT ?file ?checksum (COALESCE(?own, ?shared) AS ?folder)
WHERE {
  ?thing irt:File ?file
  OPTIONAL { ?thing irt:Checksum ?checksum }
  OPTIONAL { ?thing irt:Data_Folder ?own }
  OPTIONAL {
    ?thing irt:Run_Role ?role ; irt:run_of / ^irt:source_of ?source .
    ?source irt:Source_Kind "data set" ; irt:Data_Folder ?shared
  }
}
ORDER BY ?file"""

_TOLD_IN = """
SELECT ?file ?checksum ?folder ?place ?name
WHERE {
  ?property irt:told_in ?kind .
  ?thing (irt:run_of | irt:joint_of | ^irt:has_Information | irt:note_of)? ?robot .
  ?source irt:source_of ?robot ; irt:Source_Kind ?one ; irt:File ?file ; irt:Checksum ?checksum ;
    irt:Data_Folder ?folder .
  FILTER(?one = ?kind || (?kind = "URDF" && NOT EXISTS { ?other irt:source_of ?robot ; irt:Source_Kind ?kind }))
  OPTIONAL { ?property irt:told_as ?place FILTER(?one = ?kind) }
  OPTIONAL { ?thing irt:File | irt:Joint_Name | irt:Note_Name ?name }
  FILTER NOT EXISTS { ?thing irt:run_of ?robot FILTER NOT EXISTS { ?thing irt:Run_Role ?role } }
}
ORDER BY ?file"""

_RUNS_OF_TOTAL = """
SELECT DISTINCT ?run WHERE { ?thing irt:total_of ?robot . ?run irt:run_of ?robot ; irt:File ?file } ORDER BY ?run"""

_PARTS_OF_TOTAL = """
CONSTRUCT { ?part ?property ?value }
WHERE {
  { SELECT DISTINCT ?part ?property ?value WHERE {
    {
      $total irt:worked_out_of ?property .
      ?part irt:run_of ?robot ; ?property ?value .
      OPTIONAL { $thing irt:Day ?day }
      OPTIONAL { ?part irt:Start_Time ?start }
      FILTER(EXISTS { $thing irt:total_of ?robot } || EXISTS { $thing a irt:Fleet_Day_Total })
      FILTER(IF(BOUND(?day), STRSTARTS(STR(?start), ?day) && EXISTS { ?part irt:Energy_Consumption ?energy }, true))
      FILTER(!BOUND(?day) && ?property IN (irt:Run_Time, irt:Idle_Share, irt:Modelled_Energy, irt:Payload)
        || NOT EXISTS { ?part irt:Energy_From "mechanical" })
      FILTER NOT EXISTS { ?part a irt:Run_Without_Consumption }
      FILTER NOT EXISTS { $thing irt:total_of_Effect|irt:total_of_Joint ?part_of_it }
    } UNION {
      $total irt:worked_out_of ?property .
      $thing irt:total_of ?robot ; irt:total_of_Effect ?effect .
      ?run irt:run_of ?robot ; irt:Energy_Consumption ?energy .
      ?part irt:share_of_Run ?run ; irt:of_Effect ?effect ; ?property ?value .
      OPTIONAL { $thing irt:total_of_Joint ?joint }
      FILTER(IF(BOUND(?joint), EXISTS { ?part irt:of_Joint ?joint }, NOT EXISTS { ?part irt:of_Joint ?some }))
    } UNION {
      $total irt:worked_out_of ?property .
      $thing irt:total_of ?robot .
      ?run irt:run_of ?robot ; irt:Energy_Consumption ?energy .
      ?part a irt:Joint_Energy ; irt:of_Run ?run ; irt:of_Joint ?joint ; ?property ?value .
      FILTER NOT EXISTS { $thing irt:total_of_Effect ?effect }
      FILTER($total = irt:Total_Joint_Energy || EXISTS { $thing irt:total_of_Joint ?joint })
    }
  } ORDER BY ?part ?property LIMIT $most }
}"""

_NEXT = """
SELECT DISTINCT ?next
WHERE {
  { ?thing ?leads ?next } UNION { ?next irt:source_of ?thing }
  UNION { ?next irt:source_of / irt:part_of ?thing ; irt:Source_Kind "data set" }
  FILTER(isIRI(?next) && ?next != ?thing)
}
ORDER BY ?next"""

_ASSERTED = """
SELECT ?value ?by ?at ?replaced ?fact
WHERE {
  ?fact irt:asserted_of ?thing ; irt:Asserted_Property ?property ; irt:Asserted_Value ?value ; irt:Asserted_By ?by ;
    irt:Asserted_At ?at .
  OPTIONAL { ?fact irt:Replaced_Value ?replaced }
}
ORDER BY DESC(?at)"""

_RUN = """
SELECT ?run
WHERE {
  ?thing irt:series_of ?run
  FILTER NOT EXISTS { ?thing prov:wasGeneratedBy / prov:wasAssociatedWith ?provider }
}"""

_PLAN = "SELECT ?kind { ?thing a ?kind FILTER(?kind IN (irt:Planned_Run, irt:Planned_Series)) }"

_FARTHEST = 4  # steps: a shape, its link, its robot, and the file that describes that


def makers(graph: KnowledgeGraph, thing: str) -> list[Row]:
    """Return the activities that made a thing, each with its provider, software and when it finished."""
    return list(graph.query(_MAKERS, {"thing": thing}))


def activity(graph: KnowledgeGraph, iri: str) -> Row:
    """Return what is known of an activity, like `makers`."""
    return {**next(iter(graph.query(_ACTIVITY, {"activity": iri})), {}), "activity": iri}


def used_by(graph: KnowledgeGraph, activity: str) -> list[str]:
    """Return the IRIs of what an activity used."""
    return [row["entity"] for row in graph.query(_INPUTS, {"activity": activity})]


def recorded_of(graph: KnowledgeGraph, series: str) -> list[str]:
    """Return the IRI of the run that samples are of, where no activity made them."""
    return [row["run"] for row in graph.query(_RUN, {"thing": series})]


def is_planned(graph: KnowledgeGraph, thing: str) -> bool:
    """Whether a run, or the samples of one, did not take place."""
    return bool(list(graph.query(_PLAN, {"thing": thing})))


def file_of(graph: KnowledgeGraph, thing: str) -> Row:
    """Return `file`, `checksum` and `folder` of what a thing is kept in, as explanations have them; {} if unknown."""
    return next(iter(graph.query(_FILES, {"thing": thing})), {})


def behind(graph: KnowledgeGraph, thing: str) -> list[str]:
    """Return the individuals with files that a thing is made of: a total's runs, else the nearest that it leads to."""
    runs = [row["run"] for row in graph.query(_RUNS_OF_TOTAL, {"thing": thing})]
    if runs:
        return runs
    nodes, seen = [thing], {thing}
    for _ in range(_FARTHEST):
        leads_to = (row["next"] for node in nodes for row in graph.query(_NEXT, {"thing": node}))
        nodes = [node for node in dict.fromkeys(leads_to) if node.startswith(graph.base) and node not in seen]
        seen.update(nodes)
        if in_files := [node for node in nodes if file_of(graph, node)]:
            return in_files
    return []


def parts_of_total(graph: KnowledgeGraph, triple: Triple, most: int) -> list[Triple]:
    """Return what runs, or parts of them, say that a total is worked out of, at most so many; else nothing."""
    given = {"$total": triple.predicate, "$thing": triple.subject, "$most": most}
    text = _PARTS_OF_TOTAL
    for name, value in given.items():
        text = text.replace(name, str(value))
    return sorted(graph.construct(text), key=str) if isinstance(triple.subject, NamedNode) else []


def asserted(graph: KnowledgeGraph, triple: Triple) -> str | None:
    """Return, in words, who asserted a triple, when and in place of what; None where nobody did."""
    if not isinstance(triple.subject, NamedNode) or not isinstance(triple.object, NamedNode | Literal):
        return None
    property = Literal(triple.predicate.value, datatype=NamedNode(f"{XSD}anyURI"))
    rows = graph.query(_ASSERTED, {"thing": triple.subject.value, "property": property})
    for row in rows:
        if _same(row["value"], triple.object):
            replaced = f", in place of {row['replaced']}" if row["replaced"] is not None else ""
            when = f"{row['at']:%Y-%m-%d %H:%M:%S %Z}"
            return f"asserted by {row['by']}, {when}{replaced}, {shorten(row['fact'], graph.base)}"
    return None


def _same(written: str, term: NamedNode | Literal) -> bool:
    """Whether a fact's value is that of a term, whose number may be written otherwise."""
    try:
        return written == term.value or float(written) == float(term.value)
    except ValueError:
        return False


def told_in(graph: KnowledgeGraph, thing: str, property: str) -> Row:
    """Return the file of a data set that says a property of a thing, as `file_of`, and in which `place`."""
    for row in graph.query(_TOLD_IN, {"thing": thing, "property": property}):
        place = row["place"] and row["place"].replace("NAME", row["name"] or "")
        return {"file": row["file"], "checksum": row["checksum"], "folder": row["folder"], "place": place}
    return {}

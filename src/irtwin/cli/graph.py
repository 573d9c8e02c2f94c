"""Commands on the graph: ask, explain, export; below `workspace`, those that few need."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import click

from irtwin.cli.options import FILE, FOLDER, PLACE, Number, announce, located, located_graph, say, tell_contradictions
from irtwin.cli.upkeep import workspace
from irtwin.location import Location

_MODELS = ("urdf", "mjcf", "sdf", "usd")
_FORMS = ("owl", "ros", *_MODELS, "aas")


def _known_questions(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
    from irtwin.knowledge.questions.queries import named_questions

    return [name for name in named_questions() if name.startswith(begun)]


@click.command()
@click.argument("question", required=False, shell_complete=_known_questions)
@click.option("--robot", metavar="NAME", help="Ask about this robot only.")
@located_graph
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json", "csv"]),
    default="table",
    show_default=True,
    help="Output format.",
)
def query(question: str | None, robot: str | None, location: Location, form: str) -> None:
    """Ask the graph a question, by name or in SPARQL.

    Without QUESTION, the named questions are listed by theme.

    \b
    Example: irtwin query energy_per_joint --format csv
    Example: irtwin query 'SELECT ?robot WHERE { ?robot a irt:Industrial_Robot }'
    """
    from irtwin import asking
    from irtwin.knowledge.questions.queries import to_csv, to_json
    from irtwin.knowledge.store.no_network import leave_network

    if question is None:
        answer = asking.questions(location.folder)
    else:
        if location.graph_url is None:
            leave_network()
        answer = asking.ask(question, location, robot=robot)
    for fault in answer.faults:
        say(f"irtwin: {fault}")
    if form == "table":
        from irtwin.report.terminal import show

        show(answer, in_sections=question is None)
    else:
        click.echo(to_json(answer) if form == "json" else to_csv(answer), nl=form == "json")


@click.command()
@click.argument("triple", nargs=-1, required=True)
@located_graph
@click.option("--json", "as_json", is_flag=True, help="Write nested JSON objects instead of an outline.")
@click.option("--verify", is_flag=True, help="Check the files; exit status 2 unless they are the same.")
def explain(triple: tuple[str, ...], location: Location, as_json: bool, verify: bool) -> None:
    """Explain where a triple of the graph comes from.

    The explanation names the rule, mapping or provider and the facts it used, down to runs, files and checksums.
    TRIPLE is subject, predicate and object: prefixed names, IRIs or literals. `?` or a missing part matches anything.
    With --verify, a line for each file says whether its SHA-256 is still the one in the graph: whole, changed, missing,
    or why that cannot be checked. The exit status is 2 unless some are the same and none is not.

    \b
    Example: irtwin explain '? irt:Energy_Consumption ?'
    """
    import json

    from irtwin import asking
    from irtwin.knowledge.explain.explanation import to_json
    from irtwin.knowledge.explain.verify import WHOLE
    from irtwin.knowledge.explain.verify import verify as verified

    explanations = asking.explain(" ".join(triple), location)
    files = verified(explanations, location.folder) if verify else []
    if as_json:
        entries = [to_json(each) for each in explanations]
        told = {"explanations": entries, "files": [asdict(each) for each in files]} if verify else entries
        click.echo(json.dumps(told, indent=2, ensure_ascii=False))
    else:
        click.echo("\n\n".join(map(str, explanations)))
        for line in ["", *map(str, files)] if verify else ():
            click.echo(line)
    if any(each.is_wrong for each in files):
        sys.exit(2)
    if verify and not any(each.state == WHOLE for each in files):
        say("irtwin: nothing was checked: no file behind this is known by its checksum")
        sys.exit(2)


@workspace.command()
@click.argument("source", type=PLACE, required=False)
@click.option("--out", type=FILE, help="RDF file to write, with SOURCE.")
@click.option(
    "--engine",
    type=click.Choice(["native", "owlrl", "hermit"]),
    default="native",
    show_default=True,
    help="Who draws the conclusions, see above.",
)
@located
def reason(source: Path | None, out: Path | None, engine: str, location: Location) -> None:
    """Draw all conclusions from the graph, or from an RDF file.

    Without SOURCE, the conclusions in the workspace's graph are drawn again, by the ontology, mappings and rules that
    are there now. With SOURCE, OUT gets what SOURCE says and all that follows; the file suffixes decide the formats. If
    it contradicts itself, nothing is written and the exit status is 3. In a workspace nothing is concluded from the
    statements that contradict each other, all else is, and the exit status is 3 too.

    \b
    Example: irtwin workspace reason --workspace plant
    Example: irtwin workspace reason robots.ttl --out all.ttl

    \b
    native  OWL 2 RL by the rules that ship. Takes under 1 s for 10,000 triples.
            Finds nothing that needs unnamed individuals or a choice of cases.
    owlrl   The same rules by the Python package owlrl, to check the native engine.
            Takes 10 s for 10,000 triples, twice for a workspace; 300,000 at most.
            Compares no literals.
    hermit  OWL 2 DL by HermiT, and what OWL 2 RL concludes from its results.
            Also finds what native cannot. Takes 5 s for 10,000 triples. Needs Java
            and an ontology that is OWL 2 DL.
    """
    from irtwin.knowledge.owl_rl.closure import Contradiction

    if (source is None) != (out is None):
        raise click.UsageError("SOURCE and --out go together." if source is None else "Missing option '--out'.")
    try:
        if source is not None and out is not None:
            from irtwin.knowledge.engines import close_file

            click.echo(f"{out}: {close_file(source, out, engine)} triples inferred by {engine}")
        else:
            from irtwin.workflow import reason_again

            reason_again(location, engine, announce)
            tell_contradictions(location)
    except Contradiction as clash:
        say(f"irtwin: {source or location.folder}: {clash}")
        sys.exit(3)


@click.command()
@located
@click.option("--owl", type=FILE, help="RDF/XML file to write: the whole graph.")
@click.option("--ros", type=FOLDER, help="Folder to write: a robot's ROS package.")
@click.option("--urdf", type=FILE, help="URDF file to write: a robot's twin.")
@click.option("--mjcf", type=FILE, help="The same for MuJoCo.")
@click.option("--sdf", type=FILE, help="The same for Gazebo and Drake.")
@click.option("--usd", metavar="FILE.usda", type=FILE, help="The same for Isaac Sim and Newton.")
@click.option("--aas", type=FILE, help="FILE.aasx or FILE.json to write: a robot as an Asset Administration Shell.")
@click.option("--robot", metavar="NAME", help="The robot; not needed where there is one alone.")
@click.option(
    "--twin",
    type=FILE,
    help="Twin that `irtwin diagnose --save-twin` wrote, instead of the workspace's.",
)
def export(location: Location, robot: str | None, twin: Path | None, **places: Path | None) -> None:
    """Write the graph for Protégé, or a robot for ROS or simulators.

    --owl writes ontology, individuals and inferences as one RDF/XML file.

    --ros writes a package for ROS 1 and 2 made of what the graph says of a robot: URDF, SRDF, limits, kinematics,
    RViz and launch files. MoveIt's setup needs nothing added to it. `irtwin robot ros` makes it of a URDF.

    --urdf, --mjcf, --sdf and --usd write a robot with the bodies, damping, dry friction and armature of its twin, as
    far as the format has them; what it has no place for is said. Of the URDF all else stays as it was. The package of
    --ros has them too, where the robot has a twin.

    --aas writes an Asset Administration Shell with nameplate, carbon footprint and energy a day. Needs irtwin[aas].

    \b
    Example: irtwin export --mjcf kr6.xml --robot KUKA_KR6_R700
    """
    form, out = _asked(places)
    if twin is not None and form not in _MODELS:
        raise click.UsageError("--twin goes with --urdf, --mjcf, --sdf or --usd.")
    if form in _MODELS:
        _export_model(form, out, location, robot, twin)
    elif form == "owl":
        from irtwin import asking

        if robot is not None:
            raise click.UsageError("--owl writes the whole graph; leave --robot out.")
        asking.export(out, location)
    elif form == "aas":
        from irtwin.report.aas import export_shell

        export_shell(out, location, robot)
    else:
        from irtwin.ros.export import export_package

        for line in export_package(out, location, robot):
            say(f"irtwin: {line}")
    click.echo(out)


def _asked(places: Mapping[str, Path | None]) -> tuple[str, Path]:
    """Return the one form that is asked for, and the place to write it to."""
    asked = [(form, place) for form in _FORMS if (place := places[form]) is not None]
    if len(asked) != 1:
        raise click.UsageError(f"Give one of {', '.join(f'--{form}' for form in _FORMS)}.")
    return asked[0]


def _export_model(form: str, out: Path, location: Location, robot: str | None, twin: Path | None) -> None:
    from irtwin import modelling

    if twin is None:
        from irtwin import plans

        known = plans.robot_twin(robot, location)
    else:
        known = modelling.read_twin(twin)
    for line in modelling.write_model(known, form, out):
        say(f"irtwin: {line}")


@workspace.command("map")
@click.argument("mapping", type=PLACE)
@click.option("--database", metavar="URL", required=True, help="SQLAlchemy URL of the database to map.")
@click.option("--out", type=FILE, required=True, help="N-Quads file to write.")
@click.option("--timeout", type=Number(min=0.1), default=600.0, show_default=True, help="Limit per triples map, s.")
@click.option("--base", metavar="IRI", help="What relative IRIs are below. Default: the document's @base.")
def map_database(mapping: Path, database: str, out: Path, timeout: float, base: str | None) -> None:
    """Map a database to triples with an R2RML document.

    Works with any R2RML document and any database that SQLAlchemy supports.

    \b
    Example: irtwin workspace map plant.r2rml.ttl --database sqlite:///plant.db --out plant.nq
    """
    from irtwin.knowledge.mapping import map_to_file

    map_to_file(mapping, database, out, base, timeout)

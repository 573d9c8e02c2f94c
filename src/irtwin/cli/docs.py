"""The command that opens the guide, and writes what a workspace or installed packages add to it."""

from __future__ import annotations

from pathlib import Path

import click

from irtwin.cli.options import FILE, no_open_option, show_page
from irtwin.location import Location


@click.command()
@no_open_option
@click.option("--ontology", type=FILE, help="HTML file to write instead: the ontology, with what packages add.")
@click.option("--questions", type=FILE, help="HTML file to write instead: what the graph can be asked by name.")
@click.option(
    "--workspace",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Folder whose ontology/ and questions/ are written too; its graph answers the questions.",
)
def docs(no_open: bool, ontology: Path | None, questions: Path | None, workspace: Path | None) -> None:
    """Open the guide: tutorials, notebooks, every command, Python. It needs no network.

    Where there is no desktop, the place of its first page is printed alone.

    \b
    Example: irtwin docs
    Example: irtwin docs --ontology terms.html --questions asked.html --workspace plant
    """
    if ontology or questions:
        _write(ontology, questions, workspace)
    elif workspace:
        raise click.UsageError("--workspace goes with --ontology or --questions.")
    else:
        from irtwin.resources import guide

        page = guide()
        click.echo(page)
        if not no_open:
            show_page(page)


def _write(ontology: Path | None, questions: Path | None, workspace: Path | None) -> None:
    from irtwin import asking
    from irtwin.report.ontology import questions_page
    from irtwin.report.ontology.page import write_page
    from irtwin.resources import resources_of

    known = resources_of() if workspace is None else asking.checked(workspace)
    if ontology is not None:
        write_page(ontology, known)
        click.echo(ontology)
    if questions is None:
        return
    if workspace is None:
        questions_page.write_page(questions, known)
    else:
        with asking.open_graph(Location(workspace)) as graph:
            questions_page.write_page(questions, known, graph)
    click.echo(questions)

"""What documents and comments lead to is there: files, sections, and the files of code that records name."""

import re
from functools import cache
from pathlib import Path

import irtwin

ROOT = Path(__file__).parents[1]
FOLDERS = ("bench", "docs", "examples", "mappings", "ontology", "reports", "rules", "src", "tests")
READ = {".md", ".py", ".ttl", ".rq", ".jinja", ".toml"}
DOCUMENTS = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]


@cache
def files() -> list[Path]:
    """All files of the project that a text may name."""
    below = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if "__pycache__" not in path.parts)
    return [path for path in [*below, *ROOT.glob("*")] if path.is_file()]


def sections(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def leads_somewhere(page: Path, target: str) -> bool:
    path, _, section = target.partition("#")
    to = page.parent / path if path else page
    another_site = ":" in path
    return another_site or (to.exists() and (not section or section in sections(to)))


def test_links_lead_somewhere():
    pages = [path for path in files() if path.suffix == ".md"]
    nowhere = {
        f"{page.relative_to(ROOT)}: {target}"
        for page in pages
        for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
        if not leads_somewhere(page, target)
    }
    assert not nowhere


def test_documents_that_a_text_names_are_there():
    named = re.compile(r"docs/[\w/-]+\.md")
    missing = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in files()
        if path.suffix in READ and path != Path(__file__)
        for name in named.findall(path.read_text(encoding="utf-8", errors="replace"))
        if not (ROOT / name).is_file()
    }
    assert not missing


def test_files_of_code_that_a_document_names_are_there():
    named = re.compile(r"`([\w./-]+/[\w.-]+\.(?:py|rq|ttl|toml))`")
    known = "\n".join(path.as_posix() for path in files()) + "\n"
    missing = {
        f"{page.relative_to(ROOT)}: {name}"
        for page in DOCUMENTS
        for name in named.findall(page.read_text(encoding="utf-8"))
        if f"/{name}\n" not in known
    }
    assert not missing


def test_the_architecture_names_every_room():
    page = (ROOT / "docs" / "ARCHITECTURE.md").read_text(encoding="utf-8")
    rooms = [
        f"{path.name}/" if path.is_dir() else path.name
        for path in (ROOT / "src" / "irtwin").iterdir()
        if path.name[0] not in "_." and (path.is_dir() or path.suffix == ".py")
    ]
    assert not [room for room in rooms if not re.search(rf"[`/ ]{re.escape(room)}", page)]


def test_papers_of_a_release_say_its_version():
    newest = re.search(r"^## ([\d.]+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert newest and cited and newest[1] == cited[1] == irtwin.__version__
    for module in (ROOT / "ontology").rglob("*.ttl"):
        assert re.findall(r'owl:versionInfo "([^"]+)"', module.read_text(encoding="utf-8")) == [irtwin.__version__], (
            module
        )

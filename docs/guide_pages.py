"""A hook of MkDocs: notebooks, run when the guide is built, are pages with their results; so is CONTRIBUTING.md."""

import ast
import contextlib
import io
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add these pages. One notebook goes on where the one before ended, in the order of their names."""
    notebooks = Path(config.docs_dir) / "notebooks"
    sys.path.insert(0, str(notebooks))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for notebook in sorted(notebooks.glob("*.ipynb")):
            text = "\n\n".join(parts(notebook))
            files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=text))
        for page in Path().rglob("*.html"):
            files.append(File.generated(config, f"made/{page.name}", content=page.read_bytes()))
    sys.path.remove(str(notebooks))
    contributing = Path(config.docs_dir, "..", "CONTRIBUTING.md").read_text(encoding="utf-8").replace("](docs/", "](")
    files.append(File.generated(config, "CONTRIBUTING.md", content=contributing))
    return files


def parts(notebook: Path) -> Iterator[str]:
    """Run the cells of a notebook, and yield each with what it shows, in Markdown."""
    names: dict[str, Any] = {}
    for number, cell in enumerate(json.loads(notebook.read_text(encoding="utf-8"))["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            yield source
        else:
            yield f"```python\n{source}\n```"
            yield shown(source, names, f"{notebook.name}, cell {number}")
    yield f"[This page as a notebook]({notebook.name}); its robot is [crane.py](crane.py)."


def shown(source: str, names: dict[str, Any], place: str) -> str:
    """Run a cell, and return what it prints and the value of its last line, as Jupyter shows them; a page is framed."""
    tree, value, printed = ast.parse(source), None, io.StringIO()
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, place, "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), place, "eval"), names)
    if hasattr(value, "_repr_html_"):
        return str(value._repr_html_())
    if isinstance(value, Path) and value.suffix == ".html":
        place = f"../made/{value.name}"
        return f'<iframe src="{place}" title="{value.name}" loading="lazy"></iframe>\n[The page by itself]({place})'
    text = printed.getvalue() + ("" if value is None else repr(value))
    return f"```text\n{text.rstrip()}\n```" if text else ""

"""Tutorials as notebooks: made of the pages themselves, run while the documentation is built, linked on each page.

``python docs/_ext/notebooks.py PAGE.md NOTEBOOK.ipynb`` makes one. Every block of Python becomes a cell with what it
prints; a picture of the page whose block before has drawn one is shown by a cell of its own.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import io
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

SOURCE = Path(__file__).parents[2] / "src" / "fingerslip"
_BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
_PICTURE = re.compile(r"^!\[[^\]]*\]\([^)]*\)\n", re.MULTILINE)
_ROLE = re.compile(r"\{(\w+)\}`~?([^`]+)`")
_LINK = '\n<p><a href="{0}.ipynb" download>This page as a notebook</a>, with all that it prints and draws.</p>\n'


def make_notebook(page: Path) -> dict[str, Any]:
    """Run the code of a page in the working directory and return the notebook."""
    cells, module, picture = [], ModuleType("notebook"), None
    sys.modules[module.__name__] = module  # dataclasses look their module up
    for number, (is_code, text) in enumerate(_pieces(page.read_text(encoding="utf-8"))):
        if is_code:
            before, printed = set(Path().glob("*.png")), io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(text, f"{page.name}, block {number}", "exec", dont_inherit=True), vars(module))
            cells.append(_code_cell(text, [_stream(printed.getvalue())] if printed.getvalue() else []))
            picture = next(iter(set(Path().glob("*.png")) - before), picture)
            continue
        words = _plain(text, page)
        if picture and _PICTURE.search(words):
            # What the code has drawn is shown in the place of the page's own picture.
            upper, lower = _PICTURE.split(words, maxsplit=1)
            cells += [_text_cell(upper), _picture_cell(picture), _text_cell(lower)]
            picture = None
        else:
            cells.append(_text_cell(words))
    named = [{"id": f"cell-{number}", **cell} for number, cell in enumerate(cells) if cell["source"]]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}, "digest": digest(page)}
    return {"cells": named, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def digest(page: Path) -> str:
    """Return the hash of all that decides a notebook: its page, the package, and this file."""
    files = [page, Path(__file__), *sorted(SOURCE.rglob("*.py")), *sorted(SOURCE.rglob("*.yaml"))]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def _pieces(text: str) -> Iterator[tuple[bool, str]]:
    """Yield the pieces of a page in order, and whether each is code."""
    for number, piece in enumerate(_BLOCK.split(text)):
        yield bool(number % 2), piece


def _plain(text: str, page: Path) -> str:
    """Return text without the marks of the documentation: pages by their titles, names as code."""

    def words(role: re.Match[str]) -> str:
        if role[1] != "doc":
            return f"`{role[2]}`"
        title = page.parent.joinpath(f"{role[2]}.md").resolve().read_text(encoding="utf-8").partition("\n")[0]
        return f"*{title.removeprefix('# ')}*"

    return _ROLE.sub(words, text)


def _text_cell(text: str) -> dict[str, Any]:
    return {"cell_type": "markdown", "metadata": {}, "source": text.strip("\n")}


def _code_cell(text: str, outputs: list[dict[str, Any]]) -> dict[str, Any]:
    code = text.strip("\n")
    return {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": outputs, "source": code}


def _stream(text: str) -> dict[str, Any]:
    return {"output_type": "stream", "name": "stdout", "text": text}


def _picture_cell(picture: Path) -> dict[str, Any]:
    data = {"image/png": base64.b64encode(picture.read_bytes()).decode("ascii"), "text/plain": f"{picture.name}"}
    shown = {"output_type": "display_data", "data": data, "metadata": {}}
    return _code_cell(f'from IPython.display import Image, display\n\ndisplay(Image("{picture.name}"))', [shown])


def _digest_of(notebook: Path) -> str:
    """Return the hash with which a notebook was made; empty where there is none."""
    return str(json.loads(notebook.read_text(encoding="utf-8"))["metadata"]["digest"]) if notebook.is_file() else ""


def _pages(app: Any) -> list[Path]:
    return sorted(path for path in Path(app.srcdir, "tutorials").glob("*.md") if path.stem != "index")


def _add_links(app: Any, name: str, source: list[str]) -> None:
    """Put the link to the notebook below the title of a page."""
    if app.builder.name == "html" and name in {f"tutorials/{page.stem}" for page in _pages(app)}:
        title, end, rest = source[0].partition("\n")
        source[0] = f"{title}{end}{_LINK.format(Path(name).name)}{rest}"


def _make_all(app: Any, failure: Exception | None) -> None:
    """Make the notebooks that are not there yet or whose page or program has changed."""
    for page in _pages(app) if failure is None and app.builder.name == "html" else ():
        notebook = Path(app.outdir, "tutorials", f"{page.stem}.ipynb")
        if _digest_of(notebook) != digest(page):
            subprocess.run([sys.executable, __file__, str(page), str(notebook)], check=True)


def setup(app: Any) -> dict[str, Any]:
    """Make the notebooks at the end of a build."""
    app.connect("source-read", _add_links)
    app.connect("build-finished", _make_all)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    given_page, target = (Path(name).resolve() for name in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        made = make_notebook(given_page)
    target.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

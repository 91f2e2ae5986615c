"""Notebooks of tutorials: every block of a page, with what it prints and draws, in words that need no documentation."""

import base64
import json
import subprocess
import sys
from types import SimpleNamespace

import pytest

from places import DOCS

PROGRAM = DOCS / "_ext" / "notebooks.py"
PNG = b"\x89PNG\r\n"
PAGE = f"""# A page

See {{doc}}`../other` and {{func}}`~fingerslip.simulate`.

```python
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Sum:
    first: int


print(Sum(1).first + 1)
```

Text between.

```python
Path("drawn.png").write_bytes({PNG!r})
```

![What is drawn](../figures/ours.png)

The end.

```console
$ ls
```
"""


@pytest.fixture
def make(tmp_path):
    """Return a function that makes the notebook of a page, and what came of it."""
    folder = tmp_path / "tutorials"
    folder.mkdir()
    (tmp_path / "other.md").write_text("# Another page\n")

    def call(text):
        (folder / "page.md").write_text(text)
        target = tmp_path / "page.ipynb"
        words = [sys.executable, str(PROGRAM), str(folder / "page.md"), str(target)]
        return subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path), target

    return call


def test_a_page_becomes_cells_with_what_they_print_and_draw(make, tmp_path):
    done, target = make(PAGE)
    assert done.returncode == 0, done.stderr
    notebook = json.loads(target.read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    cells = notebook["cells"]
    assert [cell["cell_type"] for cell in cells] == ["markdown", "code", "markdown", "code", "code", "markdown"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    assert cells[0]["source"] == "# A page\n\nSee *Another page* and `fingerslip.simulate`."
    assert cells[1]["outputs"] == [{"output_type": "stream", "name": "stdout", "text": "2\n"}]
    assert cells[3]["outputs"] == []
    assert 'Image("drawn.png")' in cells[4]["source"]
    assert base64.b64decode(cells[4]["outputs"][0]["data"]["image/png"]) == PNG
    assert cells[5]["source"] == "The end.\n\n```console\n$ ls\n```"
    assert not (tmp_path / "drawn.png").exists(), "pages are run in a folder of their own"


def test_a_page_that_fails_leaves_no_notebook(make):
    done, target = make("# A page\n\n```python\nassert 1 == 2\n```\n")
    assert done.returncode == 1
    assert "page.md, block 1" in done.stderr
    assert not target.exists()


def test_every_tutorial_links_its_notebook_and_no_other_page_does(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    import notebooks

    app = SimpleNamespace(srcdir=str(DOCS), builder=SimpleNamespace(name="html"))
    for name, is_linked in (("tutorials/robotics", True), ("tutorials/index", False), ("start", False)):
        source = ["# Title\n\nText\n"]
        notebooks._add_links(app, name, source)
        assert source[0].startswith("# Title\n")
        assert (f'href="{name.rpartition("/")[2]}.ipynb"' in source[0]) == is_linked

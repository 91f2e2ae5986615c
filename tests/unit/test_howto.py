"""The code of every how-to page and tutorial runs as it is printed, from top to bottom; its assertions are the test."""

import re
import sys
from types import ModuleType

import pytest

from places import DOCS

PAGES = sorted(path for path in (DOCS / "howto").glob("*.md") if path.name != "index.md")
LONG = {
    "results",
    "clusters",
    "own-mesh",
    "afferent-model",
    "held-object",
    "grip-controller",
}  # studies of their own, in other processes; seconds
TUTORIALS = sorted(path for path in (DOCS / "tutorials").glob("*.md") if path.name != "index.md")


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.slow] * (page.stem in LONG)) for page in PAGES],
    ids=lambda page: page.stem,
)
def test_page_runs(page, tmp_path, monkeypatch):
    run_page(page, tmp_path, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_tutorial_runs(page, tmp_path, monkeypatch):
    run_page(page, tmp_path, monkeypatch)


def run_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks, "a page has code"
    assert any("assert " in block for block in blocks), "and says what must come out"
    module = ModuleType("howto")
    # Dataclasses look their module up.
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"{page.name}, block {number}", "exec", dont_inherit=True), vars(module))

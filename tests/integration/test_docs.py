"""The documentation builds without a warning: a page for each public name, and a notebook for each tutorial."""

import json
import re
import subprocess
import sys

import pytest

import fingerslip as fs
from places import DOCS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Return the folder of the pages."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("docs")
    words = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-d", folder / "trees", "-b", "html"]
    done = subprocess.run([*words, DOCS, folder / "html"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "html"


def test_every_public_name_has_a_page_that_says_what_it_is_and_no_other_name_has(pages):
    names = {name for name in fs.__all__ if not name.startswith("__")}
    texts = {path.stem: path.read_text(encoding="utf-8") for path in (pages / "api" / "generated").glob("*.html")}
    assert set(texts) == {f"fingerslip.{name}" for name in names}
    titles = {name: re.search(r"<h1>([^<]+)<", text)[1] for name, text in texts.items()}
    assert titles == {name: name.removeprefix("fingerslip.") for name in texts}
    documented = set(re.findall(r'<dt class="sig sig-object py" id="(fingerslip\.\w+)"', "".join(texts.values())))
    assert documented == set(texts)


def test_every_tutorial_has_a_notebook_that_was_run(pages):
    tutorials = {path.stem for path in (DOCS / "tutorials").glob("*.md")} - {"index"}
    notebooks = {
        path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (pages / "tutorials").glob("*.ipynb")
    }
    assert set(notebooks) == tutorials
    for name, notebook in notebooks.items():
        outputs = [output["output_type"] for cell in notebook["cells"] for output in cell.get("outputs", ())]
        assert {"stream", "display_data"} <= set(outputs), f"{name} prints and draws"
        assert f'href="{name}.ipynb"' in (pages / "tutorials" / f"{name}.html").read_text(encoding="utf-8")

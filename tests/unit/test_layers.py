"""Imports run one way: lower layers only, and no two files import each other, not inside functions or for types."""

import ast
import graphlib
import re
from pathlib import Path

import fingerslip
from places import ROOT, parsed

SOURCE = Path(fingerslip.__file__).parent
ROWS = (
    "arrays libraries errors units storage parameters tables sites marker_layouts",
    "materials mesh specimens fe linear contact model history snapshot dynamics",
    "slip afferents vision marker_tracks uncertainty published results sampling report export detect",
    "react verification study environment validation commands",
)
LAYERS = [name for row in ROWS for name in row.split()]
# The package's face names everything lazily, and the entry point calls the command line.
FACES = {"__init__", "__main__", "version"}
# Looks for missing system libraries, so it must work where the package itself cannot be loaded.
ALONE = {"installation"}


def imported(tree, module):
    """Yield the absolute names of what a module imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split(".")[: -node.level] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            yield base
            if base == "fingerslip":
                yield from (f"fingerslip.{alias.name}" for alias in node.names)


def layer_of(name):
    """Return the layer that a module of the package belongs to; None for other packages and for the face."""
    parts = name.split(".")
    return parts[1] if parts[0] == "fingerslip" and len(parts) > 1 and parts[1] in LAYERS else None


def modules():
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found.append((".".join(["fingerslip", *parts]), path))
    return found


MODULES = [(name, path) for name, path in modules() if name.split(".")[1] not in FACES | ALONE]


def test_modules_import_lower_layers_only():
    assert [name for name, _ in MODULES if layer_of(name) is None] == [], "these belong to no layer"
    upwards = [
        f"{name} imports {other}"
        for name, path in MODULES
        for other in imported(parsed(path), name)
        if (layer := layer_of(other)) and LAYERS.index(layer) > LAYERS.index(layer_of(name) or "")
    ]
    assert upwards == []
    for name in ALONE:
        others = imported(parsed(SOURCE / f"{name}.py"), f"fingerslip.{name}")
        assert [other for other in others if other.split(".")[0] == "fingerslip"] == []
    allowed = {None, *ROWS[0].split(), "vision"}
    for name, path in MODULES:
        if name.split(".")[1] == "vision":
            layers = {layer_of(other) for other in imported(parsed(path), name)}
            assert layers <= allowed, f"{name}: what looks at markers knows nothing of finite elements"


def files_imported(tree, module, known):
    """Return the modules whose files a module imports: a name may be that of a module in a package."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = next(imported(ast.Module([node], []), module))
            inside = {f"{base}.{alias.name}" for alias in node.names}
            found |= (inside & known.keys()) or {base}
    return found & known.keys() - {module}


def cycle(graph):
    """Return modules that import each other, directly or through others; the first one again at the end."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_no_two_files_import_each_other():
    files = {name.removesuffix(".__init__"): path for name, path in modules()}
    trees = {name: parsed(path) for name, path in files.items()}
    graph = {name: files_imported(tree, name, files) for name, tree in trees.items()}
    assert sum(map(len, graph.values())) > 2 * len(graph), "the walk sees the imports"
    assert cycle(graph) == []


def test_files_that_import_each_other_are_found():
    files = {"a": Path("a.py"), "a.b": Path("a/b.py"), "c": Path("c.py")}
    inside = "def f():\n    from a import b\n"
    for_types = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from c import d\n"
    assert files_imported(ast.parse(inside), "c", files) == {"a.b"}
    assert files_imported(ast.parse(for_types), "a.b", files) == {"c"}
    assert set(cycle({"c": {"a.b"}, "a.b": {"c"}})) == {"a.b", "c"}
    assert set(cycle({"a": {"b"}, "b": {"c"}, "c": {"a"}})) == {"a", "b", "c"}
    assert cycle({"a": {"b", "c"}, "b": {"c"}}) == []
    code = "def f():\n    from fingerslip.commands.app import app\n    from ..study import spec\n"
    names = set(imported(ast.parse(f"{code}    from fingerslip import report\n"), "fingerslip.mesh.io"))
    assert {"fingerslip.commands.app", "fingerslip.study", "fingerslip.report"} <= names


def test_the_page_of_the_code_names_every_folder_and_file_of_the_package():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"(?<!})`([\w./]+)`", page))
    there = {f"{path.name}/" if path.is_dir() else path.name for path in SOURCE.iterdir()}
    hidden = {"__pycache__/", "__init__.py", "py.typed", "references.bib"}
    assert there - hidden - named == set(), "docs/architecture.md lacks these"
    files = {name for name in named if "/" in name and not name.startswith(("src/", "tests/"))}
    inner = {path.name for path in SOURCE.rglob("*") if path.is_dir()}
    gone = {name for name in files if not (SOURCE / name).exists() and name.rstrip("/") not in inner}
    assert gone == set(), "docs/architecture.md names these, which do not exist"

"""Imports run one way: a module may import lower layers only, inside functions too."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import fingerslip

SOURCE = Path(fingerslip.__file__).parent
ROWS = (
    "errors dotted units yaml_text fields mistakes parameters files digest sites",
    "materials mesh specimens fe linear contact model history dynamics",
    "slip uncertainty published report",
    "verification study validation commands",
)
LAYERS = [name for row in ROWS for name in row.split()]
# The package's face names everything lazily, and the entry point calls the command line.
FACES = {"__init__", "__main__", "version"}
# Looks for missing system libraries, so it must work where the package itself cannot be loaded.
ALONE = {"installation"}


def imported(tree: ast.AST, module: str) -> Iterator[str]:
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


def layer_of(name: str) -> str | None:
    """Return the layer that a module of the package belongs to; None for other packages and for the face."""
    parts = name.split(".")
    return parts[1] if parts[0] == "fingerslip" and len(parts) > 1 and parts[1] in LAYERS else None


def modules() -> list[tuple[str, Path]]:
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found.append((".".join(["fingerslip", *parts]), path))
    return found


MODULES = [(name, path) for name, path in modules() if name.split(".")[1] not in FACES | ALONE]


@pytest.mark.parametrize(("name", "path"), MODULES, ids=[name for name, _ in MODULES])
def test_module_imports_lower_layers_only(name: str, path: Path) -> None:
    own = layer_of(name)
    assert own is not None, f"{name} belongs to no layer"
    for other in imported(ast.parse(path.read_text(encoding="utf-8")), name):
        layer = layer_of(other)
        if layer is not None:
            assert LAYERS.index(layer) <= LAYERS.index(own), f"{name} imports {other}"


@pytest.mark.parametrize("name", sorted(ALONE))
def test_module_that_stands_alone_imports_nothing_of_the_package(name: str) -> None:
    tree = ast.parse((SOURCE / f"{name}.py").read_text(encoding="utf-8"))
    assert [other for other in imported(tree, f"fingerslip.{name}") if other.split(".")[0] == "fingerslip"] == []


def test_walk_sees_imports_inside_functions_and_relative_ones() -> None:
    inside = "def f():\n    from fingerslip.commands.app import app\n    from ..study import spec\n"
    code = f"{inside}    from fingerslip import report\n"
    found = set(imported(ast.parse(code), "fingerslip.mesh.io"))
    assert {"fingerslip.commands.app", "fingerslip.study", "fingerslip.report"} <= found

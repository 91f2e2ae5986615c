"""Every module has its test file at the mirrored place, and every test file its module."""

from __future__ import annotations

from pathlib import Path

import pytest

import fingerslip

SOURCE = Path(fingerslip.__file__).parent
TESTS = Path(__file__).parent
# The problems of the verification package are tests themselves: tests/physics/test_verification.py runs each.
MODULES = sorted(
    path.relative_to(SOURCE)
    for path in SOURCE.rglob("*.py")
    if path.name != "__init__.py" and path.parent.name != "verification"
)
# What is true of the package as a whole, and of no single module.
ABOUT_ALL = {"test_layers.py", "test_mirror.py", "test_package.py", "test_readme.py", "test_references.py"}


def mirrored(module: Path) -> Path:
    """Return where a module's tests are: folders below the first one are part of the file's name."""
    package, *below = module.with_suffix("").parts
    return Path(package, f"test_{'_'.join(below)}.py") if below else Path(f"test_{package}.py")


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_module_has_its_test_file(module: Path) -> None:
    file = TESTS / mirrored(module)
    assert file.is_file(), f"{module} has no tests/unit/{mirrored(module)}"
    assert "\ndef test_" in file.read_text(encoding="utf-8")


def test_every_test_file_has_its_module() -> None:
    wanted = {str(mirrored(module)) for module in MODULES} | ABOUT_ALL
    found = {str(path.relative_to(TESTS)) for path in TESTS.rglob("test_*.py")}
    assert sorted(found - wanted) == []


def test_mirrored_names() -> None:
    assert mirrored(Path("cli.py")) == Path("test_cli.py")
    assert mirrored(Path("mesh", "io.py")) == Path("mesh", "test_io.py")
    assert mirrored(Path("study", "validation", "rows.py")) == Path("study", "test_validation_rows.py")

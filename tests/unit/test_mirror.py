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
ABOUT_ALL = {
    "test_doctests.py",
    "test_howto.py",
    "test_layers.py",
    "test_mirror.py",
    "test_package.py",
    "test_readme.py",
    "test_references.py",
    "test_scripts.py",
    "test_start.py",
}


def mirrored(module: Path) -> Path:
    """Return where a module's tests are."""
    return module.with_name(f"test_{module.name}")


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_module_has_its_test_file(module: Path) -> None:
    file = TESTS / mirrored(module)
    assert file.is_file(), f"{module} has no tests/unit/{mirrored(module)}"
    assert "\ndef test_" in file.read_text(encoding="utf-8")


@pytest.mark.parametrize("tests", [TESTS, TESTS.parent / "integration"], ids=lambda path: path.name)
def test_every_test_file_has_its_module(tests: Path) -> None:
    wanted = {str(mirrored(module)) for module in MODULES} | ABOUT_ALL
    found = {str(path.relative_to(tests)) for path in tests.rglob("test_*.py")}
    assert sorted(found - wanted) == []


def test_mirrored_names() -> None:
    assert mirrored(Path("units.py")) == Path("test_units.py")
    assert mirrored(Path("contact", "solve", "newton.py")) == Path("contact", "solve", "test_newton.py")

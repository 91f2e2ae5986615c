"""The examples in docstrings give what they print."""

import doctest
import importlib
from pathlib import Path
from typing import get_args

import pytest

import fingerslip
from fingerslip.contact.friction import BuiltInLaw

SOURCE = Path(fingerslip.__file__).parent
EXAMPLES = {
    ".".join(["fingerslip", *path.relative_to(SOURCE).with_suffix("").parts]): path
    for path in sorted(SOURCE.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples(name):
    failed, attempted = doctest.testmod(importlib.import_module(name))
    assert failed == 0
    assert attempted == EXAMPLES[name].read_text(encoding="utf-8").count(">>> "), "doctest has not found all of them"


def test_contact_and_friction_laws_have_examples():
    laws = {"contact.interface", "contact.solve.newton", "contact.solve.projection"}
    friction = {law.__module__ for law in get_args(BuiltInLaw)}
    assert friction | {f"fingerslip.{law}" for law in laws} <= set(EXAMPLES)

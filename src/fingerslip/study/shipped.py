"""Studies and templates that travel with the package."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from fingerslip.errors import InputError, unknown_name
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.storage.files import write_text
from fingerslip.study.definition.file import PACKAGE, SHIPPED
from fingerslip.tables.table import Column, Table

_SCHEMA = "study.schema.json"
_BASE = re.compile(r"^base: (\w+)\.yaml", re.MULTILINE)
# What templates read, written beside them.
_READ = {"own-mesh": "pad.inp", "fit": "indentation.csv"}
#: The templates of new study files, by name.
TEMPLATES: Mapping[str, Path] = {path.stem: path for path in sorted(PACKAGE.glob("data/templates/*.yaml"))}


def studies_folder() -> Path:
    """Return the folder `studies` of the current folder, as in a checkout, or else that of the shipped studies."""
    folder = Path("studies")
    return folder if folder.is_dir() else SHIPPED


def examples() -> dict[str, Path]:
    """Return the files of the shipped studies by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.yaml"))}


def example_path(name: str) -> Path | None:
    """Return the file of a shipped study; None where none has the name."""
    return examples().get(name)


def examples_table() -> Table:
    """Return the shipped studies with what they show."""
    documents = {name: parse_document(file.read_text(encoding="utf-8"), name) for name, file in examples().items()}
    rows = tuple((name, str(document.content["title"])) for name, document in documents.items())
    note = "fingerslip examples NAME copies one into this folder; fingerslip new FILE starts one of your own."
    return Table("Studies that ship", (Column("name"), Column("shows")), rows, note)


def copy_example(name: str, folder: Path) -> Path:
    """Copy a shipped study, the studies that it is based on, and the schema by which editors check it."""
    shipped, name = examples(), name.removesuffix(".yaml")
    path = _write("study", name, shipped, folder / f"{name}.yaml")
    while base := _BASE.search(shipped[name].read_text(encoding="utf-8")):
        name = base[1]
        if not (folder / f"{name}.yaml").exists():
            write_text(folder / f"{name}.yaml", shipped[name].read_text(encoding="utf-8"))
    return path


def new_study(path: Path, template: str) -> Path:
    """Write a study file to start from, what it reads, and the schema by which editors check it."""
    written = _write("template", template, TEMPLATES, path if path.suffix else path.with_suffix(".yaml"))
    name = _READ.get(template)
    if name is not None and not written.with_name(name).exists():
        write_text(written.with_name(name), TEMPLATES[template].with_name(name).read_text(encoding="utf-8"))
    return written


def _write(kind: str, name: str, files: Mapping[str, Path], path: Path) -> Path:
    if name not in files:
        raise unknown_name(kind, name, files)
    if path.exists():
        raise InputError(str(path), "is there already", "is not overwritten", "give another name, or remove it")
    # The schema needs all of the package, the list of examples nothing of it.
    from fingerslip.study.definition.schema import schema_text

    write_text(path, files[name].read_text(encoding="utf-8").replace("THIS_FILE", path.name))
    write_text(path.with_name(_SCHEMA), schema_text())
    return path

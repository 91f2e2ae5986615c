"""Studies and templates that travel with the package."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from fingerslip.errors import InputError, unknown_name
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.storage.files import write_text
from fingerslip.tables.table import Column, Table

_SCHEMA = "study.schema.json"
_BASE = re.compile(r"^base: (\w+)\.yaml", re.MULTILINE)


def _data(name: str) -> Traversable:
    return resources.files("fingerslip").joinpath("data", name)


def _studies_folder() -> Traversable:
    """Return the folder of the shipped studies: in the package, or in a checkout that is installed in place."""
    packed = _data("studies")
    return packed if packed.is_dir() else Path(str(resources.files("fingerslip"))).parents[1] / "studies"


def _files_by_name(folder: Traversable) -> dict[str, Traversable]:
    files = [file for file in folder.iterdir() if file.name.endswith(".yaml")]
    return {file.name.removesuffix(".yaml"): file for file in sorted(files, key=lambda file: file.name)}


# What templates read, written beside them.
_READ = {"own-mesh": "pad.inp", "fit": "indentation.csv"}
#: The templates of new study files, by name.
TEMPLATES: Mapping[str, Traversable] = _files_by_name(_data("templates"))


def studies_folder() -> Path:
    """Return the folder `studies` of the current folder, as in a checkout, or else that of the shipped studies."""
    folder = Path("studies")
    return folder if folder.is_dir() else Path(str(_studies_folder()))


def examples() -> dict[str, Traversable]:
    """Return the shipped studies by name."""
    return _files_by_name(_studies_folder())


def example_path(name: str) -> Path | None:
    """Return the file of a shipped study; None where none has the name."""
    file = examples().get(name)
    return None if file is None else Path(str(file))


def examples_table() -> Table:
    """Return the shipped studies with what they show."""
    documents = {name: parse_document(file.read_text(encoding="utf-8"), name) for name, file in examples().items()}
    rows = tuple((name, str(document.content["title"])) for name, document in documents.items())
    note = "fingerslip examples NAME copies one into this folder; fingerslip new FILE starts one of your own."
    return Table("Studies that ship", (Column("name"), Column("shows")), rows, note)


def copy_example(name: str, folder: Path) -> Path:
    """Copy a shipped study, the studies that it is based on, and the schema by which editors check it."""
    shipped, name = examples(), name.removesuffix(".yaml")
    path = _write(_chosen("study", name, shipped), folder / f"{name}.yaml")
    while base := _BASE.search(shipped[name].read_text(encoding="utf-8")):
        name = base[1]
        if not (folder / f"{name}.yaml").exists():
            write_text(folder / f"{name}.yaml", shipped[name].read_text(encoding="utf-8"))
    return path


def new_study(path: Path, template: str) -> Path:
    """Write a study file to start from, what it reads, and the schema by which editors check it."""
    written = _write(_chosen("template", template, TEMPLATES), path if path.suffix else path.with_suffix(".yaml"))
    name = _READ.get(template)
    if name is not None and not written.with_name(name).exists():
        write_text(written.with_name(name), _data("templates").joinpath(name).read_text(encoding="utf-8"))
    return written


def _chosen(kind: str, name: str, files: Mapping[str, Traversable]) -> str:
    if name not in files:
        raise unknown_name(kind, name, files)
    return files[name].read_text(encoding="utf-8")


def _write(text: str, path: Path) -> Path:
    if path.exists():
        raise InputError(str(path), "is there already", "is not overwritten", "give another name, or remove it")
    # The schema needs all of the package, the list of examples nothing of it.
    from fingerslip.study.definition.schema import schema_text

    write_text(path, text.replace("THIS_FILE", path.name))
    write_text(path.with_name(_SCHEMA), schema_text())
    return path

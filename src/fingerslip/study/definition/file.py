"""Study files as plain data: YAML, and the files they are based on."""

from __future__ import annotations

import contextlib
import copy
import functools
import re
from collections.abc import Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError, Mistakes, most_similar, shorten
from fingerslip.parameters.dotted import known_part
from fingerslip.parameters.fields import in_order
from fingerslip.parameters.yaml_text import Document, parse_document, to_text


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping."""
    text = _read_text(path)
    content = copy.deepcopy(_entries_of_run(text) or _document(text, str(path)).content)
    if not isinstance(content, dict):
        fault = "is empty" if content is None else f"holds a {type(content).__name__}"
        raise InputError(str(path), fault, "needs 'key: value' lines")
    return content


def write_mapping(mapping: Mapping[str, Any], path: Path, *, comment: str = "") -> None:
    """Write plain data as YAML, keys in their order, below a comment line."""
    text = to_text(mapping)
    path.write_text(f"# {comment}\n{text}" if comment else text, encoding="utf-8")


@contextlib.contextmanager
def line_numbers(path: Path, where: str = "") -> Iterator[None]:
    """Give mistakes that begin with a file's path, or the name of a run of it, its lines and the order of these."""
    try:
        yield
    except InputError as error:
        front = f"{where or path}: "
        try:
            lines = _document(_read_text(path), str(path)).lines
        except InputError:  # what cannot be read has no lines
            raise error from None

        def line_of(place: str) -> int | None:
            return lines.get(f"sweep.{place}" if where else place, lines.get(known_part(place, lines)))

        raise Mistakes(
            mistake.moved(str, line_of(mistake.where.removeprefix(front)))
            for mistake in in_order(error.all, lines, front)
        ).error() from None


# A report reads the file of a run for its values and again for its study; parsing is most of that work.
@functools.lru_cache(maxsize=1024)
def _document(text: str, where: str) -> Document:
    return parse_document(text, where)


#: First line of the file of a run.
REPEATS = "fingerslip run run.yaml repeats this run"


def _entries_of_run(text: str) -> dict[str, Any]:
    """Return what the file of a run holds, each entry read once for all runs that have it; empty where that fails.

    Other files may have what reaches over several entries, as may this one when somebody has changed it.
    """
    entries = re.split(r"^(?=[^\s#-])", text, flags=re.MULTILINE)[1:] if text.startswith(f"# {REPEATS}\n") else []
    try:
        items = [item for entry in entries for item in _document(entry, "").content.items()]
    except (InputError, AttributeError):
        return {}
    content = dict(items)
    return content if len(content) == len(items) else {}


PACKAGE = Path(str(resources.files("fingerslip")))
_PACKED = PACKAGE / "data" / "studies"
#: Folder of the studies that ship: in the package, or in a checkout that is installed in place.
SHIPPED = _PACKED if _PACKED.is_dir() else PACKAGE.parents[1] / "studies"
# How files of meshes end, which are given in the place of a study.
_MESHES = {".inp": "a deck of Abaqus", ".feb": "a file of FEBio"} | dict.fromkeys(
    (".msh", ".vtu", ".vtk", ".xdmf", ".stl", ".bdf", ".med"), "a mesh"
)


def _read_text(path: Path) -> str:
    where, needed, name = str(path), "needs a study file", path.name.encode(errors="surrogateescape")
    if (kind := _MESHES.get(path.suffix.lower())) and path.is_file():
        repair = "fingerslip new pad.yaml --template own-mesh writes a study that reads a mesh"
        raise InputError(where, f"is {kind}", needed, repair)
    if name.decode(errors="replace").encode() != name:
        repair = "rename the file: results and reports are written under its name"
        raise InputError(shorten(ascii(path.name)), "is a name that is not UTF-8", needed, repair)
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        near = ", ".join(most_similar(where, map(str, path.parent.glob("*.yaml"))))
        repair = f"in that folder: {near}" if near else ""
        if path.suffix == ".yaml" and (SHIPPED / path.name).is_file():
            repair = f"it ships: fingerslip examples {path.stem} copies it here"
        raise InputError(where, "is not there", needed, repair) from None
    except IsADirectoryError:
        raise InputError(where, "is a folder", needed) from None
    except UnicodeDecodeError:
        raise InputError(where, "is not text in UTF-8", needed, "save it as UTF-8") from None
    except OSError as error:  # such as a name that is too long
        raise InputError(shorten(where), f"cannot be read ({error.strerror})", needed) from None


#: The key that names the base of a study file.
BASE = "base"


def read_with_base(path: Path) -> dict[str, Any]:
    """Read a study file, and what it does not write from its base.

    Groups are merged key by key; anything else that is written replaces what the base has, lists as a whole.
    """
    files, mappings = [path], [read_mapping(path)]
    while BASE in mappings[-1]:
        where, name = f"{files[-1]}: {BASE}", mappings[-1].pop(BASE)
        if not isinstance(name, str) or not name or Path(name).name != name:
            needed = "needs the name of a study file in the same folder"
            raise InputError(where, f"got {shorten(repr(name))}", needed, "copy it there")
        base = path.with_name(name)
        if base in files:
            names = shorten(" -> ".join(file.name for file in (*files, base)))
            raise InputError(where, f"leads back to {name} ({names})", "needs a file without this one as base")
        files.append(base)
        mappings.append(read_mapping(base))
    return functools.reduce(_merge, reversed(mappings))


@contextlib.contextmanager
def study_file(path: Path) -> Iterator[dict[str, Any]]:
    """Give what a study file and its base hold; mistakes that are raised in the block get their lines in the file."""
    mapping = read_with_base(path)
    with line_numbers(path):
        try:
            yield mapping
        except InputError as error:
            own = read_mapping(path)
            raise Mistakes(_with_law(mistake, path, own, mapping) for mistake in error.all).error() from None


def _with_law(mistake: InputError, path: Path, own: Mapping[str, Any], mapping: Mapping[str, Any]) -> InputError:
    """Say of a constant that the law of a material does not have where the law comes from the base of the file."""
    place = mistake.where.removeprefix(f"{path}: ").split(".")
    if BASE not in own or mistake.found != "is not known" or len(place) != 3 or place[0] != "materials":
        return mistake
    written, merged = ((study.get("materials") or {}).get(place[1]) for study in (own, mapping))
    law = merged.get("law") if isinstance(merged, Mapping) else None
    if law is None or not isinstance(written, Mapping) or "law" in written or place[2] not in written:
        return mistake
    repair = f"law: {law} comes from its base {own[BASE]}: write constants of that law, or change it there"
    return InputError(mistake.where, mistake.found, mistake.allowed, repair, mistake.line)


def _merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        inner = None if key == "sweep" else base.get(key)
        merged[key] = _merge(inner, value) if isinstance(inner, Mapping) and isinstance(value, Mapping) else value
    return merged

"""The JSON Schema of study files, which editors complete and check them by."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from typing import Any

from fingerslip.materials.choice import LAWS
from fingerslip.materials.elastic import Elastic
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.parameters.schema import json_schema
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.study.definition.file import BASE
from fingerslip.study.definition.spec import Study

_Schema = dict[str, Any]

_BASE = {
    "type": "string",
    "description": "Study file in the same folder that has all that is not written here.",
    "examples": ["wang2014_table2.yaml"],
}


@functools.cache
def schema_text() -> str:
    """Return the JSON Schema of study files as it stands in a file."""
    return json.dumps(study_schema(), indent=2) + "\n"


def study_schema() -> _Schema:
    """Return the JSON Schema of study files, for editors.

    Every key says what it means, its unit and its default; those of specimens also the values of each preset with their
    sources.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.study_schema()["properties"]["damping"]["description"]
    'Material damping.'
    """
    schema = json_schema(Study)
    definitions = schema.setdefault("$defs", {})
    for key, presets in SPECIMENS.items():
        words = schema["properties"][key].get("description", "")
        for part, definition in _definitions(presets).items():
            definitions.setdefault(part, definition)
        reference = {"anyOf": [{"$ref": f"#/$defs/{presets.kind.__name__}"}, {"type": "null"}], "default": None}
        schema["properties"][key] = reference | {"description": words}
    for law in LAWS:
        # What a preset gives may be left out of its materials, but not the name of another law than the usual one.
        definitions[law.__name__]["required"] = [] if law is Elastic else ["law"]
    schema["properties"] = {BASE: _BASE} | schema["properties"]
    # A base may have what the study leaves out.
    schema.pop("required", None)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _definitions(presets: Presets[Any]) -> dict[str, _Schema]:
    """Return the definitions of a specimen and of its parts, by their names."""
    element = json_schema(presets.kind)
    preset = {"enum": list(presets.names), "description": "The preset from which all values are that are not given."}
    element["properties"] = {"preset": preset} | element["properties"]
    definitions: dict[str, _Schema] = element.pop("$defs", {}) | {presets.kind.__name__: element}
    for name in presets.names:
        for value in presets.table(name):
            _tell_source(definitions, element, name, value)
    # A study file gives a preset and what differs from it, so nothing in it is required.
    return {
        part: {key: value for key, value in definition.items() if key != "required"}
        for part, definition in definitions.items()
    }


def _tell_source(definitions: Mapping[str, _Schema], definition: _Schema, preset: str, value: PresetValue) -> None:
    """Add the value that a preset gives, and its source, to the words of its key."""
    *groups, leaf = value.path.split(".")
    for group in groups:
        key = definition.get("properties", {}).get(group, {})
        # The key refers to a definition, which may be one of several.
        references = [option["$ref"] for option in (key, *key.get("anyOf", ())) if "$ref" in option]
        definition = definitions[references[0].rpartition("/")[2]] if references else {}
    if leaf in definition.get("properties", {}):
        key = definition["properties"][leaf]
        key["description"] = f"{key.get('description', '')} {preset}: {value.value} ({value.source}).".strip()

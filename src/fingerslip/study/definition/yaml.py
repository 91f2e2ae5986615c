"""Reading and writing YAML: the core schema of YAML 1.2, no key twice, errors with the line."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import yaml

from fingerslip.errors import InputError

__all__ = ["read_mapping", "write_mapping"]

# The core schema of YAML 1.2: 'no', 'on' and '1:30' are text, '1e-3' is a number.
_SCALARS: Mapping[str, tuple[str, list[str]]] = {
    "tag:yaml.org,2002:bool": (r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    "tag:yaml.org,2002:int": (r"[-+]?[0-9]+", list("-+0123456789")),
    "tag:yaml.org,2002:float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
    "tag:yaml.org,2002:null": (r"~|null|Null|NULL|", ["~", "n", "N", ""]),
}


class _Loader(yaml.SafeLoader):
    """A safe loader with the scalars of YAML 1.2 that refuses a key written twice."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's own registry)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:  # noqa: ARG002 (PyYAML calls it so)
        """Build a dictionary whose keys are text, each once."""
        seen: set[str] = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag == "tag:yaml.org,2002:merge":
                raise yaml.MarkedYAMLError(problem="a key that is not plain text", problem_mark=key_node.start_mark)
            if key_node.value in seen:
                raise yaml.MarkedYAMLError(problem=f"key '{key_node.value}' twice", problem_mark=key_node.start_mark)
            seen.add(key_node.value)
        return {key_node.value: self.construct_object(value, deep=True) for key_node, value in node.value}


for _tag, (_pattern, _first) in _SCALARS.items():
    _Loader.add_implicit_resolver(_tag, re.compile(f"^(?:{_pattern})$"), _first)


def _whole(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    return int(str(loader.construct_scalar(node)))


def _number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    text = str(loader.construct_scalar(node)).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


_Loader.add_constructor("tag:yaml.org,2002:int", _whole)
_Loader.add_constructor("tag:yaml.org,2002:float", _number)


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        Plain data with text keys.

    Raises
    ------
    InputError
        Where the file is missing, is no YAML, has a key twice, or holds no mapping.
    """
    try:
        content = yaml.load(_read_text(path), Loader=_Loader)
    except yaml.YAMLError as error:
        raise InputError(_place(path, error), _problem(error), "needs 'key: value' lines, each key once") from None
    if not isinstance(content, dict):
        found = "is empty" if content is None else f"holds a {type(content).__name__}"
        raise InputError(str(path), found, "needs 'key: value' lines")
    return content


def write_mapping(mapping: Mapping[str, Any], path: Path, *, comment: str = "") -> None:
    """Write plain data as YAML, keys in their order, below a comment line."""
    text = yaml.safe_dump(dict(mapping), sort_keys=False, allow_unicode=True, width=120)
    path.write_text(f"# {comment}\n{text}" if comment else text, encoding="utf-8")


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        near = ", ".join(sorted(str(other) for other in path.parent.glob("*.yaml"))[:6])
        repair = f"in that folder: {near}" if near else ""
        raise InputError(str(path), "is not there", "needs a study file", repair) from None
    except IsADirectoryError:
        raise InputError(str(path), "is a folder", "needs a study file") from None
    except UnicodeDecodeError:
        raise InputError(str(path), "is no text in UTF-8", "needs a study file") from None


def _place(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    return f"{path}: line {mark.line + 1}, column {mark.column + 1}" if mark else str(path)


def _problem(error: yaml.YAMLError) -> str:
    return f"found {getattr(error, 'problem', None) or 'text that is no YAML'}"

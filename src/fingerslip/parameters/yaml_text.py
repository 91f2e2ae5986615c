"""YAML text to plain data and back: the core schema of YAML 1.2, text keys, each once, and errors with their line.

Parsing is ruamel.yaml's. Its nodes, which know their lines, become dictionaries, lists and scalars here, and tags that
would make anything else are refused.
"""

from __future__ import annotations

import functools
import io
import pickle
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from types import MappingProxyType
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import MaxDepthExceededError
from ruamel.yaml.error import MarkedYAMLError, StringMark, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError
from ruamel.yaml.representer import SafeRepresenter
from ruamel.yaml.resolver import BaseResolver

from fingerslip.errors import InputError, shorten

_NEEDED = "needs 'key: value' lines, each key once"
_DEEPEST = 100
_LARGEST = 100_000
_LONGEST = 300
_CORE = "tag:yaml.org,2002:"
# The end of a line in YAML 1.1, a character like others in 1.2.
_NEXT_LINE = "\x85"
_NO_TEXT = re.compile("[\ud800-\udfff]")


@dataclass(frozen=True)
class _Kind:
    """A kind of scalar of the core schema: how it is written, with which first letters, and how it is read."""

    pattern: re.Pattern[str]
    first: tuple[str, ...]
    read: Callable[[str], object]


_INTEGER, _FLOAT = r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
# YAML 1.2.2, section 10.3.2: 'no', 'on' and '1:30' are text, '1e-3' is a number.
_KINDS: Mapping[str, _Kind] = MappingProxyType(
    {
        f"{_CORE}{name}": _Kind(re.compile(rf"(?:{pattern})\Z", re.DOTALL), tuple(first), read)
        for name, pattern, first, read in (
            ("bool", "true|True|TRUE|false|False|FALSE", "tTfF", lambda text: text.lower() == "true"),
            ("int", _INTEGER, "-+0123456789", lambda text: int(text, 0 if text[:2] in ("0o", "0x") else 10)),
            (
                *("float", rf"{_FLOAT}|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+.0123456789"),
                lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
            ),
            ("null", "~|null|Null|NULL|", ("~", "n", "N", ""), lambda _: None),
            ("str", ".*", (), str),
        )
    }
)


class _CoreSchema(BaseResolver):
    """Resolves plain scalars by the core schema, whatever version a file claims."""

    def __init__(self, version: object = None, loader: Any = None) -> None:  # noqa: ARG002  YAML calls it so
        super().__init__(loader)

    @property
    def processing_version(self) -> tuple[int, int]:
        """The version of YAML."""
        return (1, 2)


class _PlainData(SafeRepresenter):
    """Writes shared values out, and quotes text with a character that ruamel.yaml takes for the end of a line."""

    def ignore_aliases(self, _data: object) -> bool:
        """Tell that a value gets no alias."""
        return True

    def quote_if_special(self, text: str) -> Node:
        """Return the node of a text."""
        return self.represent_scalar(f"{_CORE}str", text, style='"' if _NEXT_LINE in text else None)


_PlainData.add_representer(str, _PlainData.quote_if_special)

for _tag, _kind in _KINDS.items():
    _CoreSchema.add_implicit_resolver_base(_tag, _kind.pattern, _kind.first)


@dataclass(frozen=True)
class Document:
    """A YAML document."""

    content: Any  # dictionaries with text keys, lists, text, numbers, booleans and None
    # line of every value by its dotted path, such as ``programme.0.press``, in the order of the text
    lines: Mapping[str, int]


def parse_document(text: str, where: str) -> Document:
    """Read YAML text."""
    lines: dict[str, int] = {}
    root = _compose(text, where)
    if root is None:
        return Document(None, lines)
    return Document(_Builder(where, lines, count(1)).value(root, "", 0), lines)


def to_text(mapping: Mapping[str, Any]) -> str:
    """Write plain data as YAML in block style, keys in their order."""
    # Runs of a sweep differ in few entries. Pickled, values are the same only where their text is.
    return "".join(_entry(key, pickle.dumps(value)) for key, value in mapping.items()) or "{}\n"


@functools.lru_cache(maxsize=128)
def _entry(key: str, pickled: bytes) -> str:
    """Return an entry of a mapping as YAML."""
    writer = YAML(typ="safe", pure=True)
    writer.Resolver = _CoreSchema
    writer.default_flow_style = False
    writer.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    writer.width = 120
    writer.Representer = _PlainData
    stream = io.StringIO()
    writer.dump({key: pickle.loads(pickled)}, stream)
    return stream.getvalue()


def _compose(text: str, where: str) -> Node | None:
    reader = YAML(typ="safe", pure=True)
    reader.Resolver = _CoreSchema
    reader.max_depth = _DEEPEST
    reader.composer.warn_double_anchors = False
    try:
        root: Node | None = reader.compose(text)
    except MaxDepthExceededError as error:
        raise _too_deep(_place(where, error.problem_mark)) from None
    except MarkedYAMLError as error:
        problem = str(error.problem or "text that is no YAML").removeprefix("but ").removeprefix("found ")
        repair = "indent with spaces" if "'\\t'" in problem else ""
        position = _place(where, error.problem_mark or error.context_mark)
        raise InputError(position, f"found {problem}", _NEEDED, repair) from None
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        fault = f"found a character that YAML does not allow (code {error.character:#x})"
        raise InputError(f"{where}: line {line}", fault, "needs text") from None
    except (YAMLError, ValueError, OverflowError) as error:
        raise InputError(where, f"found text that is no YAML ({error})", _NEEDED) from None
    return root


def _place(where: str, mark: StringMark | None) -> str:
    return where if mark is None else f"{where}: line {mark.line + 1}, column {mark.column + 1}"


def _too_deep(position: str) -> InputError:
    return InputError(position, f"found values nested more than {_DEEPEST} deep", "needs fewer levels")


@dataclass(frozen=True)
class _Builder:
    """Turns nodes into plain data, and notes their lines."""

    where: str
    lines: dict[str, int]
    numbers: Iterator[int]

    def value(self, node: Node, path: str, depth: int) -> Any:
        """Return what a node holds; aliases are written out, so that their size and depth are limited here."""
        if depth > _DEEPEST:
            raise _too_deep(_place(self.where, node.start_mark))
        if next(self.numbers) > _LARGEST:
            raise self._error(node, f"found more than {_LARGEST} values", "needs fewer, or fewer aliases")
        match node:
            case MappingNode():
                self._check_tag(node, f"{_CORE}map")
                self._check_braces(node)
                return {key: self.value(item, f"{path}{key}.", depth + 1) for key, item in self._items(node, path)}
            case SequenceNode():
                self._check_tag(node, f"{_CORE}seq")
                return [self._item(item, f"{path}{index}", depth) for index, item in enumerate(node.value)]
            case _:
                return self._scalar(node)

    def _items(self, node: MappingNode, path: str) -> Iterator[tuple[str, Node]]:
        seen: set[str] = set()
        for key, item in node.value:
            if not isinstance(key, ScalarNode):
                raise self._error(key, "found a key that is not plain text", _NEEDED)
            self._check_characters(key)
            if len(key.value) > _LONGEST:
                raise self._error(key, f"found a key of {len(key.value)} characters", f"needs at most {_LONGEST}")
            if key.value in seen:
                raise self._error(key, f"found key '{shorten(key.value)}' twice", _NEEDED)
            seen.add(key.value)
            self.lines[f"{path}{key.value}"] = key.start_mark.line + 1
            yield key.value, item

    def _check_braces(self, node: MappingNode) -> None:
        """Refuse a key without a value between braces that shows a decimal comma, or a colon without a space."""
        before = None
        for key, item in node.value if node.flow_style else ():
            is_bare = all(isinstance(entry, ScalarNode) and not entry.style for entry in (key, item)) and not item.value
            if is_bare and before and re.fullmatch(r"-?\d+,\d+( *[^\d ].*)?", text := f"{before.value},{key.value}"):
                # Three digits may be thousands.
                repair = "" if re.search(r",\d{3}\b", text) else f"write {text.replace(',', '.')}"
                raise self._error(before, f"found '{shorten(text)}'", "needs a decimal point, not a comma", repair)
            name, colon, rest = key.value.partition(":") if is_bare else ("", "", "")
            if colon:
                needed = f"needs {name}: {shorten(rest) or 'and a value'}"
                raise self._error(key, f"found '{shorten(key.value)}', with no space behind the colon", needed)
            before = item if isinstance(item, ScalarNode) else None

    def _scalar(self, node: Node) -> object:
        self._check_tag(node, *_KINDS)
        self._check_characters(node)
        tag = str(node.tag)
        kind, name = _KINDS[tag], tag.removeprefix(_CORE)
        if not kind.pattern.match(node.value):
            fault = f"found '{shorten(node.value)}' with the tag !!{name}"
            raise self._error(node, fault, f"needs a value of type {name}")
        if name == "int" and len(node.value) > _LONGEST:  # larger than any float, and slow to read and print
            raise self._error(node, f"found a number of {len(node.value)} digits", f"needs at most {_LONGEST}")
        return kind.read(node.value)

    def _item(self, node: Node, path: str, depth: int) -> Any:
        self.lines[path] = node.start_mark.line + 1
        return self.value(node, f"{path}.", depth + 1)

    def _check_characters(self, node: Node) -> None:
        """Refuse halves of characters, which escapes may make but no text in UTF-8 holds."""
        wrong = _NO_TEXT.search(node.value)
        if wrong:
            raise self._error(node, f"found a character that is no text (code {ord(wrong[0]):#x})", "needs text")

    def _check_tag(self, node: Node, *tags: str) -> None:
        if node.tag not in tags:
            fault = f"found the tag {str(node.tag).replace(_CORE, '!!')}"
            raise self._error(node, fault, "needs plain keys, lists and values", "leave the tag out")

    def _error(self, node: Node, fault: str, needed: str, repair: str = "") -> InputError:
        return InputError(_place(self.where, node.start_mark), fault, needed, repair)

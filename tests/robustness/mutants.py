"""Random damage to text, plain data and bytes, repeatable by its random numbers."""

import copy
import random
import re
from collections.abc import Iterator
from typing import Any

#: Values that a YAML file may hold in place of any other.
FRAGMENTS = (
    *("!!int x", '!!bool ""', "!!timestamp abc", "!!timestamp 2020-01-01", "!!float 0x1", "!!null x", "!!set {a, b}"),
    *("!!binary aGVsbG8=", "!!python/object:os.system x", "!custom 1", "!!str 5 mm", "!!omap [a: 1]", "!!seq {}"),
    *("1" * 5000, "-" + "9" * 400, "0x" + "f" * 5000, "0o" + "7" * 400),
    *("1_000", "1e400", "-1e-400", "0.1" + "0" * 5000),
    *("[" * 1000, "[" * 1000 + "]" * 1000, "{a: " * 300 + "1" + "}" * 300, "- - - -"),
    *("*a", "&a [*a]", "&a 5 mm", "5 mm/0", "5 m^9^9^9", "1 mm*9**9**9", "5 mm*0", "5 mm/mm*mm"),
    *("1e99999999999999999999 mm", "-1e99999999999999999999 mm", "1e-99999999999999999999 mm", "1e308 km"),
    *("5 mm**999999999", "5 mm**0.5", "5 m m", "5 (", "5 mm)", "5 'mm'", "5 __import__", "5 mm # x", "5 µm", "5 Ω"),
    *("5 degC", "5 delta_degC", "5 1e9", "5 %", "5 mm/s^2^3", "nan mm", "inf mm", "1e-9 s", "1e9 s", "-0 mm", "0 Pa"),
    *(".inf", "-.inf", ".nan", "0", "-0.0", "-1", "1e-300", "1e300", "3", "2.5", "true", "off", "~", "null", '""'),
    *("2020-01-01", "12:30:45", "[]", "{}", "[x, y, z, w]", "[1, 2, 3]", "{x: 1}", "{<<: {a: 1}}", "<<", "=", "? x"),
    *("|\n  text", ">-\n\n", "'", '"', '"\\ud800"', '"\\0"', "@", "`", "%", "\t5 mm", "é", "\x85", "\u2028", "\ufeff"),
    *("original", "slide", "press", "hold", "solid", "plane_stress", "skin", "phalanx", "x", "nodal", "T10", "0.6"),
    *("1 mm", "1 s", "1 kPa", "1 mm/s", "1 kg/m^3", "1e-15 mm", "1e12 mm", "1e-12 mm/s", "1e15 Pa"),
    *("90 deg", "1e9 deg"),
)
#: Names that other programs, people and languages give: quotes, formulas, controls, direction marks, half characters.
FOREIGN = (
    *("it's", 'a "b"', "=1+1", "@SUM(A1)", "<script>", "a\nb", "a\tb", "\x07", "\u202eabc", "пальец", "指", "e\u0301"),
    *("a/b", "..", " ", "", "a" * 300, "nan", "%s", "{0}", "$x", "`ls`", "C:\\x", "time"),
)
_VALUES = (
    *(None, True, False, 0, -1, 1, 10**400, -(10**30), 0.5, 1e300, -1e300, float("nan"), float("inf"), "", "x"),
    *([], {}, [1], [[]], {"a": 1}, ["x", "x"], {"": ""}, [None], "5 mm", "1e-9 s", "é\x00", "/", "..", "." * 300),
)
_BYTES = (
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe9", b"\t", b"\r", b"\x85", b"{", b"}", b":", b"-", b"\n", b"9" * 400),
)


def changed_text(text: str, chance: random.Random) -> str:
    """Return YAML text with one to three values, keys or lines changed."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        text = chance.choice((_other_value, _other_value, _other_value, _moved_line, _other_word))(text, chance)
    return text


def changed_data(values: Any, chance: random.Random) -> Any:
    """Return plain data with one to three entries changed, removed, renamed, copied or of another type."""
    values = copy.deepcopy(values)
    for _ in range(chance.choice((1, 1, 2, 3))):
        places = list(_entries(values))
        if not places:
            return values
        container, key = chance.choice(places)
        _change(container, key, chance, chance.choice(places))
    return values


def changed_bytes(content: bytes, chance: random.Random) -> bytes:
    """Return bytes cut short, emptied, with some flipped, inserted, removed or repeated."""
    start, length = chance.randrange(len(content) + 1), chance.choice((1, 1, 4, 50, 1000))
    whole = (b"", b"\x00", b"null", b"[]", b"{}", b"3", content[::-1], b"\xff" * 100)
    ways = (
        lambda: content[:start],
        lambda: chance.choice(whole),
        lambda: content[:start] + chance.randbytes(length) + content[start + length :],
        lambda: content[:start] + content[start + length :],
        lambda: content[:start] + chance.choice(_BYTES) + content[start:],
        lambda: content[: start + length] + content[start:],
        lambda: _flipped(content, chance),
    )
    return chance.choice(ways)()


def _flipped(content: bytes, chance: random.Random) -> bytes:
    flipped = bytearray(content)
    for _ in range(chance.choice((1, 3, 30)) if content else 0):
        flipped[chance.randrange(len(flipped))] ^= 1 << chance.randrange(8)
    return bytes(flipped)


def _other_value(text: str, chance: random.Random) -> str:
    places = list(re.finditer(r"(?<=[:,\[\-] )[^\s,{}\[\]:][^,{}\[\]\n#]*", text))
    if not places:
        return text + chance.choice(FRAGMENTS)
    place = chance.choice(places)
    return text[: place.start()] + chance.choice(FRAGMENTS) + text[place.end() :]


def _moved_line(text: str, chance: random.Random) -> str:
    lines = text.splitlines(keepends=True) or [""]
    taken = lines.pop(chance.randrange(len(lines)))
    for _ in range(chance.choice((0, 1, 2))):
        lines.insert(chance.randrange(len(lines) + 1), taken)
    return "".join(lines)


def _other_word(text: str, chance: random.Random) -> str:
    words = list(re.finditer(r"\w+", text))
    if not words:
        return text
    place, other = chance.choice(words), chance.choice(words)[0]
    return text[: place.start()] + chance.choice((other, other, "", place[0][1:], place[0] * 2)) + text[place.end() :]


def _entries(values: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every container with each of its keys."""
    keys = list(values) if isinstance(values, dict) else range(len(values)) if isinstance(values, list) else ()
    for key in keys:
        yield values, key
        yield from _entries(values[key])


def _change(container: Any, key: Any, chance: random.Random, other: tuple[Any, Any]) -> None:
    match chance.randrange(6):
        case 0:
            del container[key]
        case 1 if isinstance(container, dict):
            container[chance.choice((f"{key}s", str(other[1]), key[:-1], "", key.upper()))] = container.pop(key)
        case 2:
            container[key] = copy.deepcopy(other[0].get(other[1]) if isinstance(other[0], dict) else other[0][0])
        case 3:
            container[key] = [container[key]] if chance.random() < 0.5 else {"value": container[key]}
        case _:
            container[key] = copy.deepcopy(chance.choice(_VALUES))

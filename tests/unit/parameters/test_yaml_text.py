"""YAML text: whatever stands in it gives plain data with lines, or one clear error."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.parameters.yaml_text import Document, parse_document, to_text

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


NEEDED = "needs 'key: value' lines, each key once"
TAB = f"f: line 2, column 1: found character '\\t' that cannot start any token, {NEEDED}; indent with spaces"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: !!int x", "f: line 1, column 4: found 'x' with the tag !!int, needs a value of type int"),
        ('a: !!bool ""', "f: line 1, column 4: found '' with the tag !!bool, needs a value of type bool"),
        ("a: !!float x", "f: line 1, column 4: found 'x' with the tag !!float"),
        ("a: !!null x", "f: line 1, column 4: found 'x' with the tag !!null"),
        ("b: 1\na: !!timestamp abc", "f: line 2, column 4: found the tag !!timestamp"),
        ("a: !!python/object:os.system {}", "f: line 1, column 4: found the tag !!python/object:os.system"),
        ("a: !!set {x, y}", "f: line 1, column 4: found the tag !!set"),
        ("a: !!str [1]", "f: line 1, column 4: found the tag !!str"),
        ("a: !mine 3", "f: line 1, column 4: found the tag !mine, needs plain keys, lists and values; leave"),
        (f"a: {'9' * 5000}", "f: line 1, column 4: found a number of 5000 digits, needs at most 300"),
        (f"a: 0x{'f' * 5000}", "f: line 1, column 4: found a number of 5002 digits, needs at most 300"),
        (f"a: {'[' * 1000}{']' * 1000}", "f: line 1, column 103: found values nested more than 100 deep"),
        ("a: &a [*a]", "f: line 1, column 4: found values nested more than 100 deep"),
        (BOMB, "f: line 1, column 11: found more than 100000 values, needs fewer, or fewer aliases"),
        ("a: *b", "f: line 1, column 4: found undefined alias 'b'"),
        (f"a:\n  ? {'k' * 1000}\n  : 1", "f: line 2, column 5: found a key of 1000 characters"),
        ("a: 1\n---\nb: 2", "f: line 2, column 1: found another document"),
        ("a: \x01", "f: line 1: found a character that YAML does not allow (code 0x1), needs text"),
        ('a: "\\UFFFFFFFF"', "f: found text that is no YAML"),
        ('a: "x\\uD800"', "f: line 1, column 4: found a character that is no text (code 0xd800), needs text"),
        ('"\\ud834": 1', "f: line 1, column 1: found a character that is no text (code 0x"),
        ('- "\\udfff"', "f: line 1, column 3: found a character that is no text (code 0x"),
        ("%YAML 9.9\n---\na: 1", "f: line 1, column 1: found incompatible YAML document"),
        ("a:\n\tb: 1", TAB),
        (
            "a: {b: 1,5 mm, c: 2}",
            "f: line 1, column 8: found '1,5 mm', needs a decimal point, not a comma; write 1.5",
        ),
        ("a: {b: 0,25}", "f: line 1, column 8: found '0,25', needs a decimal point, not a comma; write 0.25"),
        ("a: {b: 1,500 Pa}", "f: line 1, column 8: found '1,500 Pa', needs a decimal point, not a comma"),
        ("a: {b:, c: 2}", "f: line 1, column 5: found 'b:', with no space behind the colon, needs b: and a value"),
        ("a: {b:1 mm}", "f: line 1, column 5: found 'b:1 mm', with no space behind the colon, needs b: 1 mm"),
    ],
)
def test_exotic_text_gives_one_clear_error(text, message):
    with pytest.raises(InputError) as caught:
        parse_document(text, "f")
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


@given(text=st.text(st.sampled_from("ab01-:#[]{}&*!|>'\"%@, \n\t.~<=?\\xU\x00\ufeff\u2028"), max_size=60))
@example(text="a: !!int ''")
@example(text="? a")
def test_any_text_gives_plain_data_or_one_clear_error(text):
    try:
        found = parse_document(text, "f")
    except InputError as error:
        found = error
    assert isinstance(found, Document) or found.where.startswith("f")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *[(text, text) for text in ("no", "on", "yes", "1:30", "1_000", "0b11", "2001-12-14", "=", "1.5 mm", "tRUE")],
        *[("true", True), ("False", False), ("~", None), ("", None), ("NULL", None)],
        *[("010", 10), ("0o17", 15), ("0x1F", 31), ("+1", 1)],
        *[("1e-3", 1e-3), ("-.5", -0.5), ("1.", 1.0), ("12e03", 12e3), ("-.inf", -math.inf)],
        *[('"1"', "1"), ("'no'", "no"), ("!!str 1", "1"), ("!!float 1", 1.0), ("|\n  x\n  y", "x\ny")],
    ],
)
def test_scalars_are_those_of_the_core_schema(text, value):
    found = parse_document(f"a: {text}", "f").content
    assert found == {"a": value}
    assert type(found["a"]) is type(value)


def test_every_value_has_its_line_in_the_order_of_the_text():
    text = "# first\nb: 1\na:\n  - c: 1\n    d: [1,\n      2]\n  - &x {e: 1}\nf: *x\nsweep:\n  time.step: [1]\n"
    found = parse_document(text, "f")
    assert dict(found.lines) == {
        "b": 2,
        "a": 3,
        "a.0": 4,
        "a.0.c": 4,
        "a.0.d": 5,
        "a.0.d.0": 5,
        "a.0.d.1": 6,
        "a.1": 7,
        "a.1.e": 7,
        "f": 8,
        "f.e": 7,
        "sweep": 9,
        "sweep.time.step": 10,
        "sweep.time.step.0": 10,
    }
    assert list(found.lines)[:2] == ["b", "a"]
    for nothing in ("", "# nothing", "---"):
        assert parse_document(nothing, "f") == Document(None, {})


@given(value=st.text(max_size=30) | st.floats(allow_nan=False) | st.booleans() | st.none() | st.integers())
@example("\x85")
@example("two\x85words")
@example("\x85 ")
@example("\u2028")
@example("a\n\x85b")
def test_every_scalar_and_key_reads_back_as_it_was_written(value):
    assert parse_document(to_text({"a": value}), "f").content == {"a": value}
    if isinstance(value, str):
        assert parse_document(to_text({value: value}), "f").content == {value: value}
    shared = [1, 2]
    assert to_text({"a": shared, "b": shared}) == "a:\n- 1\n- 2\nb:\n- 1\n- 2\n"

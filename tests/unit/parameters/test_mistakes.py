"""What pydantic finds wrong: each mistake once, at its place, in plain words, in the order of the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.model.programme import Press, Slide
from fingerslip.parameters import PositiveDuration, PositiveLength, from_mapping, parameters
from fingerslip.parameters.fields import locate, mistakes_in, type_hints, unit_of
from fingerslip.sampling.curves import FitSettings
from fingerslip.specimens.fingertip.numbers import Receptors
from fingerslip.study.definition.settings import ContactSettings
from fingerslip.study.definition.spec import Study
from unit.study.block import block_values


def found(cls, values):
    with pytest.raises(InputError) as caught:
        from_mapping(cls, values)
    return str(caught.value).splitlines()


@parameters
class Step:
    """A group that needs a quantity alone."""

    step: PositiveDuration
    alpha: float = 0.0


@parameters
class Timed:
    """Groups and lists."""

    time: Step
    times: tuple[Step, ...]
    named: Mapping[str, Step]


MISTAKES = {
    "several": (
        Slide,
        {"speed": 3, "distance": "1 kg", "way": 1},
        [
            "speed: '3' has no unit, needs a unit of [m/s]; write '3 mm/s' or '3 m/s'",
            "distance: got '1 kg', needs a unit of [m]; write for example '1 mm'",
            "way: is not known, may be one of distance, speed, direction, press",
        ],
    ),
    "the depth of another receptor": (
        Receptors,
        {"fa_i_depth": "1 mm", "sa_ii_height": "0 mm", "fa_ii_depth": "3 mm"},
        ["fa_i_depth: is not known, may be one of sa_ii_height, fa_ii_depth"],
    ),
    "a misspelt key and a missing one": (
        Press,
        {"dept": "1 mm"},
        [
            "dept: is not known, may be one of depth, speed; did you mean 'depth'?",
            "speed: is missing, needs a value such as 1.5 mm/s",
        ],
    ),
    "one of a few words": (
        FitSettings,
        {"columns": {"normal_force": "1 mN"}},
        ["over: is missing, needs one of depth, displacement, time"],
    ),
    "several of one check": (
        ContactSettings,
        {"boundary": 3, "normal": ["x"], "programme": [{"press": {}}], "friction_coefficient": float("inf")},
        [
            *("boundary: got 3, needs text", "normal.0: got 'x', needs a number"),
            *(
                f"programme.0.press.{name}: is missing, needs a value such as 1.5 {unit}"
                for name, unit in (("depth", "mm"), ("speed", "mm/s"))
            ),
            "friction_coefficient: got inf, needs a finite number",
        ],
    ),
    "groups, of which some need quantities alone": (
        Timed,
        {},
        [
            "time: is missing, needs a value such as {step: 1.5 ms}",
            "times: is missing, needs a value",
            "named: is missing, needs a value",
        ],
    ),
    "a mapping": (ContactSettings, {"friction_coefficient": {}}, ["friction_coefficient: got {}, needs a number"]),
}


@pytest.mark.parametrize(("cls", "values", "lines"), MISTAKES.values(), ids=MISTAKES)
def test_all_mistakes_are_found_and_told_in_plain_words_of_limited_length(cls, values, lines):
    assert found(cls, values) == lines
    (line,) = found(ContactSettings, {"friction_coefficient": list(range(1000))})
    assert line.startswith("friction_coefficient: got [0, 1, 2,")
    assert line.endswith("..., needs a number")
    assert len(line) < 140


def test_mistakes_of_plain_pydantic_and_of_calls_are_told_too():
    with pytest.raises(pydantic.ValidationError) as caught:
        pydantic.TypeAdapter(ContactSettings).validate_python({"boundary": 1, "friction_coefficient": 0.5})
    assert [str(mistake) for mistake in mistakes_in(caught.value, ContactSettings)] == ["boundary: got 1, needs text"]
    with pytest.raises(InputError, match=r"Press\.depth: got 2 mm, needs its value once, by place or by name"):
        Press(1e-3, 1e-3, depth=2e-3)
    with pytest.raises(InputError, match=r"Press\.2: got 7, needs fewer values, or their names"):
        Press(1e-3, 1e-3, 7)


@parameters
class Skin:
    """A member of the unions below, called like a key."""

    width: PositiveLength


@parameters
class Bone:
    """Another member."""

    depth: PositiveLength


def kind(value):
    return "bony" if isinstance(value, Bone) or (isinstance(value, Mapping) and "depth" in value) else "Skin"


@parameters
class Body:
    """Unions of every kind."""

    layers: Mapping[str, Skin | Bone]
    tagged: (
        Annotated[
            Annotated[Skin, pydantic.Tag("Skin")] | Annotated[Bone, pydantic.Tag("bony")], pydantic.Discriminator(kind)
        ]
        | None
    ) = None
    optional: Mapping[str, Elastic | None] | None = None
    pair: tuple[int, PositiveLength] = (1, 1.0)
    either: float | tuple[PositiveLength, ...] = 1.0


@pytest.mark.parametrize(
    ("parts", "path", "owner"),
    [
        (("layers", "Skin", "Skin", "width"), "layers.Skin.width", Skin),
        (("layers", "Bone", "Skin", "width"), "layers.Bone.width", Skin),
        (("tagged", "bony", "depth"), "tagged.depth", Bone),
        (("tagged", "Skin", "width"), "tagged.width", Skin),
        (("tagged",), "tagged", Body),
        (("optional", "Elastic", "poisson_ratio"), "optional.Elastic.poisson_ratio", Elastic),
        (("optional", 7, "[key]"), "optional.7", None),
        (("optional", "[key]", "poisson_ratio"), "optional.[key].poisson_ratio", Elastic),
        (("pair", 1), "pair.1", None),
        (("either", "tuple[function-before[read(), float], ...]", 0), "either.0", None),
        ((0, "a"), "layers.a", None),
        ((), "", None),
    ],
)
def test_tags_are_left_out_and_keys_are_kept(parts, path, owner):
    found = locate(Body, parts)
    assert (".".join(found.path), found.owner) == (path, owner)


def test_units_are_those_of_the_quantity_itself():
    assert [locate(Body, parts).unit for parts in (("pair", 0), ("layers", "a", "Skin"))] == [None, None]
    unit = locate(Body, ("pair", 1)).unit
    assert unit is not None
    assert unit.si == "m"
    assert unit_of(Body, "pair") is not None
    assert unit_of(Study, "title") is None
    assert set(type_hints(Skin)) == {"width"}


names = st.sampled_from(["Skin", "Elastic", "function-x", "a[b]", "[key]", "tuple", "Components", "float"]) | st.text(
    st.characters(codec="ascii", exclude_categories=["Cc"], exclude_characters="."), min_size=1
)


@given(name=names)
def test_a_layer_and_a_loaded_boundary_may_have_any_name(name):
    material = {"youngs_modulus": "1 kPa", "poisson_ratio": 2, "density": "1 kg/m^3"}
    traction = {"value": ["1 m"], "ramp": {"times": ["0 s"], "factors": [1]}}
    with pytest.raises(InputError) as caught:
        from_mapping(Study, block_values() | {"materials": {name: material}, "tractions": {name: traction}})
    places = {error.where for error in caught.value.all}
    assert places == {f"materials.{name}.poisson_ratio", f"tractions.{name}.value.0"}

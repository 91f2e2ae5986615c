"""Runs in motion as plain data: the body, the slip map and the signals."""

import base64
import json
import shutil
import subprocess
import zlib
from importlib import resources

import numpy as np
import pytest

from fingerslip.report.colours import ORANGE
from fingerslip.report.page.motion import (
    language,
    pack_arrays,
    quantise,
    run_motion,
    run_motions,
    solid_surface,
    triangles_of,
)
from fingerslip.report.scene.scene import upright
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history
from unit.synthetic import Process, make

TEMPLATE = resources.files("fingerslip.report") / "templates" / "motion.js"


@pytest.fixture(scope="module")
def plane():
    return block_history("Q4")


def unpack_arrays(values):
    """Return the arrays of a motion as the page unpacks them."""
    data = zlib.decompress(base64.b64decode(values["data"]))
    flat = {
        name: np.frombuffer(data, f"<{entry['type']}", int(np.prod(entry["shape"])), entry["at"])
        for name, entry in values["arrays"].items()
    }
    return {name: array.reshape(values["arrays"][name]["shape"]) for name, array in flat.items()}


def summed(frames):
    """Undo the differences between frames as the page does."""
    return np.cumsum(frames, axis=0, dtype=frames.dtype)


def test_section_moves_as_its_snapshots_do_and_those_nearest_to_events_are_among_its_frames(plane, monkeypatch):
    motion = run_motion(plane, Events(), "a title")
    arrays, body = unpack_arrays(motion), motion["body"]
    assert body["frames"] == pytest.approx(plane["snapshot_time"].values.tolist())
    places = arrays["points"] * body["unit"] + summed(arrays["moved"]) * body["movedUnit"]
    expected = 1e3 * (plane["node_position"].values + plane["snapshot_displacement"].values)
    np.testing.assert_allclose(places, expected, atol=2e-3)
    stress = summed(arrays["stress"]) * body["top"] / 255.0
    shown = np.minimum(1e-3 * plane["snapshot_von_mises"].values, body["top"])
    np.testing.assert_allclose(stress, shown, atol=body["top"] / 255.0)
    assert [region["name"] for region in body["regions"]] == ["skin", "tissue"]
    assert body["slide"] == [1.0, 0.0]
    assert len(body["plates"][0]) == 1
    json.dumps(motion)
    weak = plane.assign(snapshot_von_mises=0.5 * plane["snapshot_von_mises"])
    motions = run_motions((history, Events(), "t") for history in (weak, plane))
    assert [each["body"]["top"] for each in motions] == [body["top"]] * 2, "runs compare by their colours"
    monkeypatch.setattr("fingerslip.report.page.motion._FRAMES", 2)
    assert run_motion(plane, Events(), "t")["body"]["frames"] == [0.05, 0.1]
    motion = run_motion(plane, Events(slip=SlipEvents(incipient=0.01)), "t")
    assert motion["body"]["frames"] == [0.0, 0.05, 0.1]


BACKWARDS = {"counterface_displacement": lambda history: -history["counterface_displacement"]}
ABOVE = {"counterface_normal": lambda history: -history["counterface_normal"]}


@pytest.mark.parametrize(
    ("changes", "slide"), [({}, [1.0, 0.0]), (ABOVE, [1.0, 0.0]), (BACKWARDS, [-1, 0]), (ABOVE | BACKWARDS, [-1, 0])]
)
def test_the_arrow_points_where_the_plate_goes_on_whichever_side_it_is(plane, changes, slide):
    assert run_motion(plane.assign(changes), Events(), "t")["body"]["slide"] == slide


SCRIPT = """
const document = {
  getElementById: () => ({ textContent: '{"map": []}' }), querySelectorAll: () => [], addEventListener() {},
};
eval(require("fs").readFileSync(process.argv[1], "utf8").replace('"use strict";', "") + "; var Section_ = Section");
const view = (run) => {
  const section = { run, box: [0, 10, 0, 10], at: (frame, node) => run.places[node] };
  return Object.assign(Object.create(Section_.prototype), section).closer(0);
};
console.log(JSON.stringify(JSON.parse(process.argv[2]).map(view)));
"""


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node.js")
@pytest.mark.parametrize(("normal", "states", "seen"), [
    ([0, -1], [1, 1, 0, 0], [0.9, 0.0]), ([0, 1], [0, 0, 1, 1], [9.1, 0.0]), ([0, -1], [0, 0, 0, 0], [1.8, 9.0]),
])  # fmt: skip
def test_the_close_view_is_of_what_touches(normal, states, seen):
    places = [[0.0, 0.0], [1.8, 0.0], [8.4, 0.0], [9.8, 0.0]]
    if not any(states):
        places[1][1] = 9.0  # nearest to the plate above
    run = {"skin": [0, 1, 2, 3], "skinStates": states, "places": places, "body": {"plates": [[{"normal": normal}]]}}
    words = ["node", "-e", SCRIPT, str(TEMPLATE), json.dumps([run])]
    ((left, right, low, high),) = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    assert 0.5 * (left + right) == pytest.approx(seen[0])
    assert low < seen[1] < high
    assert (0.5 * (low + high) - seen[1]) * normal[1] > 0.0, "most of it is the body"


def test_a_run_without_snapshots_has_no_body_and_its_events_are_named():
    motion = run_motion(make(Process()), Events(slip=SlipEvents(incipient=1.2, overall=1.7)), "t")
    assert motion["body"] is None
    assert [event["name"] for event in motion["events"]] == ["incipient", "overall"]
    arrays = unpack_arrays(motion)
    assert arrays["states"].shape == (arrays["times"].size, arrays["along"].size)
    assert [panel["label"] for panel in motion["panels"]][:2] == ["force [N]", "ratio, fraction"]
    looks = {line["name"]: line for panel in motion["panels"] for line in panel["lines"]}
    slips, slipped = looks["slips now"], looks["has slipped by more than 20 \N{MICRO SIGN}m"]
    assert slips["colour"] == slipped["colour"] == ORANGE, "as in figures, the thinner what slips now"
    assert slips["width"] < slipped["width"]
    assert looks["normal"]["colour"] == looks["tangential"]["colour"]
    assert (looks["normal"]["dash"], len(looks["tangential"]["dash"])) == ([], 2)
    for panel in motion["panels"]:
        assert all(arrays[line["array"]].size == arrays["times"].size for line in panel["lines"])


def test_solid_has_triangles_and_its_states():
    motion = run_motion(block_history("T4"), Events(), "t")
    arrays = unpack_arrays(motion)
    assert motion["solid"]
    assert arrays["triangles"].max() < len(arrays["points"])
    assert set(np.unique(arrays["vertexState"])) <= {0, 1, 2, 255}
    assert {0, 1} <= set(np.unique(arrays["triangleCut"]))
    # Vertices have means over cells, which are smaller than what single cells have: the colours reach what is drawn.
    assert summed(arrays["stress"]).max() == 255
    assert (summed(arrays["stress"]) == 255).mean() < 0.01
    colours = language()
    assert len(colours["states"]) == len(colours["stateNames"]) == 3
    assert len(colours["map"]) == 33


def test_a_solid_stands_on_its_plate_and_is_cut_across_it():
    history = block_history("T4")  # on a plate along z
    body = run_motion(history, Events(), "t")["body"]
    assert body["plates"][0][0]["normal"] == pytest.approx([0.0, 1.0, 0.0])
    assert body["cutAt"] == pytest.approx(-5.0, abs=1e-3), "the middle of y, from the viewer"
    turned = upright(history)
    np.testing.assert_allclose(
        turned["node_position"].values, history["node_position"].values[:, [0, 2, 1]] * (1, 1, -1)
    )
    assert upright(turned) is turned


def test_solids_compare_by_their_colours():
    history = block_history("T4")
    weak = history.assign(snapshot_von_mises=0.5 * history["snapshot_von_mises"])
    bodies = [motion["body"] for motion in run_motions((each, Events(), "t") for each in (weak, history))]
    assert [body["top"] for body in bodies] == [run_motion(history, Events(), "t")["body"]["top"]] * 2
    assert [255.0 * body["stressUnit"] / body["top"] for body in bodies] == pytest.approx([0.5, 1.0])


@pytest.mark.parametrize("element", ["Q4", "T4"])
def test_the_phalanx_does_not_set_the_colours(element):
    history = block_history(element)
    soft = run_motion(history, Events(), "t")["body"]
    stress = history["snapshot_von_mises"].where(history["cell_region"] == 0, 1e9)
    bone = history.assign(snapshot_von_mises=stress).assign_attrs(regions="skin, phalanx")
    body = run_motion(bone, Events(), "t")["body"]
    assert body["top"] <= 1e-3 * float(stress.where(stress < 1e9).max())
    assert [region["stiff"] for region in body["regions"]] == [False, True]
    assert not any(region["stiff"] for region in soft["regions"])


def test_arrays_come_back_and_quantised_numbers_are_off_by_half_a_unit_at_most():
    arrays = {
        "states": np.array([[0, 1, 2]], dtype=np.uint8),
        "times": np.array([0.5, 1.5], dtype=np.float32),
        "points": np.array([[-3, 4], [5, 6]], dtype=np.int16),
    }
    packed = pack_arrays(arrays)
    assert all(entry["at"] % 4 == 0 for entry in packed["arrays"].values())
    for name, array in arrays.items():
        np.testing.assert_array_equal(unpack_arrays(packed)[name], array)
    with pytest.raises(AssertionError, match="times has the type f8"):
        pack_arrays({"times": np.array([1.0])})
    values = np.linspace(-3.0, 7.0, 11)
    whole, unit = quantise(values)
    assert np.abs(whole * unit - values).max() <= 0.5 * unit
    assert unit == pytest.approx(7.0 / 32000)
    assert quantise(np.zeros(3))[1] == 1.0


SIDE = 10e-3


def areas(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@pytest.mark.parametrize("element", ["T4", "T10", "H8"])
def test_a_block_of_two_layers_has_its_faces_and_its_section_whose_vertices_move_and_touch_as_nodes_do(element):
    history = block_history(element)
    last = history.sizes["snapshot_time"] - 1
    surface, cut_at = solid_surface(history, [last])
    triangles, is_cut = triangles_of(surface), surface.cell_data["is_cut"] > 0
    size = areas(surface.points, triangles)
    # Two blocks share a face, which each of them has.
    assert size[~is_cut].sum() == pytest.approx(8 * SIDE**2)
    assert size[is_cut].sum() == pytest.approx(SIDE**2)
    cut = triangles[is_cut]
    assert surface.points[np.unique(cut), 2] == pytest.approx(cut_at)
    first, second, third = (surface.points[cut[:, corner]] for corner in range(3))
    assert (np.cross(second - first, third - first)[:, 2] > 0.0).all(), "all face one way, or shading is speckled"
    assert set(surface.cell_data["layer"]) == {0, 1}
    corners = np.unique(history["cell_nodes"].values[:, : 8 if element == "H8" else 4])
    moved, states = history["snapshot_displacement"].values[last, corners], surface.point_data["state"]
    assert np.abs(surface.point_data["displacement"]).max() == pytest.approx(np.abs(moved).max())
    touching = surface.points[states != 255]
    np.testing.assert_allclose(touching[:, 2], 0.0, atol=1e-12)
    assert len(touching) == 25, "all corners of the face on the plate"
    assert {*states} <= {*history["contact_state"].values[-1], 255}
    assert surface.point_data["stress"].max() <= history["snapshot_von_mises"].values[last].max() + 1e-9


def test_the_view_is_around_the_body_at_all_times(plane):
    body = run_motion(plane, Events(), "t")["body"]
    moved = 1e3 * (plane["node_position"].values + plane["snapshot_displacement"].values)
    assert moved[..., 0].max() > 1e3 * plane["node_position"].values[:, 0].max()
    np.testing.assert_allclose(body["low"], moved.min(axis=(0, 1)))
    np.testing.assert_allclose(body["high"], moved.max(axis=(0, 1)))
    assert all(len(plates) == 1 and plates[0]["flat"] for plates in body["plates"])

"""Simulations that are taken step by step: the same motion as at once, saved and restored, and steered."""

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from threadpoolctl import threadpool_info

import fingerslip as fs
from fingerslip.errors import DamagedError, InputError
from unit.dynamics.models import contact, slid_block, solved_by_steps

STEPS = 24
# The last with a material that relaxes.
PRONY = (fs.PronyTerm(0.4, 0.03), fs.PronyTerm(0.2, 0.3))
MODELS = {
    "small": slid_block(),
    "finite": slid_block("finite"),
    "relaxing": slid_block("finite", materials={"bulk": fs.NeoHookean(50e3, 0.45, 1000.0, prony=PRONY)}),
}


def threads_in_use() -> list[tuple[str, int]]:
    """Return the number of threads of each library that has some."""
    return [(library["prefix"], library["num_threads"]) for library in threadpool_info()]


@pytest.mark.parametrize(("kinematics", "threads"), [("small", None), ("small", 1), ("small", 8), ("finite", None)])
def test_steps_are_those_of_a_simulation_at_once_whatever_the_threads(kinematics: str, threads: int | None) -> None:
    stepped = solved_by_steps(MODELS[kinematics], threads=threads)
    assert stepped.time.values == pytest.approx(5e-3 * np.arange(STEPS + 1))
    xr.testing.assert_equal(stepped, fs.simulate(MODELS[kinematics], threads=1))


# Models at large strain are saved in the press; in the slow tier at the start and in the slide, too.
@pytest.mark.parametrize(
    ("name", "saved_at"),
    [
        pytest.param(name, at, marks=[pytest.mark.slow] * (name != "small" and at != 5))
        for name in MODELS
        for at in (0, 5, 15)
    ],
)
def test_a_restored_simulation_goes_on_to_the_last_bit(tmp_path: Path, name: str, saved_at: int) -> None:
    model, command = MODELS[name], fs.Command("bottom", velocity=(2e-3, 1e-3))
    with fs.Simulation(model) as sim:
        for step in range(STEPS):
            if step == saved_at:
                sim.save(tmp_path / "half")
            sim.step(command if step == 3 else ())
        undisturbed = sim.history()
    with fs.Simulation.restore(tmp_path / "half", replace(model)) as again:
        assert again.time == pytest.approx(saved_at * 5e-3)
        for step in range(saved_at, STEPS):
            again.step(command if step == 3 else ())
        xr.testing.assert_equal(again.history(), undisturbed)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_support_that_is_commanded_moves_as_one_that_was_planned(kinematics: str) -> None:
    """A pad that is held from above comes down on a plate, then is squeezed faster and dragged along."""
    down, squeezed = fs.Ramp((0.0, 0.1), (0.0, 1.0)), fs.Ramp((0.0, 0.05, 0.1), (0.0, 0.5, 2.0))

    def pad(ramp: fs.Ramp) -> fs.Model:
        motions = {"top": fs.SupportMotion((1e-5, -0.2e-3), ramp)}
        supports = {"top": ("x", "y")}
        time = fs.TimeStepping(5e-3, end=0.1)
        return slid_block(kinematics, supports=supports, support_motions=motions, programme=(), time=time)

    planned = fs.simulate(pad(squeezed))
    with fs.Simulation(pad(down)) as sim:
        for step in range(20):
            sim.step(fs.Command("top", velocity=(3e-4, -6e-3)) if step == 10 else ())
        history = sim.history()
    assert float(np.abs(planned.support_force.values).max()) > 0.1
    for name in ("support_force", "counterface_force", "contact_state", "displacement", "external_work"):
        values = planned[name].values
        np.testing.assert_allclose(history[name].values, values, atol=1e-9 * np.abs(values).max(), err_msg=name)


@pytest.mark.parametrize("prony", [(), PRONY], ids=["elastic", "relaxing"])
def test_observations_are_the_records_of_a_step(prony: tuple[fs.PronyTerm, ...]) -> None:
    """Stresses of what relaxes are those after all steps before it."""
    with fs.Simulation(slid_block(materials={"bulk": fs.Elastic(50e3, 0.45, 1000.0, prony=prony)})) as sim:
        seen = [sim.observation, *(sim.step() for _ in range(10))]
        history = sim.history()
    assert history.sizes["time"] == 11
    for one in (seen[0], seen[4], seen[-1]):
        for name in ("contact_state", "counterface_force", "normal_traction", "stress", "strain_energy", "velocity"):
            np.testing.assert_array_equal(one[name], history[name].values[one.step], err_msg=name)
    assert "support_force" not in seen[-1].values


def test_a_command_changes_the_motion_from_now_on() -> None:
    with fs.Simulation(slid_block()) as sim:
        for _ in range(6):
            sim.step()
        before = sim.observation["counterface_displacement"]
        sim.step(fs.Command("bottom", velocity=(-4e-3, 1e-3)))
        sim.step()
        history = sim.history()
    np.testing.assert_allclose(history.counterface_displacement[-1, 0] - before[0], [-4e-5, 1e-5], rtol=1e-12)
    np.testing.assert_allclose(history.counterface_velocity[-1, 0], [-4e-3, 1e-3], rtol=1e-12)
    np.testing.assert_allclose(history.counterface_velocity[4, 0], [0.0, 5e-3], atol=1e-15)
    imbalance = float(np.abs(history.energy_imbalance).max())
    assert imbalance <= 1e-9 * float(np.abs(history.external_work).max())


def test_a_force_on_a_free_body_accelerates_it() -> None:
    body = fs.RigidBody(mass=0.01, free=("x",), programme=(fs.Press(0.1e-3, 5e-3),))
    smooth = contact(counterface=fs.Plane((0.0, 1.0)), friction=fs.Coulomb(0.0), rigid_body="block")
    time = fs.TimeStepping(1e-3, end=0.04)
    with fs.Simulation(slid_block(contacts=smooth, bodies={"block": body}, programme=(), time=time)) as sim:
        for step in range(40):
            sim.step(fs.Command("block", force=(0.02, 0.0)) if step == 20 else ())
        velocity = sim.history().rigid_body_velocity.values[:, 0, 0]
    assert velocity[20] == 0.0
    np.testing.assert_allclose(np.diff(velocity)[25:], 1e-3 * 0.02 / 0.01, rtol=1e-6)


def test_a_later_force_replaces_an_earlier_one_and_adds_to_the_drive() -> None:
    """The counterface is a millimetre away, so that nothing else acts on it."""
    plane, drive = fs.Plane((0.0, 1.0), offset=-1e-3), fs.Drive(mass=2.0, force=0.3)
    driven = contact(counterface=plane, drive=drive, search_distance=5e-3)
    with fs.Simulation(slid_block(contacts=driven, programme=(), time=fs.TimeStepping(1e-3, 0.0, end=0.03))) as sim:
        for step in range(30):
            sim.step({10: fs.Command("bottom", force=(0.1,)), 20: fs.Command("bottom", force=(-0.2,))}.get(step, ()))
        gained = np.diff(sim.history().counterface_velocity.values[:, 0, 1])
    for first, total in ((1, 0.3), (11, 0.4), (21, 0.1)):
        np.testing.assert_allclose(gained[first : first + 8], 1e-3 * total / 2.0, rtol=1e-9)


@pytest.mark.parametrize("of", ["clamp", "bottom"])
def test_all_faces_of_a_body_move_along_what_it_is_not_free_in(of: str) -> None:
    """Whether the body is named or one of its faces."""
    bottom, right = fs.Plane((0.0, 1.0)), fs.Plane((-1.0, 0.0))
    faces = contact(counterface=bottom, rigid_body="clamp")
    faces += contact(boundary="right", counterface=right, rigid_body="clamp")
    changes = {"contacts": faces, "bodies": {"clamp": fs.RigidBody(mass=1.0, free=("x",))}, "programme": ()}
    with fs.Simulation(slid_block(**changes, time=fs.TimeStepping(5e-3, end=0.1))) as sim:
        sim.step(fs.Command(of, velocity=(0.0, 2e-3)))
        np.testing.assert_allclose(sim.step()["counterface_displacement"][:, 1], 2e-5)


@pytest.fixture(scope="module")
def saved_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what one step of a simulation leaves on disk."""
    path = tmp_path_factory.mktemp("saved") / "saved"
    with fs.Simulation(slid_block()) as sim:
        sim.step()
        sim.save(path)
    return path


def parts_of(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as file:
        return {name: file.read(name) for name in file.namelist()}


def test_a_model_that_another_processor_rounds_otherwise_is_the_same_others_and_old_files_are_refused(
    saved_file: Path, tmp_path: Path
) -> None:
    model = slid_block()
    points = model.mesh.p
    rounded = replace(model, mesh=replace(model.mesh, doflocs=np.nextafter(points, 1.0)), depth=np.nextafter(0.01, 1.0))
    assert fs.Simulation.restore(saved_file, rounded).time > 0.0
    for other in (replace(model, mesh=replace(model.mesh, doflocs=points + 1e-8)), slid_block(depth=0.02)):
        with pytest.raises(InputError, match=r"model: is not the one that .*saved was saved from, needs the same mod"):
            fs.Simulation.restore(saved_file, other)
    tree = json.loads(parts_of(saved_file)["tree.json"])
    tree["mapping"]["format"] = {"value": 1}
    write_parts(tmp_path / "old", parts_of(saved_file) | {"tree.json": json.dumps(tree).encode()})
    with pytest.raises(InputError, match=r"old: is of another version of fingerslip, .*; save the simulation again"):
        fs.Simulation.restore(tmp_path / "old", slid_block())


def write_parts(path: Path, parts: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", compression) as file:
        for name, content in parts.items():
            file.writestr(name, content)


@pytest.mark.parametrize("content", [lambda whole: whole[: len(whole) // 2], lambda _: b"", lambda _: b"other", None])
def test_other_files_are_refused(saved_file: Path, tmp_path: Path, content: Callable[[bytes], bytes] | None) -> None:
    if content is not None:
        (tmp_path / "file").write_bytes(content(saved_file.read_bytes()))
    message = (
        "is not there" if content is None else "holds no saved simulation, or is damaged; save the simulation again"
    )
    with pytest.raises(DamagedError, match=message):
        fs.Simulation.restore(tmp_path / "file", slid_block())


@dataclass(frozen=True)
class Foreign:
    """Not of the package."""

    def __post_init__(self) -> None:
        MADE.append(self)


MADE: list[Foreign] = []


def as_npy(shape: tuple[int, ...], data: bytes) -> bytes:
    memory = io.BytesIO()
    np.lib.format.write_array_header_1_0(memory, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return memory.getvalue() + data


@pytest.mark.parametrize(
    ("tree", "array"),
    [
        (b'{"list": [' * 20_000 + b"]}" * 20_000, b""),
        (b'{"array": "0.npy"}', as_npy((10**14,), b"")),
        (b'{"array": "0.npy"}', as_npy((2**70,), b"")),
        (b'{"array": "0.npy"}', as_npy((10**6,), b"\0" * 8 * 10**6)),
        (b'{"csr": [{"value": 1}, {"value": 1}]}', b""),
        (b'{"list": 3}', b""),
        (f'{{"of": "{__name__}:Foreign", "fields": {{}}}}'.encode(), b""),
        (b'{"of": "fingerslip.units:millimetres", "fields": {}}', b""),
        (b'{"of": "fingerslip.nothing:None", "fields": {}}', b""),
    ],
    ids=["deep", "large", "larger", "compressed", "matrix", "kind", "foreign", "function", "missing"],
)
def test_what_is_deep_huge_or_of_another_kind_is_refused(tmp_path: Path, tree: bytes, array: bytes) -> None:
    """Only data of the package is ever made."""
    compression = zipfile.ZIP_DEFLATED if len(array) > 10**6 else zipfile.ZIP_STORED
    write_parts(tmp_path / "made", {"tree.json": tree} | ({"0.npy": array} if array else {}), compression)
    with pytest.raises(DamagedError, match="holds no saved simulation, or is damaged; save the simulation again"):
        fs.Simulation.restore(tmp_path / "made", slid_block())
    assert not MADE


@pytest.mark.parametrize(
    "change",
    [
        lambda tree: tree.pop("taken"),
        lambda tree: tree.update(taken={"value": -1}),
        lambda tree: tree.update(taken={"value": 3.0}),
        lambda tree: tree.update(taken={"value": 2}),
        lambda tree: tree.update(state={"value": None}),
        lambda tree: tree.update(commands={"value": 5}),
        lambda tree: tree["state"]["fields"].update(displacement={"value": 1.0}),
        lambda tree: tree["state"]["fields"].update(velocity={"value": "text"}),
        lambda tree: tree["state"]["fields"].update(velocity=tree["state"]["fields"]["counterfaces"]),
        lambda tree: tree["state"]["fields"].update(time={"value": "1"}),
        lambda tree: tree["state"]["fields"].update(moved=tree["state"]["fields"]["displacement"]),
        lambda tree: tree["state"]["fields"].pop("energies"),
        lambda tree: tree["recorder"]["mapping"].update(next={"value": 10**6}),
        lambda tree: tree["recorder"]["mapping"].update(moved=tree["state"]["fields"]["time"]),
    ],
)
def test_what_does_not_fit_the_model_is_refused(
    saved_file: Path, tmp_path: Path, change: Callable[[dict], object]
) -> None:
    parts = parts_of(saved_file)
    tree = json.loads(parts["tree.json"])
    change(tree["mapping"])
    write_parts(tmp_path / "saved", parts | {"tree.json": json.dumps(tree).encode()})
    with pytest.raises(DamagedError, match=r"saved: holds .*save the simulation again"):
        fs.Simulation.restore(tmp_path / "saved", slid_block())


def test_threads_are_given_back_where_a_simulation_cannot_be_made_or_restored(saved_file: Path) -> None:
    before = threads_in_use()
    with pytest.raises(InputError, match="not in mesh"):
        fs.Simulation(slid_block(contacts=(fs.Contact("nowhere", fs.Plane((0.0, 1.0)), fs.Coulomb(0.4)),)))
    with pytest.raises(InputError, match="is not the one"):
        fs.Simulation.restore(saved_file, slid_block(depth=0.02))
    assert threads_in_use() == before

"""Simulations that are taken step by step: the same motion as at once, saved and restored, and steered."""

from __future__ import annotations

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
from fingerslip.verification.meshes import box

STEPS = 24


def a_model(kinematics: str = "small", **changes: object) -> fs.Model:
    """Return a block that is pressed and slid: 24 steps."""
    model = fs.Model(
        mesh=box("Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5)),
        materials={"bulk": fs.NeoHookean(50e3, 0.45, 1000.0)},
        formulation="plane_strain",
        depth=0.01,
        supports={"top": ("x", "y")},
        contacts=(fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.4)),),
        programme=(fs.Press(0.3e-3, 5e-3), fs.Slide(0.3e-3, 5e-3, (1.0, 0.0))),
        time=fs.TimeStepping(5e-3),
        record=fs.Recording(sites=(fs.Site("inside", "probe", (4e-3, 1e-3)),), snapshots_every=20e-3),
        kinematics=kinematics,
    )
    return replace(model, **changes)


def a_relaxing_model() -> fs.Model:
    """Return the same at large strain with a material that relaxes."""
    law = fs.NeoHookean(50e3, 0.45, 1000.0, prony=(fs.PronyTerm(0.4, 0.03), fs.PronyTerm(0.2, 0.3)))
    return a_model("finite", materials={"bulk": law})


def threads_in_use() -> list[tuple[str, int]]:
    """Return the number of threads of each library that has some."""
    return [(library["prefix"], library["num_threads"]) for library in threadpool_info()]


def assert_equal(one: xr.Dataset, other: xr.Dataset) -> None:
    """Compare histories to the last bit, but for what depends on the clock."""
    xr.testing.assert_equal(one, other)


@pytest.mark.parametrize(("kinematics", "threads"), [("small", None), ("small", 1), ("small", 8), ("finite", None)])
def test_steps_are_those_of_a_simulation_at_once_whatever_the_threads(kinematics: str, threads: int | None) -> None:
    model, times = a_model(kinematics), []
    with fs.Simulation(model, threads=threads) as sim:
        while not sim.is_finished:
            times.append(sim.step().time)
        stepped = sim.history()
    assert times == pytest.approx(5e-3 * np.arange(1, STEPS + 1))
    assert_equal(stepped, fs.simulate(model, threads=1))


MODELS = {"small": a_model, "finite": lambda: a_model("finite"), "relaxing": a_relaxing_model}


# Models at large strain are saved in the press; in the slow tier at the start and in the slide, too.
@pytest.mark.parametrize(
    ("make", "saved_at"),
    [
        pytest.param(make, at, id=f"{name}-{at}", marks=[pytest.mark.slow] * (name != "small" and at != 5))
        for name, make in MODELS.items()
        for at in (0, 5, 15)
    ],
)
def test_a_restored_simulation_goes_on_to_the_last_bit(
    tmp_path: Path, make: Callable[[], fs.Model], saved_at: int
) -> None:
    model, command = make(), fs.Command("bottom", velocity=(2e-3, 1e-3))
    with fs.Simulation(model) as sim:
        for step in range(STEPS):
            if step == saved_at:
                sim.save(tmp_path / "half")
            sim.step(command if step == 3 else ())
        undisturbed = sim.history()
    with fs.Simulation.restore(tmp_path / "half", make()) as again:
        assert again.time == pytest.approx(saved_at * 5e-3)
        for step in range(saved_at, STEPS):
            again.step(command if step == 3 else ())
        assert_equal(again.history(), undisturbed)


def test_observations_are_the_records_of_a_step() -> None:
    with fs.Simulation(a_model()) as sim:
        seen = [sim.observation, *(sim.step() for _ in range(10))]
        history = sim.history()
    assert history.sizes["time"] == 11
    for one in (seen[0], seen[4], seen[-1]):
        for name in ("contact_state", "counterface_force", "normal_traction", "stress", "strain_energy", "velocity"):
            np.testing.assert_array_equal(one[name], history[name].values[one.step], err_msg=name)
    assert "support_force" not in seen[-1].values


def test_a_command_changes_the_motion_from_now_on() -> None:
    with fs.Simulation(a_model()) as sim:
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


def test_a_controller_holds_a_force() -> None:
    """A plate that is steered by the force that it feels settles where the force is what is wanted."""
    wanted, gain = 0.2, 5e-3
    time = fs.TimeStepping(5e-3, end=0.5)
    with fs.Simulation(a_model(time=time)) as sim:
        seen = sim.step()
        while not sim.is_finished:
            missing = wanted - float(seen["counterface_force"][0, 1])
            seen = sim.step(fs.Command("bottom", velocity=(0.0, gain * missing / wanted)))
    assert float(seen["counterface_force"][0, 1]) == pytest.approx(wanted, rel=1e-3)


def test_a_force_on_a_free_body_accelerates_it() -> None:
    body = fs.RigidBody(mass=0.01, free=("x",), programme=(fs.Press(0.1e-3, 5e-3),))
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.0), rigid_body="block")
    time = fs.TimeStepping(1e-3, end=0.04)
    model = a_model(contacts=(contact,), bodies={"block": body}, programme=(), time=time)
    with fs.Simulation(model) as sim:
        for step in range(40):
            sim.step(fs.Command("block", force=(0.02, 0.0)) if step == 20 else ())
        history = sim.history()
    velocity = history.rigid_body_velocity.values[:, 0, 0]
    assert velocity[20] == 0.0
    np.testing.assert_allclose(np.diff(velocity)[25:], 1e-3 * 0.02 / 0.01, rtol=1e-6)


def test_a_later_force_replaces_an_earlier_one_and_adds_to_the_drive() -> None:
    """The counterface is a millimetre away, so that nothing else acts on it."""
    plane, drive = fs.Plane((0.0, 1.0), offset=-1e-3), fs.Drive(mass=2.0, force=0.3)
    contact = fs.Contact("bottom", plane, fs.Coulomb(0.4), drive=drive, search_distance=5e-3)
    with fs.Simulation(a_model(contacts=(contact,), programme=(), time=fs.TimeStepping(1e-3, 0.0, end=0.03))) as sim:
        for step in range(30):
            sim.step({10: fs.Command("bottom", force=(0.1,)), 20: fs.Command("bottom", force=(-0.2,))}.get(step, ()))
        gained = np.diff(sim.history().counterface_velocity.values[:, 0, 1])
    for first, total in ((1, 0.3), (11, 0.4), (21, 0.1)):
        np.testing.assert_allclose(gained[first : first + 8], 1e-3 * total / 2.0, rtol=1e-9)


SLIDER: dict[str, object] = {
    "contacts": (fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.4), rigid_body="block"),),
    "bodies": {"block": fs.RigidBody(mass=1.0, free=("x",))},
    "programme": (),
    "time": fs.TimeStepping(5e-3, end=0.1),
}


@pytest.mark.parametrize(
    ("changes", "command", "message"),
    [
        ({}, {"of": "side", "velocity": (0.0, 0.0)}, "command.of: got 'side', the bodies and contacts are: bottom"),
        ({}, {"of": "bottom", "velocity": (0.0,)}, "command.velocity: got 1 components, needs 2"),
        ({}, {"of": "bottom", "force": (0.0, 1.0)}, "command.force: 'bottom' is free along no direction"),
        (
            SLIDER,
            {"of": "block", "velocity": (0.1, 0.0)},
            "command.velocity: moves along a direction in which the body is free",
        ),
    ],
)
def test_commands_that_cannot_be_followed_are_refused(
    changes: dict[str, object], command: dict[str, object], message: str
) -> None:
    with fs.Simulation(a_model(**changes)) as sim, pytest.raises(InputError) as caught:
        sim.step(fs.Command(**command))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("of", ["clamp", "bottom"])
def test_all_faces_of_a_body_move_along_what_it_is_not_free_in(of: str) -> None:
    """Whether the body is named or one of its faces."""
    faces = tuple(
        fs.Contact(side, fs.Plane(normal), fs.Coulomb(0.4), rigid_body="clamp")
        for side, normal in (("bottom", (0.0, 1.0)), ("right", (-1.0, 0.0)))
    )
    changes = {"contacts": faces, "bodies": {"clamp": fs.RigidBody(mass=1.0, free=("x",))}, "programme": ()}
    with fs.Simulation(a_model(**changes, time=fs.TimeStepping(5e-3, end=0.1))) as sim:
        sim.step(fs.Command(of, velocity=(0.0, 2e-3)))
        np.testing.assert_allclose(sim.step()["counterface_displacement"][:, 1], 2e-5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda sim: [sim.step() for _ in range(3)], "end: is reached, 0.01 s"),
        (lambda sim: (sim.close(), sim.step()), "simulation: is closed, takes no more steps"),
    ],
)
def test_steps_that_cannot_be_taken_are_refused(call: Callable[[fs.Simulation], object], message: str) -> None:
    sim = fs.Simulation(a_model(time=fs.TimeStepping(5e-3, end=10e-3)))
    with pytest.raises(InputError, match=message):
        call(sim)


@pytest.fixture(scope="module")
def saved_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what one step of a simulation leaves on disk."""
    path = tmp_path_factory.mktemp("saved") / "saved"
    with fs.Simulation(a_model()) as sim:
        sim.step()
        sim.save(path)
    return path


def parts_of(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as file:
        return {name: file.read(name) for name in file.namelist()}


def test_a_model_that_another_processor_rounds_otherwise_is_the_same(saved_file: Path) -> None:
    model = a_model()
    rounded = replace(
        model, mesh=replace(model.mesh, doflocs=np.nextafter(model.mesh.p, 1.0)), depth=float(np.nextafter(0.01, 1.0))
    )
    assert fs.Simulation.restore(saved_file, rounded).time > 0.0
    moved = replace(model, mesh=replace(model.mesh, doflocs=model.mesh.p + 1e-8))
    with pytest.raises(InputError, match="is not the one"):
        fs.Simulation.restore(saved_file, moved)


def test_another_model_and_another_version_are_refused(saved_file: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"model: is not the one that .*saved was saved from, needs the same model"):
        fs.Simulation.restore(saved_file, a_model(depth=0.02))
    tree = json.loads(parts_of(saved_file)["tree.json"])
    tree["mapping"]["format"] = {"value": 1}
    write_parts(tmp_path / "old", parts_of(saved_file) | {"tree.json": json.dumps(tree).encode()})
    with pytest.raises(InputError, match=r"old: is of another version of fingerslip, .*; save the simulation again"):
        fs.Simulation.restore(tmp_path / "old", a_model())


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
        fs.Simulation.restore(tmp_path / "file", a_model())


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
        fs.Simulation.restore(tmp_path / "made", a_model())
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
        fs.Simulation.restore(tmp_path / "saved", a_model())


def test_threads_are_given_back_where_a_simulation_cannot_be_made_or_restored(tmp_path: Path) -> None:
    with fs.Simulation(a_model()) as sim:
        sim.save(tmp_path / "half")
    before = threads_in_use()
    with pytest.raises(InputError, match="not in mesh"):
        fs.Simulation(a_model(contacts=(fs.Contact("nowhere", fs.Plane((0.0, 1.0)), fs.Coulomb(0.4)),)))
    with pytest.raises(InputError, match="is not the one"):
        fs.Simulation.restore(tmp_path / "half", a_model(depth=0.02))
    assert threads_in_use() == before

"""Cases of study files: those that ship and a block, changed as text, as data and as bytes."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from fingerslip.dynamics.recording.schedule import step_times
from fingerslip.dynamics.simulation import simulate
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.study.definition.runs import Run, plan_study
from fingerslip.study.inspection.show import show
from fingerslip.study.running.build import build_mesh, build_model
from places import ROOT, STUDIES
from robustness.block import write_block
from robustness.mutants import changed_bytes, changed_data, changed_text

_FEW_STEPS, _FEW_CELLS = 120, 4000


def study_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: a study is read, its runs are listed, its models built, and the block's simulated."""
    block = write_block(folder).read_text()
    for name in ("meshes", "studies"):
        (folder / name).symlink_to(ROOT / name)
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(STUDIES.glob("*.yaml"))}
    texts |= dict.fromkeys(("block", "block again", "block once more"), block)
    meshes: dict[str, Any] = {}
    path = folder / "mutant.yaml"

    def case(chance: random.Random) -> None:
        text = texts[chance.choice(sorted(texts))].replace("../meshes/", "meshes/")
        path.write_bytes(_mutant(text, chance))
        plan = plan_study(path, folder / "results")
        if chance.random() < 0.1:
            show(str(path))
        for run in plan.runs[:2]:
            _check(run, meshes, chance)

    return case


def _mutant(text: str, chance: random.Random) -> bytes:
    match chance.randrange(4):
        case 0:
            return changed_bytes(text.encode(), chance)
        case 1:
            changed = changed_data(yaml.safe_load(text), chance)
            return yaml.safe_dump(changed, sort_keys=False, allow_unicode=True).encode()
        case _:
            return changed_text(text, chance).encode("utf-8", "surrogatepass")


def _check(run: Run, meshes: dict[str, Any], chance: random.Random) -> None:
    """Build the model of a run, as far as its mesh is cheap or known, and simulate a small one."""
    key = run.mesh_key
    cells = run.study.mesh.estimated_cells(run.specimen)
    if key not in meshes:
        if cells is not None and (cells > _FEW_CELLS * 10 or chance.random() > 0.02):
            return
        if cells is None and "block" not in str(run.study.mesh):
            return
        meshes[key] = build_mesh(run)
    model = build_model(run, meshes[key])
    inspect_model(model)
    if model.mesh.nelements < 100 and step_times(model).size < _FEW_STEPS:
        simulate(model, threads=1)

"""The runs of a study once more with other meshes, steps, contact stiffness and numerical damping, one at a time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from fingerslip.model import Model
from fingerslip.study.definition.settings import ContactSettings, RefinementSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.definition.sweep import Run
from fingerslip.uncertainty import SETTINGS

__all__ = ["Level", "levels_of", "run_at"]


@dataclass(frozen=True)
class Level:
    """One change of one setting."""

    setting: str  # what is changed
    value: float  # factor on element sizes, time step or contact stiffness

    @property
    def label(self) -> str:
        """Its name in folders and tables."""
        return f"{self.setting}-{self.value:g}"


def levels_of(study: Study) -> tuple[Level, ...]:
    """Return the levels that a study asks for and can have.

    A mesh that is read or made of a scan has no element sizes to change here, a body without contact no contact
    stiffness.
    """
    wanted: RefinementSettings = study.converge
    levels = [Level(setting.name, value) for setting in SETTINGS for value in getattr(wanted, setting.name)]
    return tuple(level for level in levels if _applies(level, study))


def run_at(run: Run, level: Level, model: Model) -> Run:
    """Return a run with one setting changed, and without snapshots."""
    study = dataclasses.replace(
        _change(run.study, level, model), record=dataclasses.replace(run.study.record, snapshots_every=0.0)
    )
    return dataclasses.replace(
        run, name=f"{run.name}_{level.label}", where=f"{run.where} at {level.label}", study=study
    )


def _applies(level: Level, study: Study) -> bool:

    match level.setting:
        case "mesh":
            return study.mesh.refined(level.value) is not None
        case "penalty":
            return bool(study.all_contacts)
        case "alpha":
            return study.time.scheme == "hht_alpha" and level.value != study.time.alpha
        case _:
            return True


def _change(study: Study, level: Level, model: Model) -> Study:
    value = level.value
    from fingerslip.dynamics.system.penalties import contact_penalties

    match level.setting:
        case "mesh":
            finer = study.mesh.refined(value)
            assert finer is not None  # held by levels_of
            return dataclasses.replace(study, mesh=finer)
        case "step":
            return dataclasses.replace(study, time=study.time.refined(value))
        case "alpha":
            return dataclasses.replace(study, time=dataclasses.replace(study.time, alpha=value))
        case _:
            stiffer = tuple(
                _stiffer(settings, value, contact_penalties(model, contact))
                for settings, contact in zip(study.all_contacts, model.contacts, strict=True)
            )
            if study.contact is not None:
                return dataclasses.replace(study, contact=stiffer[0])
            return dataclasses.replace(study, contacts=stiffer)


def _stiffer(settings: ContactSettings, factor: float, penalties: tuple[float, float]) -> ContactSettings:
    return dataclasses.replace(settings, normal_penalty=factor * penalties[0], tangential_penalty=factor * penalties[1])

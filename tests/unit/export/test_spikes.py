"""Spikes in files of NWB and in Neo's blocks are those of the afferents, with what the fingertip felt beside them."""

import dataclasses
import datetime as dt
import sys
from typing import Any

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from unit.synthetic import Process, make

SPIKES = fs.Spikes(
    ("FA-I-01", "FA-I-02", "SA-I-01"),
    ("FA-I", "FA-I", "SA-I"),
    (np.array([0.2, 1.5]), np.empty(0), np.array([2.0])),
    0.0,
    3.0,
    origin="simulated",
)
START = dt.datetime(2026, 1, 2, tzinfo=dt.UTC)


@dataclasses.dataclass
class Kernel:
    """A model of someone else's, with a parameter that is an array."""

    stimulus: str = "pressure"
    highest_frequency: float = 50.0
    kernel: Any = dataclasses.field(default_factory=lambda: np.array([1.0, 0.0]))

    def spikes(self, times, values):
        """Return no spikes."""
        return [times[:0]] * values.shape[1]


@pytest.fixture(scope="module")
def felt():
    """Return a history whose contact slips from its edges to the middle, with sites named as the spikes."""
    history = make(Process())
    names = [*SPIKES.names, *map(str, history["site"].values[len(SPIKES.names) :])]
    return history.assign_coords(site=names)


def test_a_file_of_nwb_has_units_stimuli_phases_and_partial_slip(felt, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    path = fs.write_nwb(SPIKES, tmp_path / "spikes.nwb", felt, start=START)
    assert [file.name for file in tmp_path.iterdir()] == ["spikes.nwb"]
    with pynwb.NWBHDF5IO(str(path), "r") as stream:
        file = stream.read()
        assert "not a recording" in file.session_description
        assert file.session_start_time == START
        assert file.notes.startswith("The records resolve 10 Hz. FA-II left out: "), "twenty steps of 5 ms"
        assert ", three-quarter at " in file.notes
        subject = file.subject
        assert (subject.subject_id, subject.species, subject.sex) == ("virtual", "Homo sapiens", "U")
        assert file.units.resolution is None, "models that are told in words have no time step"
        units = file.units.to_dataframe()
        assert units["site"].tolist() == list(SPIKES.names)
        assert units["kind"].tolist() == list(SPIKES.kinds)
        for times, read in zip(SPIKES.times, units["spike_times"], strict=True):
            np.testing.assert_array_equal(read, times)
        np.testing.assert_array_equal(np.vstack(units["obs_intervals"]), [[0.0, 3.0]] * 3)
        np.testing.assert_array_equal(np.stack(units["position"])[:, :2], felt["site_position"].values[:3])
        (name,) = felt["counterface"].values
        force = file.stimulus[f"force_{name}"]
        assert force.unit == "N"
        np.testing.assert_array_equal(force.data[:], felt["counterface_force"].values[:, 0])
        np.testing.assert_array_equal(force.timestamps[:], felt["time"].values)
        epochs = file.epochs.to_dataframe()
        slip = fs.find_events(felt).slip
        assert [tags[0] for tags in epochs["tags"]] == [*felt["phase_kind"].values, "partial slip"]
        assert epochs[["start_time", "stop_time"]].to_numpy()[-1].tolist() == [slip.incipient, slip.overall]


def test_a_file_of_nwb_has_the_parameters_of_the_models_with_units_and_what_is_assumed(felt, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    models = {**fs.human_afferents(), "SA-I": fs.IntegrateAndFire("pressure_rate", 100.0, 0.05, least_rate=2.0)}
    path = fs.write_nwb(SPIKES, tmp_path / "spikes.nwb", felt, start=START, models=models)
    with pynwb.NWBHDF5IO(str(path), "r") as stream:
        file = stream.read()
        assert file.units.resolution == pytest.approx(min(models[kind].longest_step for kind in SPIKES.kinds), rel=1e-2)
        table = file.processing["afferents"]["models"]
        rows = table.to_dataframe().set_index(["kind", "parameter"])
        assert set(rows.index.get_level_values("kind")) == set(SPIKES.kinds)
        assert rows.loc["FA-I", "membrane_time"][["value", "unit", "source"]].tolist() == ["0.0046", "s", "saal2017"]
        assert rows.loc["FA-I", "least_rate"][["value", "unit", "source"]].tolist() == ["0.11", "1/s", "knibestol1973"]
        assert rows.loc["SA-I", "least_rate"][["value", "unit", "source"]].tolist() == ["2.0", "Pa/s^2", ""]
        assert "counts of spikes are no result: FA-I stimulus." in table.description
        assert "fitted to monkeys, thresholds are rough" in file.units.description
        assert "and models of the caller's own (SA-I)" in file.units.description
    path = fs.write_nwb(SPIKES, tmp_path / "other.nwb", felt, models=dict.fromkeys(SPIKES.kinds, Kernel()))
    with pynwb.NWBHDF5IO(str(path), "r") as stream:
        file = stream.read()
        assert "counts are no result" not in file.units.description + file.data_collection
        assert "models of the caller's own" in file.data_collection
        rows = file.processing["afferents"]["models"].to_dataframe().set_index("kind").loc["SA-I"]
        assert rows["parameter"].tolist() == ["stimulus", "highest_frequency", "kernel"]
        assert rows[["value", "unit"]].to_numpy()[1:].tolist() == [["50.0", "1/s"], ["[1. 0.]", ""]]
    with pytest.raises(InputError, match="models: have none of SA-I, need one for each type of afferent"):
        fs.write_nwb(SPIKES, tmp_path / "more.nwb", models={"FA-I": models["FA-I"]})


def test_spikes_alone_are_a_file_too_and_the_same_ones_have_the_same_identifier(felt, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    identifiers = []
    for name, history in (("a", None), ("b", felt)):
        with pynwb.NWBHDF5IO(str(fs.write_nwb(SPIKES, tmp_path / f"{name}.nwb", history)), "r") as stream:
            file = stream.read()
            identifiers.append(file.identifier)
            assert ("position" in file.units.colnames) == (history is not None)
    assert len(set(identifiers)) == 1


def test_a_block_of_neo_has_trains_signals_and_slip_events(felt):
    pytest.importorskip("neo")
    (segment,) = fs.neo_block(SPIKES, felt).segments
    assert [train.name for train in segment.spiketrains] == list(SPIKES.names)
    assert [train.annotations["kind"] for train in segment.spiketrains] == list(SPIKES.kinds)
    for train, times in zip(segment.spiketrains, SPIKES.times, strict=True):
        np.testing.assert_array_equal(train.rescale("s").magnitude, times)
        assert (float(train.t_start), float(train.t_stop)) == (0.0, 3.0)
    places = [train.annotations["position"] for train in segment.spiketrains]
    np.testing.assert_array_equal(places, felt["site_position"].values[:3])
    assert "counts are no result" in segment.description
    resolved = dataclasses.replace(SPIKES, beyond={"SA-I": 101.0})
    trains = fs.neo_block(resolved).segments[0].spiketrains
    assert [train.annotations["resolved"] for train in trains] == [True, True, False]
    (epochs,) = segment.epochs
    assert epochs.labels.tolist() == [*felt["phase_kind"].values, "partial slip"]
    np.testing.assert_array_equal(epochs.times.magnitude[:-1], felt["phase_start"].values)
    np.testing.assert_allclose((epochs.times + epochs.durations).magnitude[:-1], felt["phase_end"].values)
    forces, displacements = segment.irregularlysampledsignals
    np.testing.assert_array_equal(forces.magnitude, felt["counterface_force"].values[:, 0])
    assert (forces.dimensionality.string, displacements.dimensionality.string) == ("N", "m")
    (slip,) = segment.events
    times = fs.find_events(felt).slip
    assert slip.labels.tolist() == ["incipient", "noticed", "three_quarter", "overall"]
    assert slip.magnitude.tolist() == [times.incipient, times.noticed, times.three_quarter, times.overall]
    assert len(fs.neo_block(SPIKES).segments[0].events) == 0
    (segment,) = fs.neo_block(SPIKES, felt.isel(phase=slice(0))).segments
    assert len(segment.epochs[0]) == 0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:AnnotationSeries is deprecated:UserWarning", "ignore::FutureWarning")
def test_neo_writes_a_block_as_nwb_and_reads_the_files_of_this_package(felt, tmp_path):
    pytest.importorskip("pynwb")
    io = pytest.importorskip("neo.io")
    felt = felt.assign_attrs(run="study/run", depth=1e-3)
    fs.write_nwb(SPIKES, tmp_path / "ours.nwb", felt, start=START)
    io.NWBIO(str(tmp_path / "neos.nwb"), "w").write_all_blocks([fs.neo_block(SPIKES, felt)])
    for name in ("ours", "neos"):
        (block,) = io.NWBIO(str(tmp_path / f"{name}.nwb"), "r").read_all_blocks()
        trains = [train for segment in block.segments for train in segment.spiketrains]
        assert sorted(train.size for train in trains) == [0, 1, 2], name


def test_a_file_of_nwb_says_which_run_it_is_of(felt, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    # Under a constant force the plate goes on along its normal, too.
    sinking = felt["counterface_displacement"] + felt["time"] * felt["counterface_normal"]
    felt = felt.assign(counterface_displacement=sinking.transpose(*felt["counterface_displacement"].dims))
    path = fs.write_nwb(SPIKES, tmp_path / "a.nwb", felt.assign_attrs(run="study/run", depth=1e-3), models="my models")
    with pynwb.NWBHDF5IO(str(path), "r") as stream:
        file = stream.read()
        assert file.session_id == "study_run"
        assert file.session_description.endswith("not a recording. Spikes come from my models. Run: study/run.")
        assert file.protocol.startswith("press 0 to 1 s, slide 1 to ")
        assert "my models" in file.data_collection
        (name,) = felt["counterface"].values
        for words in (f"Friction coefficient at {name}: ", "slides towards (1, 0)", "a section 1 mm deep, no finger's"):
            assert words in file.experiment_description
        assert "force of the counterface on the body" in file.stimulus[f"force_{name}"].description


@pytest.mark.parametrize("origin", ["", "microneurography, subject 3"])
def test_recordings_of_someone_are_not_called_simulated(origin, felt, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    spikes = fs.Spikes(SPIKES.names, SPIKES.kinds, SPIKES.times, 0.0, 3.0, origin=origin)
    said = f"Origin of the spikes: {origin or 'not stated'}. Written by fingerslip"
    with pynwb.NWBHDF5IO(str(fs.write_nwb(spikes, tmp_path / "a.nwb", felt)), "r") as stream:
        file = stream.read()
        texts = file.session_description, file.data_collection, file.units.description
        assert file.subject is None
    pytest.importorskip("neo")
    for text in (*texts, fs.neo_block(spikes, felt).description):
        assert said in text
        assert "imulat" not in text
        assert "monkeys" not in text
    assert not pynwb.validate(path=str(tmp_path / "a.nwb"))


def test_spikes_of_a_sensor_are_of_no_species_and_a_model_without_steps_gives_no_resolution(tmp_path):
    pynwb = pytest.importorskip("pynwb")
    spikes = dataclasses.replace(SPIKES, kinds=("pin",) * 3)
    path = fs.write_nwb(spikes, tmp_path / "a.nwb", models={"pin": Kernel()})
    with pynwb.NWBHDF5IO(str(path), "r") as stream:
        file = stream.read()
        assert (file.subject.species, file.units.resolution) == (None, None)
    assert not pynwb.validate(path=str(path))


@pytest.mark.parametrize(
    ("spikes", "message"),
    [
        (fs.Spikes((), (), (), 0.0, 3.0), "spikes: have no afferents, need one or more"),
        (dataclasses.replace(SPIKES, names=("FA-I-01", "FA-I-02", "x")), "spikes: are of 'x', which the history does"),
    ],
)
def test_spikes_of_no_receptors_or_others_are_refused(spikes, message, felt, tmp_path):
    pytest.importorskip("pynwb")
    with pytest.raises(InputError, match=message):
        fs.write_nwb(spikes, tmp_path / "spikes.nwb", felt)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("module", "write"), [("pynwb", lambda path: fs.write_nwb(SPIKES, path)), ("neo", lambda _: fs.neo_block(SPIKES))]
)
def test_a_missing_package_is_named_with_what_installs_it(module, write, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r'pip install "fingerslip\[neural\]"'):
        write(tmp_path / "spikes.nwb")
    assert list(tmp_path.iterdir()) == []

# The public names of fingerslip and their homes: the one list that type checkers read and that loads them when used.

from .afferents.model import IntegrateAndFire as IntegrateAndFire, human_afferents as human_afferents
from .afferents.signals import receptor_stimuli as receptor_stimuli
from .afferents.spikes import Spikes as Spikes, spikes_of as spikes_of
from .contact.counterfaces import Cylinder as Cylinder, Plane as Plane, Sphere as Sphere
from .contact.friction import (
    Anisotropic as Anisotropic,
    Coulomb as Coulomb,
    PressureDependent as PressureDependent,
    SlipWeakening as SlipWeakening,
    StaticKinetic as StaticKinetic,
    TimeDependent as TimeDependent,
)
from .detect.live import LiveDetector as LiveDetector
from .detect.residual import ResidualDetector as ResidualDetector
from .dynamics.steering.commands import Command as Command
from .dynamics.simulation import simulate as simulate, simulate_together as simulate_together
from .dynamics.steering.steering import Observation as Observation, Simulation as Simulation
from .errors import (
    ConvergenceError as ConvergenceError,
    EquilibriumError as EquilibriumError,
    FingerslipError as FingerslipError,
    InputError as InputError,
    InvertedCellError as InvertedCellError,
    MeshError as MeshError,
    ResultError as ResultError,
    SlipOutsideContactError as SlipOutsideContactError,
)
from .export import (
    export_history as export_history,
    history_tables as history_tables,
    neo_block as neo_block,
    write_nwb as write_nwb,
)
from .history import read_history as read_history, write_history as write_history
from .materials.elastic import RayleighDamping as RayleighDamping
from .materials.elastic import Elastic as Elastic
from .materials.choice import material as material, material_names as material_names
from .materials.mooney_rivlin import MooneyRivlin as MooneyRivlin
from .materials.neo_hookean import NeoHookean as NeoHookean
from .materials.ogden import Ogden as Ogden, OgdenTerm as OgdenTerm
from .materials.prony import PronyTerm as PronyTerm
from .mesh.decks.materials import read_materials as read_materials
from .mesh.io import read_mesh as read_mesh, write_mesh as write_mesh
from .mesh.joining import join_meshes as join_meshes
from .mesh.quality import quality_table as quality_table
from .mesh.scan.build import ScanMesh as ScanMesh, SurfaceMesh as SurfaceMesh, mesh_scan as mesh_scan
from .mesh.scan.layered import LayerSizes as LayerSizes, build_from_surfaces as build_from_surfaces
from .mesh.scan.surfaces import decimate_surface as decimate_surface, offset_inwards as offset_inwards
from .mesh.scan.placement import (
    Placement as Placement,
    place_surface as place_surface,
    placement_from_directions as placement_from_directions,
    placement_from_landmarks as placement_from_landmarks,
)
from .mesh.scan.repair import repair_surface as repair_surface
from .mesh.scan.surfaces import Surface as Surface, read_surface as read_surface, write_surface as write_surface
from .model.model import (
    Contact as Contact,
    Drive as Drive,
    Model as Model,
    Recording as Recording,
    ReducedBasis as ReducedBasis,
    SupportMotion as SupportMotion,
    Traction as Traction,
)
from .model.programme import Hold as Hold, Lift as Lift, Press as Press, Ramp as Ramp, Slide as Slide
from .react.scenario import travel_after as travel_after
from .react.detectors import (
    AtOnce as AtOnce,
    ForceRatio as ForceRatio,
    Never as Never,
    SlippedArea as SlippedArea,
    SpikeCount as SpikeCount,
    StickRatio as StickRatio,
)
from .react.run import CriticalStart as CriticalStart, critical_start as critical_start
from .react.loads import (
    DroppedBall as DroppedBall,
    FilledVessel as FilledVessel,
    LoadSeries as LoadSeries,
    RampLoad as RampLoad,
    StepLoad as StepLoad,
)
from .react.loop import Grasp as Grasp, OpenLoop as OpenLoop, Outcome as Outcome
from .react.markers import LearnedMarkers as LearnedMarkers
from .react.moment import Alarm as Alarm, Moment as Moment
from .react.reflex import (
    Actuator as Actuator,
    Reaction as Reaction,
    Reflex as Reflex,
    reaction as reaction,
    reaction_names as reaction_names,
)
from .react.scenario import HeldObject as HeldObject, holder_of as holder_of
from .report.figures.motion import HistoryPlot as HistoryPlot, plot as plot
from .report.figures.style import save_figure as save_figure
from .report.page.pictures import draw as draw
from .results import StudyResult as StudyResult
from .model.rigid_bodies import (
    BodyLoad as BodyLoad,
    BodyVelocity as BodyVelocity,
    Dampers as Dampers,
    RigidBody as RigidBody,
    Springs as Springs,
)
from .sites import Site as Site
from .slip import (
    Events as Events,
    SlipEvents as SlipEvents,
    acceleration_peaks as acceleration_peaks,
    find_events as find_events,
)
from .specimens.fingertip.fingertip import (
    Fingertip as Fingertip,
    MeshSizes as MeshSizes,
    SolidSizes as SolidSizes,
    build_section as build_section,
    build_solid as build_solid,
    fingertip_from as fingertip_from,
    preset as preset,
    preset_names as preset_names,
    preset_table as preset_table,
)
from .specimens.fingertip.sites import (
    receptor_sites as receptor_sites,
    reference_sites as reference_sites,
    solid_receptor_sites as solid_receptor_sites,
)
from .study.definition.schema import study_schema as study_schema
from .study.definition.spec import read_study as read_study
from .study.scripted import OpenedStudy as OpenedStudy, open_study as open_study
from .study.fit import Posterior as Posterior, fit as fit
from .study.running.runner import StudyFailedError as StudyFailedError, run_study as run_study
from .study.scripted import Study as Study, study_model as study_model
from .model.timing import Adaptive as Adaptive, QuasiStatic as QuasiStatic, TimeStepping as TimeStepping
from .version import __version__ as __version__
from .vision.cameras.camera import Camera as Camera, Pose as Pose, true_tracks as true_tracks
from .vision.cameras.intrinsics import (
    Fisheye as Fisheye,
    Pinhole as Pinhole,
    pinhole_for_view as pinhole_for_view,
    read_calibration as read_calibration,
    write_calibration as write_calibration,
)
from .vision.cameras.pixel import (
    BrightRing as BrightRing,
    Glare as Glare,
    Lighting as Lighting,
    MarkerLook as MarkerLook,
    PixelCamera as PixelCamera,
    SensorNoise as SensorNoise,
    film as film,
)
from .vision.cameras.point import (
    PointCamera as PointCamera,
    measure_errors as measure_errors,
    point_tracks as point_tracks,
)
from .vision.comparison import PositionErrors as PositionErrors
from .vision.cameras.camera import external_camera as external_camera, internal_camera as internal_camera
from .vision.fields import marker_fields as marker_fields
from .marker_layouts import (
    MarkerLayout as MarkerLayout,
    grid_layout as grid_layout,
    hexagonal_layout as hexagonal_layout,
    ring_layout as ring_layout,
)
from .vision.video import live_frames as live_frames
from .vision.tracking.track import TrackingWarning as TrackingWarning, track_markers as track_markers
from .vision.tracking.tracker import MarkerTracker as MarkerTracker
from .vision.tracks import (
    make_tracks as make_tracks,
    read_tracks as read_tracks,
    read_tracks_csv as read_tracks_csv,
    write_tracks as write_tracks,
    write_tracks_csv as write_tracks_csv,
)

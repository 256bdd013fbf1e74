"""Reads datasets of graspmill: completion pairs with touch, reachability maps, grasps, patches, scenes, views, amodal pairs,
volumes, picks, heatmaps and suction.

    import graspmill
    data = graspmill.Dataset("datasets/quickstart", graspmill.CompletionSample, split="training")
    partial, complete = data[0].partial, data[0].complete    # bool (n, n, n), indexed (x, y, z)

See ``docs/python.md`` for a guide, ``docs/format.md`` for the meaning of every number.
"""

from .amodal import AmodalSample, Clutter
from .arrays import NpyExport
from .completion import CompletionSample, Contacts, Depth, Implicit, Pair, PairBatch, Tsdf
from .dataset import Dataset
from .errors import (
    BadSelection,
    DamagedFile,
    DatasetError,
    MissingPackage,
    UnfinishedDataset,
    UnknownFormat,
    WrongProduct,
)
from .field import Axis, Nearest, ReachabilityField
from .folder import FORMAT_VERSION, Folder
from .geometry import Camera, Grid, SampleId, pack, unpack
from .grasps import (
    FAILURE_REASONS,
    FREE_WAYS,
    GRADED_LABELS,
    GRASP_LABELS,
    LADDER_LEVELS,
    PATH_STAGES,
    POINT_SCHEMES,
    TRIAL_PHASES,
    TRIAL_VERDICTS,
    VERDICTS,
    WAYPOINTS,
    GraspSample,
    grasp_frame,
)
from .heatmaps import PICK_STATES, HeatmapSample
from .index import Index
from .patches import Heatmap, ImageColour, PatchSample
from .picks import (
    PICK_OBSTACLES,
    PICK_PHASES,
    PICK_SCHEMES,
    PICK_STAGES,
    PICK_VERDICTS,
    PickSample,
    PickSampling,
    PickTrial,
)
from .reachability import LABELS, PROOFS, ReachabilitySample
from .samples import Sample
from .scenes import Overview, SceneContacts, SceneSample
from .shapes import Mesh, ObjectFacts, RestingPose, object_facts, object_meshes, resting_poses
from .shuffle import ShuffledChunks
from .suction import SEAL_LIMITS, SUCTION_RESULTS, SUCTION_STRENGTHS, SURFACE_MEASURES, CupMeasures, SuctionSample
from .views import ViewSample
from .volumes import Affordance, VolumeSample

__version__ = "0.1.0"

__all__ = [
    "Affordance",
    "AmodalSample",
    "Axis",
    "BadSelection",
    "Camera",
    "Clutter",
    "CompletionSample",
    "Contacts",
    "CupMeasures",
    "DamagedFile",
    "Dataset",
    "DatasetError",
    "Depth",
    "FORMAT_VERSION",
    "FREE_WAYS",
    "Folder",
    "GraspSample",
    "Grid",
    "Heatmap",
    "HeatmapSample",
    "ImageColour",
    "Implicit",
    "Index",
    "LABELS",
    "Mesh",
    "MissingPackage",
    "Nearest",
    "NpyExport",
    "ObjectFacts",
    "Overview",
    "PATH_STAGES",
    "PICK_OBSTACLES",
    "PICK_PHASES",
    "PICK_SCHEMES",
    "PICK_STAGES",
    "PICK_STATES",
    "PICK_VERDICTS",
    "POINT_SCHEMES",
    "PROOFS",
    "Pair",
    "PairBatch",
    "PatchSample",
    "PickSample",
    "PickSampling",
    "PickTrial",
    "ReachabilityField",
    "ReachabilitySample",
    "RestingPose",
    "Sample",
    "SEAL_LIMITS",
    "SUCTION_RESULTS",
    "SUCTION_STRENGTHS",
    "SURFACE_MEASURES",
    "SampleId",
    "SceneContacts",
    "SceneSample",
    "ShuffledChunks",
    "SuctionSample",
    "FAILURE_REASONS",
    "GRADED_LABELS",
    "GRASP_LABELS",
    "LADDER_LEVELS",
    "TRIAL_PHASES",
    "TRIAL_VERDICTS",
    "Tsdf",
    "UnfinishedDataset",
    "UnknownFormat",
    "VERDICTS",
    "ViewSample",
    "VolumeSample",
    "WAYPOINTS",
    "WrongProduct",
    "grasp_frame",
    "object_facts",
    "object_meshes",
    "pack",
    "resting_poses",
    "unpack",
]

"""Samples of picks: grasps of one body of a settled scene, their obstacles, and trials among the neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .geometry import Floats, pose, poses
from .grasps import FREE_WAYS
from .samples import as_array, content, expect_lengths
from .settled import BodySample

PICK_OBSTACLES = ("free", "ground", "container", "own object", "neighbour")
"""Obstacles of a hand, by the numbers of ``verdicts``; 0: none."""
PICK_STAGES = ("free", "pregrasp", "approach", "closing", "shaping")
"""Stage of a hand's path, by the numbers of ``stages``: in its posture where it begins to close, on the way there, while it
closes, and, if it approached opened, while it takes its posture."""
PICK_VERDICTS = (
    "held",
    "starts_too_deep",
    "not_touching",
    "one_link",
    "lost_approaching",
    "lost_closing",
    "lost_lifting",
    "lost_holding",
    "let_go",
    "not_lifted",
    "unstable",
)
"""Verdicts on trials among neighbours, by their numbers."""
PICK_PHASES = ("approach", "closing", "lift", "hold")
"""Phases of a trial among neighbours, by their numbers."""
PICK_SCHEMES = ("area", "thickness", "cells")
"""Draws of the first point of a sampled grasp, by the numbers of ``PickSampling.schemes``: uniform over the area, over the octaves of
the body's thickness, over the cells of a grid of 20 mm."""


@dataclass(frozen=True, eq=False)
class PickSampling:
    """Sampling of the grasps of a body in its scene. ``poses`` is the sum of all counts from ``unopposed`` to ``free``; dicts have
    the obstacles as keys: ground, container, own object, neighbour."""

    friction: float
    """Coefficient of friction of the cone in which the second point of a pair lies."""
    half_angle: float
    """Largest angle between the approach and straight down [rad]."""
    budget: int
    """Poses, at most."""
    poses: int
    """Poses drawn."""
    unopposed: int
    """Poses without an opposite point within the friction cones."""
    too_wide: int
    """Poses whose points are farther apart than the hand opens."""
    tilted: int
    """Poses without an approach within the half angle of straight down."""
    too_low: int
    """Poses whose fingertips are below the floor before they are past the points."""
    rejected: dict[str, int]
    """Poses that a yes-or-no test rejects, by obstacle."""
    alike: int
    """Poses like a free grasp that was found before; they are not tested."""
    blocked: dict[str, int]
    """Poses whose exact path is blocked, by obstacle."""
    free: int
    """Free grasps, unlike each other."""
    palm_only: bool
    """Whether no grasp is free and a pose was rejected for the palm alone."""
    schemes: npt.NDArray[np.uint8]
    """(candidates,) draw of the first point: an index into ``PICK_SCHEMES``."""
    points: Floats
    """(candidates, 2, 3) m, in the object's frame: the points between the pads."""
    openings: Floats
    """(candidates,) m between the opened pads."""
    depths: Floats
    """(candidates,) m of the fingertips past the points along the approach."""

    @property
    def blocked_by(self) -> str | None:
        """Obstacle of most poses at the last stage that one reached; ``None`` with a free grasp, or if no pose met an obstacle."""
        for counts in (self.blocked, self.rejected):
            if not self.free and any(counts.values()):
                return max(counts, key=lambda name: counts[name])
        return None


@dataclass(frozen=True, eq=False)
class PickTrial:
    """The trial of one free candidate, among the neighbours."""

    candidate: int
    """Index in the candidates of the sample."""
    verdict: str
    """One of ``PICK_VERDICTS``."""
    time: float
    """Time of the decision since the trial began [s]."""
    raised: float
    """Height gain of the body's centre of mass at the end [m]."""
    penetration: float
    """Deepest overlap of hand and body after the hand closed [m]."""
    object_from_base: Floats | None
    """(4, 4) pose of the hand's base when it had closed; ``None`` if it did not close."""
    links: list[str]
    """Link of each contact of the closed hand with the body."""
    points: Floats
    """(contacts, 3) m on the body's surface, in the frame of the hand's base."""
    normals: Floats
    """(contacts, 3) outward from the body, in the frame of the hand's base."""
    forces: Floats
    """(contacts,) N along the normals."""
    touched: dict[int, tuple[str, float, float]]
    """Things that the hand pressed on, other than the body, by number, 0 the container: phase and time [s] of the first touch,
    largest force [N]."""
    moved: dict[int, float]
    """Largest displacement of each neighbour that could move [m], by number."""
    lifted: dict[int, float]
    """Height gain of each such neighbour at the end [m], by number."""

    @property
    def held(self) -> bool:
        """Whether the body was lifted and kept."""
        return self.verdict == PICK_VERDICTS[0]


class PickSample(BodySample):
    """Grasps of one body of a settled scene. Bodies are numbered from 1, in the order of the scene; candidates are rows of
    arrays."""

    product = "picks"
    main = "grasps"
    __slots__ = ()

    @content
    def hand(self) -> str:
        """Name of the hand."""
        return str(self.message("grasps")["hand"])

    @content
    def margin(self) -> float:
        """Distance that the hand keeps from everything except the body [m]."""
        return float(self.message("grasps")["margin"])

    @content
    def runs(self) -> npt.NDArray[np.uint32]:
        """(candidates,) number of the run of each stored grasp: its item in the dataset of grasps."""
        return np.asarray(self.message("grasps")["runs"], np.uint32)

    @content
    def ranks(self) -> npt.NDArray[np.uint32]:
        """(candidates,) index of each stored grasp in its run."""
        return self._per_candidate("ranks", np.uint32)

    @content
    def directions(self) -> npt.NDArray[np.uint32]:
        """(candidates,) number of its direction; 0 is the stored grasp."""
        return self._per_candidate("directions", np.uint32)

    @content
    def world_from_base(self) -> Floats:
        """(candidates, 4, 4) poses of the hand's base where it closes."""
        found = poses(self.message("grasps")["world_from_base"])
        expect_lengths(len(self.runs), world_from_base=found)
        return found

    @content
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """(candidates,) obstacle of the hand that approaches in its posture, as in trials: an index into ``PICK_OBSTACLES``; 0
        if free."""
        return as_array(self.message("grasps")["verdicts"], "u1", len(self.runs))

    @content
    def free(self) -> npt.NDArray[np.bool_]:
        """(candidates,) whether the hand approaches in its posture and closes without touching anything except the body."""
        return np.asarray(self.verdicts == 0)

    @content
    def stages(self) -> npt.NDArray[np.uint8]:
        """(candidates,) stage of the path with the obstacle, an index into ``PICK_STAGES``."""
        return as_array(self.message("grasps")["stages"], "u1", len(self.runs))

    @content
    def neighbours(self) -> npt.NDArray[np.uint32]:
        """(candidates,) number of the body that is the obstacle, from 1; 0 if it is not a neighbour."""
        return self._per_candidate("neighbours", np.uint32)

    @content
    def clearances(self) -> Floats:
        """(candidates,) m from the obstacle, negative where they overlap; for a free candidate the smallest distance, up to
        0.01."""
        return self._per_candidate("clearances", np.float64)

    @content
    def verdicts_opened(self) -> npt.NDArray[np.uint8]:
        """(candidates,) as ``verdicts``, for the hand that approaches opened and takes its posture where it closes."""
        return as_array(self.message("grasps")["verdicts_opened"], "u1", len(self.runs))

    @content
    def free_opened(self) -> npt.NDArray[np.bool_]:
        """(candidates,) as ``free``, for the hand that approaches opened."""
        return np.asarray(self.verdicts_opened == 0)

    @content
    def stages_opened(self) -> npt.NDArray[np.uint8]:
        """(candidates,) as ``stages``, for the hand that approaches opened."""
        return as_array(self.message("grasps")["stages_opened"], "u1", len(self.runs))

    @content
    def neighbours_opened(self) -> npt.NDArray[np.uint32]:
        """(candidates,) as ``neighbours``, for the hand that approaches opened."""
        return self._per_candidate("neighbours_opened", np.uint32)

    @content
    def clearances_opened(self) -> Floats:
        """(candidates,) as ``clearances``, for the hand that approaches opened."""
        return self._per_candidate("clearances_opened", np.float64)

    @content
    def free_ways(self) -> npt.NDArray[np.str_]:
        """(candidates,) ways of approach that are free, each one of ``FREE_WAYS``: opened, or in its posture."""
        names: npt.NDArray[np.str_] = np.array(FREE_WAYS)[2 * self.free + self.free_opened]
        return names

    @content
    def nearest_free_rotations(self) -> Floats:
        """(candidates,) rad, from -pi to pi: smallest rotation about its closing line by which each candidate becomes a free one, in
        steps of the evaluated directions; 0 of a free candidate, NaN where no direction of the same stored grasp is free."""
        rolls = int(self.message("grasps")["rolls"])
        found: Floats = np.full(len(self.runs), np.nan)
        keys = list(zip(self.runs.tolist(), self.ranks.tolist()))
        free: dict[tuple[int, int], list[int]] = {}
        for key, direction, is_free in zip(keys, self.directions.tolist(), self.free.tolist()):
            if is_free:
                free.setdefault(key, []).append(direction)
        for number, (key, direction) in enumerate(zip(keys, self.directions.tolist())):
            ahead = [(other - direction) % rolls for other in free.get(key, [])]
            steps = [each - rolls if 2 * each > rolls else each for each in ahead]
            if steps:
                found[number] = 2 * np.pi * min(steps, key=lambda each: (abs(each), each < 0)) / rolls
        return found

    @content
    def joint_names(self) -> list[str]:
        """Names of the hand's joints."""
        return [str(name) for name in self.message("grasps")["joints"]]

    @content
    def closed_joints(self) -> Floats:
        """(candidates, joints) all joints of the hand closed on the body without the other bodies [rad or m]; NaN if neither way
        is free."""
        joints: Floats = np.full((len(self.runs), len(self.joint_names)), np.nan)
        joints[self.free | self.free_opened] = self.message("grasps")["closed_joints"].reshape(-1, len(self.joint_names))
        return joints

    @content
    def trials(self) -> list[PickTrial]:
        """Trials of some of the free candidates; needs the channel of trials."""
        message = self.message("trials")
        links = [str(name) for name in message["links"]]
        return [_trial(trial, links) for trial in message["trials"]]

    @content
    def sampling(self) -> PickSampling:
        """Sampling of the grasps in the scene; needs the channel of sampling, which datasets of stored grasps do not have."""
        message = self.message("sampling")
        count = len(self.runs)
        points = message["points"].reshape(-1, 2, 3)
        expect_lengths(count, points=points, openings=message["openings"], depths=message["depths"])
        return PickSampling(
            friction=float(message["friction"]),
            half_angle=float(message["half_angle"]),
            budget=int(message["budget"]),
            poses=int(message["poses"]),
            unopposed=int(message["unopposed"]),
            too_wide=int(message["too_wide"]),
            tilted=int(message["tilted"]),
            too_low=int(message["too_low"]),
            rejected=_by_obstacle(message["rejected"]),
            alike=int(message["alike"]),
            blocked=_by_obstacle(message["blocked"]),
            free=int(message["free"]),
            palm_only=bool(message["palm_only"]),
            schemes=as_array(message["schemes"], "u1", count),
            points=points,
            openings=message["openings"],
            depths=message["depths"],
        )

    def _per_candidate(self, name: str, kind: type) -> npt.NDArray[Any]:
        found: npt.NDArray[Any] = np.asarray(self.message("grasps")[name], kind)
        expect_lengths(len(self.runs), **{name: found})
        return found


def _by_obstacle(counts: Any) -> dict[str, int]:
    found = np.asarray(counts).tolist()
    expect_lengths(len(PICK_OBSTACLES) - 1, counts=found)
    return dict(zip(PICK_OBSTACLES[1:], found))


def _trial(message: Any, links: list[str]) -> PickTrial:
    touches = [links[link] for link in message["links"]]
    points, normals = (message[name].reshape(-1, 3) for name in ("points", "normals"))
    expect_lengths(len(touches), points=points, normals=normals, forces=message["forces"])
    touched = zip(
        np.asarray(message["touched"]).tolist(),
        (PICK_PHASES[phase] for phase in message["touched_phases"]),
        message["touched_times"].tolist(),
        message["touched_forces"].tolist(),
    )
    awake = np.asarray(message["awake"]).tolist()
    expect_lengths(len(awake), moved=message["moved"], lifted=message["lifted"])
    base = message["object_from_base"]
    return PickTrial(
        candidate=int(message["candidate"]),
        verdict=PICK_VERDICTS[message["verdict"]],
        time=float(message["time"]),
        raised=float(message["raised"]),
        penetration=float(message["penetration"]),
        object_from_base=pose(base) if len(base) else None,
        links=touches,
        points=points,
        normals=normals,
        forces=message["forces"],
        touched={thing: (phase, time, force) for thing, phase, time, force in touched},
        moved=dict(zip(awake, message["moved"].tolist())),
        lifted=dict(zip(awake, message["lifted"].tolist())),
    )

"""Samples of grasp datasets: one run of annealing, its grasps, and physical trials of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .frames import import_pandas
from .geometry import pose
from .samples import Sample, content, expect_lengths
from .wire import Message, WireError

if TYPE_CHECKING:
    import pandas as pd

    from .dataset import Dataset

VERDICTS = ("kept", "penetrates", "open_hand", "no_force_closure", "low_quality", "below_table")
"""Name of each verdict on a grasp."""
POINT_SCHEMES = (None, "area", "thickness", "cells")
"""Scheme by which the point of a pair or an approach was drawn, by number; none for samplers without points."""
TRIAL_VERDICTS = (
    *("held", "starts_too_deep", "not_touching", "one_link", "lost_closing", "lost_lifting", "lost_shaking"),
    *("lost_turned", "let_go", "unstable"),
)
"""Name of each verdict on a physical trial."""

GRASP_LABELS = (None, "untested", "held", "failed", "borderline", "unconfirmed")
"""Labels of grasps, the combined result of all trials, by number; none in datasets of earlier versions."""

GRADED_LABELS = (None, "untested", "held", "partial", "failed", "blocked")
"""Graded labels of grasps, by number."""
LADDER_LEVELS = ("easy", "nominal", "adverse", "hard")
"""Levels of graded labels, the easiest first."""
FAILURE_REASONS = (
    *(None, "blocked", "nothing", "pushed_away", "ejected", "one_sided", "slipped_lift", "rotated_lift"),
    *("slipped_shake", "rotated_shake", "let_go", "unstable", "starts_too_deep"),
)
"""Reasons why a grasp failed, by number."""
HELD_SHARE = 0.75
"""Share of the levels from which on a grasp is labelled held."""
SYMMETRIC_IMBALANCE = 0.25
"""Imbalance of the normal forces below which a hand has closed symmetrically."""

WAYPOINTS = ("pregrasp", "arrival", "posture", "closed", "lifted")
"""Name of each waypoint of a grasp."""
PATH_STAGES = (None, "pregrasp", "approach", "closing", "shaping")
"""Stage of the path of a hand, by number: in its posture where it begins to close, on the way there, while it closes, and, if it
approached opened, while it takes its posture."""
FREE_WAYS = ("none", "opened", "posture", "both")
"""Ways of approach that are free: for the hand that approaches opened, and for the hand that approaches in its posture."""
TRIAL_PHASES = {
    "lifted": ("closing", "lift", "shake"),
    "six": ("closing", "-z", "z", "-y", "y", "-x", "x"),
}
"""Names of the phases of a trial, by its gravity."""

_NUMBERS = (
    *("penetration", "energy", "contact_energy", "potential", "epsilon_force", "epsilon_wrench", "volume", "advance"),
)
_JOINTS = ("opening", "posture", "amplitudes", "joints_before", "joints")
_OUTCOME = (
    *("time", "closing_time", "start_penetration", "closed_penetration", "shaken_penetration", "farthest", "force"),
    *("opened_by", "drawn_back"),
)
_CONTACT = [("grasp", "<i4"), ("link", "<i4"), ("point", "<f8", 3), ("normal", "<f8", 3), ("distance", "<f8")]

_POSES = ("object_from_base", "object_from_approach")
_LISTS = (*_JOINTS, "clearances", "clearances_opened")
_OBSTACLES = (("", "table"), ("object", "object and table"))
_COUNTS = ("perturbed", "perturbed_held", "roll_outs", "roll_outs_held")
_TRIAL = ("trial", "held", *_COUNTS, "label", "robust", "table_pose", "table_trial", "held_on_table")
_GRADED = (
    *("graded_label", "success", "graded_trials", "reason", "graded_pose", "graded_obstacles", "second_law", "levels"),
    *("level_reasons", "level_slips", "level_rotations", "level_depths", "closing_moved", "closing_turned"),
    *("closed_links", "imbalance", "symmetric"),
)
_OBSTACLE_WORDS = ("", "object", "table", "object and table")
_LEVEL_STATES = (None, "inferred held", "inferred lost", "unknown")
# Verdicts of trials that are inconclusive.
_INCONCLUSIVE = (TRIAL_VERDICTS.index("starts_too_deep"), TRIAL_VERDICTS.index("unstable"))
# Columns of frames whose values may be missing, for all grasps or some, have a nullable type.
_KINDS = dict.fromkeys(("verdict", "point_scheme", "trial", "label", "table_trial", "free_ways"), "string")
_KINDS |= dict.fromkeys(("object_in_way_posture", "object_in_way_opened"), "string")
_KINDS |= dict.fromkeys(("held", "robust", "held_on_table"), "boolean")
_KINDS |= dict.fromkeys(("type", *_COUNTS, "table_pose"), "Int64")
_KINDS |= dict.fromkeys(("graded_label", "reason", "second_law"), "string")
_KINDS |= dict.fromkeys(("graded_trials", "graded_pose", "closed_links"), "Int64") | {"symmetric": "boolean"}

_MAX_RESTING_POSES = 4096
"""Far above the number of any object: a run that states more would allocate unlimited memory."""

Table = npt.NDArray[np.void]
Columns = dict[str, list[Any]]


class GraspSample(Sample):
    """One run from one seed on an object's surface. Metres and radians, in the object's frame."""

    product = "grasps"
    __slots__ = ()

    @content
    def run(self) -> Message:
        """The run itself, every field of ``GraspRun`` by name; ``grasps`` in it are messages, as stored."""
        return self.message("run")

    @content
    def grasps(self) -> Table:
        """One row per grasp, lowest energy first, as a structured array.

        Poses (4, 4): ``object_from_approach``, ``object_from_base``. Joints: ``opening`` and ``posture`` of the driven ones,
        ``joints_before`` and ``joints`` of all joints; ``amplitudes``. Numbers: ``penetration`` (m), ``energy``,
        ``contact_energy``, ``potential``, ``epsilon_force``, ``epsilon_wrench``, ``volume``, ``advance`` (m), ``width`` (m, NaN
        for a hand without a width). ``shift`` (m) and ``turn`` (rad) of grippers. ``clearances`` and ``clearances_opened`` (m,
        one per resting pose of the object, as ``resting_poses`` lists them; NaN where not measured). ``object_in_way`` (2,
        indices into ``PATH_STAGES``): the stage in which the object obstructs the hand that approaches in its posture, and the
        hand that approaches opened; 0 for none. ``type`` (-1: none), ``verdict`` (index into ``VERDICTS``), ``point_scheme`` (index
        into ``POINT_SCHEMES``), ``contacts`` (number of its rows in ``contacts``).
        """
        run = self.run
        rows: list[Message] = run["grasps"]
        poses = run["resting_poses"]
        if poses > _MAX_RESTING_POSES:
            raise WireError(f"{poses} resting poses")
        sizes = {name: max((len(row[name]) for row in rows), default=0) for name in _JOINTS}
        fields: list[Any] = [("object_from_approach", "<f8", (4, 4)), ("object_from_base", "<f8", (4, 4))]
        fields += [(name, "<f8", (sizes[name],)) for name in _JOINTS]
        fields += [(name, "<f8") for name in (*_NUMBERS, "width")]
        fields += [("shift", "<f8", (3,)), ("turn", "<f8", (3,))]
        fields += [("clearances", "<f8", (poses,)), ("clearances_opened", "<f8", (poses,))]
        fields += [("object_in_way", "u1", (2,))]
        fields += [("type", "<i8"), ("verdict", "u1"), ("point_scheme", "u1"), ("contacts", "<i4")]
        table = np.zeros(len(rows), fields)
        for place, row in enumerate(rows):
            for name in ("object_from_approach", "object_from_base"):
                table[name][place] = pose(row[name])
            for name in _JOINTS:
                expect_lengths(sizes[name], **{name: row[name]})
            for name in (*_JOINTS, *_NUMBERS, "verdict", "point_scheme"):
                table[name][place] = row[name]
            for name in ("shift", "turn"):
                if len(row[name]):
                    expect_lengths(3, **{name: row[name]})
                    table[name][place] = row[name]
            for name in ("clearances", "clearances_opened"):
                if len(row[name]):
                    expect_lengths(poses, **{name: row[name]})
                table[name][place] = row[name] if len(row[name]) else np.nan
            if len(row["object_in_way"]):
                expect_lengths(2, object_in_way=row["object_in_way"])
                table["object_in_way"][place] = row["object_in_way"]
            table["width"][place] = row["width"][0] if len(row["width"]) else np.nan
            table["type"][place] = row["type"][0] if len(row["type"]) else -1
            table["contacts"][place] = len(row["links"])
        return table

    def free_ways(self, resting_pose: npt.ArrayLike | None = None) -> npt.NDArray[np.str_]:
        """(grasps,) ways of approach without an obstacle before the hand closes, each one of ``FREE_WAYS``: opened from the
        pregrasp on, or in the posture in which it closes.

        Without a table only the object can be an obstacle. ``resting_pose``, one number or one per grasp as ``resting_poses``
        counts them, puts the object on a table, which is an obstacle below a clearance of 0.
        """
        shaped, opened = self._free(resting_pose)
        names: npt.NDArray[np.str_] = np.array(FREE_WAYS)[2 * shaped + opened]
        return names

    def waypoints(
        self, up: npt.ArrayLike = (0.0, 0.0, 1.0), lift: float = 0.1, resting_pose: npt.ArrayLike | None = None
    ) -> Table:
        """Waypoints of the hand as it approaches each grasp, closes and lifts: one row per grasp, one column per name
        in ``WAYPOINTS``.

        ``pregrasp``: ``stand_off`` back along the approach, opened if that way is free, else in the posture before closing.
        ``arrival``: the same where it closes. ``posture``: in that posture. ``closed``: closed. ``lifted``: closed, ``lift`` (m)
        higher along ``up``, which is expressed in the object's frame: its z axis, as in trials in the air; for an object on a
        table, the third row of a resting pose's rotation, ``resting_poses(folder)[name][k].world_from_object[2, :3]``.
        ``resting_pose`` as in ``free_ways``. A row is NaN if neither way is free.

        Fields: ``object_from_base`` (4, 4); ``driven`` (rad or m, in the order of ``run["driven"]``; NaN where the motors close
        until something stops them); ``joints`` (rad or m, in the order of ``run["joints"]``; NaN for the opened hand, of which
        only the driven joints are known).
        """
        grasps, stand_off = self.grasps, self.run["stand_off"]
        up = np.asarray(up, np.float64)
        if up.shape != (3,) or not abs(np.linalg.norm(up) - 1) < 1e-6:
            raise ValueError("up must be three numbers of unit length")
        shaped, opened = self._free(resting_pose)
        fields: list[Any] = [("object_from_base", "<f8", (4, 4))]
        fields += [("driven", "<f8", grasps["posture"].shape[1:]), ("joints", "<f8", grasps["joints"].shape[1:])]
        way = np.full((len(grasps), len(WAYPOINTS)), np.nan, fields)
        bases, driven, joints = way["object_from_base"], way["driven"], way["joints"]
        bases[:] = grasps["object_from_base"][:, None]
        bases[:, 0, :3, 3] -= stand_off * grasps["object_from_approach"][:, :3, 2]
        bases[:, 4, :3, 3] += lift * up
        driven[:, :3], joints[:, :3] = grasps["posture"][:, None], grasps["joints_before"][:, None]
        driven[opened, :2], joints[opened, :2] = grasps["opening"][opened, None], np.nan
        joints[:, 3:] = grasps["joints"][:, None]
        for values in (bases, driven, joints):
            values[~(shaped | opened)] = np.nan
        return way

    def _free(self, resting_pose: npt.ArrayLike | None) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Whether the way in the posture, and the opened way, is free for each grasp."""
        grasps = self.grasps
        # A hand that penetrates the object was not closed and has no way.
        free = (grasps["object_in_way"] == 0) & (grasps["verdict"] != VERDICTS.index("penetrates"))[:, None]
        if resting_pose is not None:
            count = grasps["clearances"].shape[1]
            poses = np.broadcast_to(np.asarray(resting_pose), len(grasps))
            if poses.dtype.kind not in "iu" or np.any((poses < 0) | (poses >= count)):
                raise ValueError(f"resting_pose must be from 0 to {count - 1}, one number or one per grasp")
            lowest = [grasps[name][np.arange(len(grasps)), poses] for name in ("clearances", "clearances_opened")]
            free &= np.stack(lowest, axis=1) >= 0
        return free[:, 0], free[:, 1]

    def frame(self) -> pd.DataFrame:
        """One row per grasp as a pandas DataFrame: the columns of ``grasp_frame`` from ``rank`` on.

        Raises ``MissingPackage`` without pandas.
        """
        return _frame([_columns_of_run(self)])

    @content
    def contacts(self) -> Table:
        """One row per contact of a closed hand: ``grasp`` (row of ``grasps``), ``link`` (index into ``run["links"]``),
        ``point`` and ``normal`` (on the object's surface, outward), ``distance`` (m, from the object to the link)."""
        return _contacts(self.run["grasps"], _CONTACT)

    @content
    def trials(self) -> Table:
        """One row per physical trial (channel ``trials``); states without one are untested, not bad.

        ``grasp`` (row of ``grasps``), ``verdict`` (index into ``TRIAL_VERDICTS``; 0: held), ``closed_at_rest``, ``links`` that
        touch at the end, times (s), penetrations, ``farthest`` and ``drawn_back`` (m), ``force`` (N), ``opened_by``,
        ``perturbed`` and ``perturbed_held`` (runs), ``roll_outs`` and ``roll_outs_held``, ``variants`` and ``variants_held``
        (variants of the conditions under which the grasp was tried again; 0 for a grasp that was not chosen), ``table_pose``
        (resting pose of the object in which it was tried on a table, -1 without such a trial) and ``held_on_table``.
        """
        rows: list[Message] = self.message("trials")["trials"]
        fields = [("grasp", "<i4"), ("verdict", "u1"), ("closed_at_rest", "?"), ("links", "<i4")]
        fields += [(name, "<f8") for name in _OUTCOME]
        counts = ("perturbed", "perturbed_held", "roll_outs", "roll_outs_held", "variants", "variants_held")
        fields += [(name, "<i4") for name in counts]
        fields += [("table_pose", "<i4"), ("held_on_table", "?")]
        table = np.zeros(len(rows), fields)
        for place, row in enumerate(rows):
            on_table = row["table"]
            table["table_pose"][place] = on_table["resting_pose"] if on_table else -1
            table["held_on_table"][place] = bool(on_table) and on_table["outcome"]["verdict"] == 0
            outcome = row["outcome"]
            for name in ("verdict", "closed_at_rest", "links", *_OUTCOME):
                table[name][place] = outcome[name]
            for name in ("grasp", "roll_outs", "roll_outs_held"):
                table[name][place] = row[name]
            table["perturbed"][place] = len(row["perturbed"])
            table["perturbed_held"][place] = sum(run["outcome"]["verdict"] == 0 for run in row["perturbed"])
            table["variants"][place] = len(row["variants"])
            table["variants_held"][place] = sum(verdict == 0 for verdict in row["variants"])
        return table

    @content
    def series(self) -> Table:
        """Chosen trials over time, one row per sample (channel ``trials``): ``grasp`` (row of ``grasps``), ``on_table`` (the
        trial on a table, else in the air), ``phase`` (index into ``TRIAL_PHASES[gravity]``, ``"lifted"`` on a table), ``time``
        (s, since the trial began), ``forces`` (N, of each of ``message("trials")["links"]``: the sum of its normal forces on the
        object), ``moved`` (m) and ``turned`` (rad): the object in the hand, since the hand began to close; after the closing
        phase, since gravity was switched on."""
        trials = self.message("trials")
        links, interval = len(trials["links"]), trials.get("series_interval", 0.0)
        stored = []
        for row in trials["trials"]:
            # Datasets of earlier versions have no such field.
            for is_on_table, trial in ((False, row), (True, row["table"] or {})):
                stored += [(row["grasp"], is_on_table, trial["series"])] if trial.get("series") else []
        fields: list[Any] = [("grasp", "<i4"), ("on_table", "?"), ("phase", "u1"), ("time", "<f8")]
        fields += [("forces", "<f4", (links,)), ("moved", "<f4"), ("turned", "<f4")]
        table = np.zeros(sum(len(series["moved"]) for _, _, series in stored), fields)
        first = 0
        for grasp, on_table, series in stored:
            count = len(series["moved"])
            expect_lengths(count, turned=series["turned"])
            expect_lengths(count * len(series["links"]), forces=series["forces"])
            some = table[first : first + count]
            first += count
            some["grasp"], some["on_table"], some["time"] = grasp, on_table, interval * np.arange(1, count + 1)
            phases = np.repeat(np.arange(len(series["samples"])), np.minimum(series["samples"], count).astype(np.int64))
            expect_lengths(count, samples=phases)
            some["phase"], some["moved"], some["turned"] = phases, series["moved"], series["turned"]
            some["forces"][:, series["links"].astype(np.int64)] = series["forces"].reshape(count, -1)
        return table

    @content
    def success(self) -> npt.NDArray[np.float64]:
        """(grasps,) share of the levels at which each grasp holds (channel ``ladder``): 0 if both ways of approach are blocked,
        NaN if it was not tried or the trial at the level nominal was inconclusive."""
        success = np.full(len(self.grasps), np.nan)
        for row in self.message("ladder")["ladders"]:
            success[row["grasp"]] = _success(row)
        return success

    def graded_labels(self, held: float = HELD_SHARE) -> npt.NDArray[np.str_]:
        """(grasps,) label of each grasp by its levels (channel ``ladder``), one of ``GRADED_LABELS``, or empty if it was not
        tried: ``held`` from this share of the levels on."""
        labels = np.full(len(self.grasps), "", "<U8")
        with self.reading():
            for row in self.message("ladder")["ladders"]:
                labels[row["grasp"]] = _graded_label(row, held)
        return labels

    @content
    def ladder(self) -> Table:
        """One row per grasp with a graded label (channel ``ladder``).

        ``grasp`` (row of ``grasps``), ``resting_pose`` (of the object, on whose table it was tried, -1 in the air),
        ``obstacles`` (2: on the way in posture and on the opened way, 1 object, 2 table, 3 both), ``success``, ``trials``,
        ``label`` (index into ``GRADED_LABELS``), ``reason`` (index into ``FAILURE_REASONS``, of the level nominal or the
        easiest level that was lost). Per level of ``LADDER_LEVELS`` (4): ``state`` (0 tried, 1 inferred to hold, 2 inferred to be
        lost, 3 unknown), ``verdict`` (index into ``TRIAL_VERDICTS``), ``reasons``, ``farthest`` (m) and ``rotation`` (rad) of the
        object in the hand with their ``farthest_phase`` and ``rotation_phase`` (index into ``TRIAL_PHASES["lifted"]``), ``depth``
        (m: deepest overlap from when the hand had closed), ``closing_moved`` (m), ``closing_turned`` (rad), ``closed_links`` and
        ``imbalance`` (0 to 1); numbers are NaN, verdicts 255 where no trial was made.
        """
        rows: list[Message] = self.message("ladder")["ladders"]
        fields: list[Any] = [("grasp", "<i4"), ("resting_pose", "<i4"), ("obstacles", "u1", 2), ("success", "<f8")]
        fields += [("trials", "<i4"), ("label", "u1"), ("reason", "u1")]
        count = len(LADDER_LEVELS)
        fields += [(name, "u1", count) for name in ("state", "verdict", "reasons", "farthest_phase", "rotation_phase")]
        numbers = ("farthest", "rotation", "depth", "closing_moved", "closing_turned", "imbalance")
        fields += [(name, "<f8", count) for name in numbers] + [("closed_links", "<i4", count)]
        table = np.zeros(len(rows), fields)
        for name in numbers:
            table[name] = np.nan
        table["verdict"], table["state"] = 255, 3
        for place, row in enumerate(rows):
            some = table[place]
            some["grasp"], some["label"], some["obstacles"] = row["grasp"], row["label"], row["obstacles"]
            some["resting_pose"] = row["resting_pose"][0] if len(row["resting_pose"]) else -1
            some["success"], some["trials"], some["reason"] = _success(row), _trials(row), _reason(row)
            for index, level in enumerate(row["levels"]):
                some["state"][index] = level["state"]
                if level["state"]:
                    continue
                outcome = level["outcome"]
                some["verdict"][index], some["farthest"][index] = outcome["verdict"], outcome["farthest"]
                some["reasons"][index], some["depth"][index] = level["reason"], _depth(outcome)
                for name in ("farthest_phase", "rotation_phase", "rotation", *numbers[3:], "closed_links"):
                    some[name][index] = level[name]
        return table

    @content
    def trial_contacts(self) -> Table:
        """Contacts when gravity was switched on, as ``contacts`` (channel ``trials``, or ``ladder`` at the level nominal); also
        ``force`` (N, along the normal)."""
        is_graded = self.has("ladder") and not self.has("trials")
        rows: list[Message] = self.message("ladder")["ladders"] if is_graded else self.message("trials")["trials"]
        return _contacts(rows, [*_CONTACT, ("force", "<f8")])


def _holds(level: Message) -> bool | None:
    """Whether a grasp holds at a level; None if that is unknown, or the trial was inconclusive."""
    if level["state"]:
        return {1: True, 2: False}.get(level["state"])
    verdict = level["outcome"]["verdict"]
    return None if verdict in _INCONCLUSIVE else bool(verdict == 0)


def _success(row: Message) -> float:
    """Share of the levels at which a grasp holds; 0 for a blocked one, NaN for an untested one."""
    levels = row["levels"]
    if not levels:
        return 0.0
    if _holds(levels[LADDER_LEVELS.index("nominal")]) is None:
        return np.nan
    return sum(_holds(level) is True for level in levels) / len(levels)


def _trials(row: Message) -> int:
    return sum(1 for level in row["levels"] if level["state"] == 0) + bool(row["second_law"])


def _reason(row: Message) -> int:
    """Why a grasp failed at the level nominal, or at the easiest level that it lost, as an index into FAILURE_REASONS."""
    if not row["levels"]:
        return FAILURE_REASONS.index("blocked")
    tried = [level for level in row["levels"][LADDER_LEVELS.index("nominal") :] if level["state"] == 0]
    return next((int(level["reason"]) for level in tried if level["reason"]), 0)


def _depth(outcome: Message) -> float:
    return float(max(outcome["closed_penetration"], outcome["shaken_penetration"]))


def _graded_label(row: Message, held: float) -> str:
    """The label of a grasp that is held from this share of the levels on."""
    success, levels = _success(row), row["levels"]
    if not levels:
        return "blocked"
    if np.isnan(success):
        return "untested"
    if 0 < success >= held:
        return "held"
    second = row["second_law"]
    lost = _holds(levels[0]) is False and bool(second) and _holds(second) is False
    return "failed" if lost else "partial"


def _contacts(rows: list[Message], fields: list[Any]) -> Table:
    counts = [len(row["links"]) for row in rows]
    table = np.zeros(sum(counts), fields)
    first = 0
    for place, (row, count) in enumerate(zip(rows, counts)):
        some = table[first : first + count]
        columns = {"link": row["links"], "distance": row["distances"]}
        columns |= {"point": row["points"].reshape(-1, 3), "normal": row["normals"].reshape(-1, 3)}
        if "forces" in row:
            columns["force"] = row["forces"]
        expect_lengths(count, **columns)
        some["grasp"] = row.get("grasp", place)
        for name, column in columns.items():
            some[name] = column
        first += count
    return table


def grasp_frame(data: Dataset[GraspSample]) -> pd.DataFrame:
    """One row per grasp of the runs of a dataset, kept or not, as a pandas DataFrame: the columns of
    ``graspmill export --to parquet`` (docs/tables.md).

    Runs are in their order, the grasps of each run with the lowest energy first. ``sample_index``, ``subject``, ``object``,
    ``split`` and ``item`` name the run, ``rank`` the grasp in it. Poses are 16 numbers (4 x 4, row-major). If the dataset has
    trials, ``trial`` is the verdict on the trial of the grasp and ``held`` whether it held; both are missing for grasps that
    were not tried: these are untested, not bad. ``label`` is the combined result of all trials of a grasp: ``held``, ``failed``,
    ``borderline`` if they disagree, ``unconfirmed`` if none held but not all were made, ``untested``. ``robust`` is whether a
    held grasp also holds under every variant of the conditions (known for some grasps), ``held_on_table`` whether the grasp
    lifted the object from a table on which it rested in its resting pose ``table_pose``. If it has graded labels, the columns from
    ``graded_label`` on are those of ``grasps.parquet``.

    Raises ``MissingPackage`` without pandas, ``KeyError`` if the selection does not read the channel ``run``.
    """
    parts = [_columns_of_run(sample) for sample in data]
    lengths = [len(part["rank"]) for part in parts]
    own = ("sample_index", "subject", "object", "split", "item")
    first = {name: np.repeat(data.column(name), lengths) for name in own}
    pandas = import_pandas()
    frame: pd.DataFrame = pandas.concat([pandas.DataFrame(first), _frame(parts)], axis=1)
    return frame


def _frame(parts: list[Columns]) -> pd.DataFrame:
    """The rows of several runs, one below the other."""
    pandas = import_pandas()
    joined = {name: [value for part in parts for value in part[name]] for name in (parts[0] if parts else ())}
    series = {name: pandas.Series(column, dtype=_KINDS.get(name)) for name, column in joined.items()}
    frame: pd.DataFrame = pandas.DataFrame(series)
    return frame


def _columns_of_run(sample: GraspSample) -> Columns:
    """The columns of one run, row by row.

    Raises ``DamagedFile`` if a message is invalid.
    """
    with sample.reading():
        return _unchecked_columns(sample)


def _unchecked_columns(sample: GraspSample) -> Columns:
    rows: list[Message] = sample.run["grasps"]
    columns: Columns = {"rank": list(range(len(rows))), "verdict": [VERDICTS[row["verdict"]] for row in rows]}
    columns["type"] = [row["type"][0] if len(row["type"]) else None for row in rows]
    columns["point_scheme"] = [POINT_SCHEMES[row["point_scheme"]] for row in rows]
    for name in _POSES:
        columns[name] = [pose(row[name]).reshape(16) for row in rows]
    backs = sample.grasps["object_from_base"].copy()
    backs[:, :3, 3] -= sample.run["stand_off"] * sample.grasps["object_from_approach"][:, :3, 2]
    columns["object_from_base_pregrasp"] = list(backs.reshape(-1, 16))
    columns["width"] = [row["width"][0] if len(row["width"]) else np.nan for row in rows]
    for name in _LISTS:
        columns[name] = [row[name] for row in rows]
    columns |= _columns_of_ways(sample)
    for name in _NUMBERS:
        columns[name] = [row[name] for row in rows]
    for name in ("shift", "turn"):
        columns[name] = [row[name] if len(row[name]) else None for row in rows]
    columns["contacts"] = [len(row["links"]) for row in rows]
    if sample.has("trials"):
        of_grasp = {trial["grasp"]: _outcome(trial) for trial in sample.message("trials")["trials"]}
        untried: Message = dict.fromkeys(_TRIAL)
        outcomes = [of_grasp.get(rank, untried) for rank in range(len(rows))]
        columns |= {name: [outcome[name] for outcome in outcomes] for name in _TRIAL}
    if sample.has("ladder"):
        graded = {row["grasp"]: _graded(row) for row in sample.message("ladder")["ladders"]}
        ungraded: Message = dict.fromkeys(_GRADED) | {"success": np.nan, "closing_moved": np.nan}
        ungraded |= {"closing_turned": np.nan, "imbalance": np.nan}
        ladders = [graded.get(rank, ungraded) for rank in range(len(rows))]
        columns |= {name: [ladder[name] for ladder in ladders] for name in _GRADED}
    return columns


def _graded(row: Message) -> Message:
    """The columns of graded labels of a grasp."""
    levels, second = row["levels"], row["second_law"]
    tried = [level if level["state"] == 0 else None for level in levels]
    nominal = tried[LADDER_LEVELS.index("nominal")] if tried else None

    def numbers(of: Callable[[Message], float]) -> npt.NDArray[np.float64] | None:
        return np.array([np.nan if level is None else of(level) for level in tried]) if tried else None

    def texts(of: Callable[[Message], str]) -> npt.NDArray[np.object_] | None:
        return np.array([of(level) for level in levels], object) if tried else None

    return {
        "graded_label": GRADED_LABELS[row["label"]],
        "success": _success(row),
        "graded_trials": _trials(row),
        "reason": FAILURE_REASONS[_reason(row)],
        "graded_pose": row["resting_pose"][0] if len(row["resting_pose"]) else None,
        "graded_obstacles": np.array([_OBSTACLE_WORDS[number] for number in row["obstacles"]], object),
        "second_law": TRIAL_VERDICTS[second["outcome"]["verdict"]] if second else None,
        "levels": texts(lambda level: _LEVEL_STATES[level["state"]] or TRIAL_VERDICTS[level["outcome"]["verdict"]]),
        "level_reasons": texts(lambda level: FAILURE_REASONS[level["reason"]] or ""),
        "level_slips": numbers(lambda level: level["outcome"]["farthest"]),
        "level_rotations": numbers(lambda level: level["rotation"]),
        "level_depths": numbers(lambda level: _depth(level["outcome"])),
        "closing_moved": nominal["closing_moved"] if nominal else np.nan,
        "closing_turned": nominal["closing_turned"] if nominal else np.nan,
        "closed_links": nominal["closed_links"] if nominal else None,
        "imbalance": nominal["imbalance"] if nominal else np.nan,
        "symmetric": nominal["imbalance"] < SYMMETRIC_IMBALANCE if nominal else None,
    }


def _columns_of_ways(sample: GraspSample) -> Columns:
    """Ways of approach to each grasp that are free, and the obstacles of the others: without a table, and on that of each
    resting pose."""
    grasps, driven = sample.grasps, sample.waypoints()["driven"][:, 0]
    is_closed = grasps["verdict"] != VERDICTS.index("penetrates")
    stages = grasps["object_in_way"]
    poses = range(grasps["clearances"].shape[1])
    free_on_table = np.array([sample.free_ways(pose) for pose in poses]).reshape(len(poses), len(grasps)).T

    def per_pose(texts: list[list[str]]) -> list[npt.NDArray[np.object_]]:
        return [np.array(row if closed else [], object) for row, closed in zip(texts, is_closed)]

    def obstacles(way: int, clearances: str) -> list[npt.NDArray[np.object_]]:
        rows = zip(stages[:, way], grasps[clearances])
        return per_pose([[_OBSTACLES[int(stage > 0)][int(lowest < 0)] for lowest in row] for stage, row in rows])

    return {
        "free_ways": sample.free_ways().tolist(),
        "object_in_way_posture": [PATH_STAGES[stage] for stage in stages[:, 0]],
        "object_in_way_opened": [PATH_STAGES[stage] for stage in stages[:, 1]],
        "pregrasp": [None if np.isnan(values).any() else values for values in driven],
        "free_ways_on_table": per_pose(free_on_table.tolist()),
        "obstacles_posture_on_table": obstacles(0, "clearances"),
        "obstacles_opened_on_table": obstacles(1, "clearances_opened"),
    }


def _outcome(trial: Message) -> Message:
    verdict, perturbed, table = trial["outcome"]["verdict"], trial["perturbed"], trial["table"]
    return {
        "trial": TRIAL_VERDICTS[verdict],
        "held": verdict == 0,
        "label": GRASP_LABELS[trial["label"]],
        "perturbed": len(perturbed),
        "perturbed_held": sum(run["outcome"]["verdict"] == 0 for run in perturbed),
        "roll_outs": trial["roll_outs"],
        "roll_outs_held": trial["roll_outs_held"],
        "robust": (verdict == 0 and not any(trial["variants"])) if len(trial["variants"]) else None,
        "table_pose": table and table["resting_pose"],
        "table_trial": table and TRIAL_VERDICTS[table["outcome"]["verdict"]],
        "held_on_table": table and table["outcome"]["verdict"] == 0,
    }

"""Do grasps still hold with other settings of a simulation? Replays in plain MuJoCo.

For each dataset of grasps with trials, held grasps spread evenly over it are exported (`graspmill export --to mujoco`) and
tried again by the export's own `replay.py`, with MuJoCo's own contacts: as exported, and with one change at a time. A row
has the number of them that hold, with the 95 % interval (Wilson), and how many of those that hold as exported. No row is made
with the contacts of graspmill.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco

# MuJoCo's default for this attribute.
DEFAULT_SOLREF = (0.02, 1.0)


@dataclass(frozen=True)
class Row:
    """One change of the conditions."""

    name: str
    change: Callable[[mujoco.MjModel], None] = lambda model: None
    is_free: bool = False
    finer: int = 1
    """Steps in the place of one."""


def solver(cone: mujoco.mjtCone, impratio: float, noslip: int) -> Callable[[mujoco.MjModel], None]:
    def change(model: mujoco.MjModel) -> None:
        model.opt.cone, model.opt.impratio, model.opt.noslip_iterations = cone, impratio, noslip

    return change


def of_object(attribute: str, value: Callable[[Any], Any]) -> Callable[[mujoco.MjModel], None]:
    """Changes a parameter of the object's contacts; the object's count, whatever touches it."""

    def change(model: mujoco.MjModel) -> None:
        values = getattr(model, f"flex_{attribute}")
        for flex in range(model.nflex):
            values[flex] = value(values[flex])

    return change


def heavier(model: mujoco.MjModel) -> None:
    body = model.body("object").id
    model.body_mass[body] *= 2.0
    model.body_inertia[body] *= 2.0
    mujoco.mj_setConst(model, mujoco.MjData(model))


def implicit(model: mujoco.MjModel) -> None:
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT


def slide(share: float) -> Callable[[Any], Any]:
    """Sliding and torsional friction by a share."""
    return lambda friction: friction * [share, share, 1.0]


PYRAMIDAL, ELLIPTIC = mujoco.mjtCone.mjCONE_PYRAMIDAL, mujoco.mjtCone.mjCONE_ELLIPTIC
ROWS = (
    Row("as exported"),
    Row("half the time step", finer=2),
    Row("integrator implicit", implicit),
    Row("condim 3 (no torsional friction)", of_object("condim", lambda _: 3)),
    Row("solref as by default", of_object("solref", lambda _: DEFAULT_SOLREF)),
    Row("friction -20 %", of_object("friction", slide(0.8))),
    Row("friction -40 %", of_object("friction", slide(0.6))),
    Row("mass x 2", heavier),
    Row("object free while it is closed on", is_free=True),
    Row("MuJoCo's defaults (pyramidal, impratio 1, no noslip)", solver(PYRAMIDAL, 1.0, 0)),
    Row("elliptic, impratio 1, no noslip", solver(ELLIPTIC, 1.0, 0)),
    Row("pyramidal, the rest as exported", lambda model: setattr(model.opt, "cone", PYRAMIDAL)),
)


def import_replay(folder: Path) -> ModuleType:
    """The export's program, as a module."""
    spec = importlib.util.spec_from_file_location("replay", folder / "replay.py")
    replay = importlib.util.module_from_spec(spec)
    sys.modules["replay"] = replay
    spec.loader.exec_module(replay)
    return replay


def finer_law(drive: dict, finer: int) -> dict:
    """The closing law counts steps: as many more of them are the same time."""
    law = dict(drive["law"])
    for name in ("steps_to_open", "steps_at_rest"):
        law[name] *= finer
    return {**drive, "law": law}


def label_of(grasp: dict) -> str:
    """The label of a grasp: its trials together; of datasets without labels, the trial in the air."""
    label = grasp["expected"].get("label")
    return label if label else grasp["expected"]["verdict"]


def chosen(folder: Path, count: int) -> dict[str, list[dict]]:
    """Grasps that are labelled held, evenly over the export, by object."""
    held = []
    for path in sorted(folder.glob("*/grasps.json")):
        grasps = json.loads(path.read_text())["grasps"]
        held += [(path.parent.name, grasp) for grasp in grasps if label_of(grasp) == "held"]
    count = min(count, len(held))
    by_object: dict[str, list[dict]] = {}
    for index in range(count):
        name, grasp = held[index * len(held) // count]
        by_object.setdefault(name, []).append(grasp)
    return by_object


def replayed(folder: Path, grasps: dict[str, list[dict]], rows: list[Row], seconds: float) -> list[list[bool]]:
    """Whether each grasp holds, by row; the grasps of as many objects as the processor time is enough for."""
    replay = import_replay(folder)
    drive = json.loads((folder / "drive.json").read_text())
    answers: list[list[bool]] = [[] for _ in rows]
    for number, (name, some) in enumerate(grasps.items()):
        if time.process_time() > seconds:
            print(f"{number} of {len(grasps)} objects were tried: the time is used up", file=sys.stderr)
            break
        gravity = json.loads((folder / name / "grasps.json").read_text())["gravity"]
        spec = mujoco.MjSpec.from_file(str(folder / name / "scene.xml"))
        for row, found in zip(rows, answers):
            model = spec.compile()
            model.opt.timestep /= row.finer
            row.change(model)
            law = finer_law(drive, row.finer)
            for grasp in some:
                trial = replay.Trial(model, law, gravity, grasp, row.is_free)
                verdict = trial.run()
                steady = not sum(warning.number for warning in trial.data.warning)
                found.append(verdict == "held" and steady)
        print(f"{number + 1} of {len(grasps)} objects, {time.process_time():.0f} s", file=sys.stderr, flush=True)
    return answers


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share."""
    if not count:
        return 0.0, 1.0
    z, share = 1.96, hits / count
    middle, spread = share + z * z / (2 * count), z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return (middle - spread) / (1 + z * z / count), (middle + spread) / (1 + z * z / count)


def table(hand: str, rows: list[Row], answers: list[list[bool]]) -> str:
    count = len(answers[0])
    lines = [f"\n{hand}: {count} grasps stored as held", f"{'conditions':<54}{'hold':>12}{'95 %':>18}{'of those as exported':>23}"]
    # Only where the first row is there are its grasps known.
    first = answers[0] if rows[0].name == ROWS[0].name else None
    for row, found in zip(rows, answers):
        low, high = wilson(sum(found), count)
        both = f"{sum(a and b for a, b in zip(first, found))} of {sum(first)}" if first else ""
        lines.append(f"{row.name:<54}{f'{sum(found)} of {count}':>12}{f'{low:.1%} to {high:.1%}':>18}{both:>23}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("datasets", nargs="+", type=Path, help="datasets of grasps with trials")
    parser.add_argument("--graspmill", type=Path, required=True)
    parser.add_argument("--grasps", type=int, default=200, help="held grasps per dataset")
    parser.add_argument("--rows", nargs="+", type=int, metavar="N", help="only these rows, from 1")
    parser.add_argument("--seconds", type=float, default=math.inf, help="processor time per dataset, about")
    arguments = parser.parse_args()
    rows = [ROWS[number - 1] for number in arguments.rows] if arguments.rows else list(ROWS)
    for dataset in arguments.datasets:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "replay"
            command = [arguments.graspmill.resolve(), "export", dataset, "--to", "mujoco", "--out", folder]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            hand = json.loads((folder / "drive.json").read_text())["hand"]
            spent = time.process_time()
            answers = replayed(folder, chosen(folder, arguments.grasps), rows, spent + arguments.seconds)
        print(table(hand, rows, answers), flush=True)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()

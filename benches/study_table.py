"""Tables of a study: `study_table.py FOLDER/rows` prints the mean overlap of each arm in each test as Markdown.

A mean is one over objects of the means of their samples, over all seeds, with its 95 % interval by bootstrap of objects.
With `--base ARM` the others are differences from that arm, paired by object. `--where` keeps rows alone: `thin=1`
(hollow or thin objects), `thin=0`, `hidden>0.3` (share of the silhouette that is hidden), `end_on>1` (longer along the
optical axis than across it). `--metric recognised` is the share of the samples that are recognised among other shapes whose seen cells
are the same: whose completion overlaps their own truth the most. `--seeds` prints the lowest and the highest mean of a seed, too.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from data_faults import interval

METRICS = ("iou", "iou_unseen", "iou_solid", "recognised")
"""Columns of the rows that study.py writes."""
Means = dict[tuple[str, str], dict[str, float]]
"""By arm and test, the mean of each object."""


def kept(row: dict[str, str], conditions: list[str]) -> bool:
    """Whether a row meets conditions such as `thin=1` or `hidden>0.3`."""
    for condition in conditions:
        found = re.fullmatch(r"(\w+)([=<>])([\d.]+)", condition)
        if found is None or found[1] not in row:
            raise SystemExit(f"--where {condition}: give a column, one of = < >, and a number, such as hidden>0.3")
        value, number = float(row[found[1]]), float(found[3])
        if not {"=": value == number, "<": value < number, ">": value > number}[found[2]]:
            return False
    return True


def read(folder: Path, metric: str, conditions: list[str]) -> dict[str, Means]:
    """Means by object of each seed, and of all seeds under the name `all`."""
    values: dict[str, dict[tuple[str, str], dict[str, list[float]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list))
    )
    for file in sorted(folder.glob("*.csv.gz")):
        with gzip.open(file, "rt", encoding="utf-8", newline="") as text:
            for row in csv.DictReader(text):
                if kept(row, conditions) and row[metric] != "nan":
                    for seed in ("all", row["seed"]):
                        values[seed][row["arm"], row["test"]][row["object"]].append(float(row[metric]))
    return {
        seed: {key: {name: float(np.mean(each)) for name, each in of.items()} for key, of in table.items()}
        for seed, table in values.items()
    }


def cell(means: Means, key: tuple[str, str], base: str | None) -> str:
    """A cell of the table: the mean with its interval, or the difference from the base arm."""
    if key not in means:
        return ""
    mine = means[key]
    if base is None or key[0] == base or (base, key[1]) not in means:
        each, sign = np.array(list(mine.values())), ""
    else:
        other = means[base, key[1]]
        each, sign = np.array([value - other[name] for name, value in mine.items()]), "+"
    low, high = interval(each)
    return f"{each.mean():{sign}.3f} [{low:{sign}.3f}, {high:{sign}.3f}]"


def table(found: dict[str, Means], base: str | None, seeds: bool) -> list[str]:
    means = found["all"]
    arms, tests = (list(dict.fromkeys(key[part] for key in means)) for part in range(2))
    arms.sort(key=lambda arm: (arm != base, arm))
    lines = ["| arm | seeds | " + " | ".join(tests) + " |", "| --- |" + " --- |" * (len(tests) + 1)]
    for arm in arms:
        of_arm = [seed for seed, each in found.items() if seed != "all" and any(key[0] == arm for key in each)]
        cells = [cell(means, (arm, test), base) for test in tests]
        if seeds:
            for place, test in enumerate(tests):
                each = [np.mean(list(found[seed][arm, test].values())) for seed in of_arm if (arm, test) in found[seed]]
                cells[place] += f"; {min(each):.3f} to {max(each):.3f}" if each else ""
        lines.append(f"| {arm} | {len(of_arm)} | " + " | ".join(cells) + " |")
    return lines


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("rows", type=Path, metavar="ROWS", help="the folder `rows` of study.py")
    arguments.add_argument("--metric", choices=METRICS, default="iou")
    arguments.add_argument("--base", help="the arm that the others are compared with")
    arguments.add_argument("--where", action="append", default=[], help="rows that count; may be given again")
    arguments.add_argument("--seeds", action="store_true", help="lowest and highest mean of a seed, too")
    options = arguments.parse_args()
    found = read(options.rows, options.metric, options.where)
    if not found:
        raise SystemExit(f"{options.rows}: no row is left by {' and '.join(options.where)}")
    print("\n".join(table(found, options.base, options.seeds)))


if __name__ == "__main__":
    main()

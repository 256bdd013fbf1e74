"""The law of a study of objects and views: `study_law.py FOLDER/rows --all 484 --picture law.png` (figure 5.4 of the thesis).

Arms are called NETWORK-OBJECTSxVIEWS, `--all` gives the number for `all`. What a network lacks of other objects, one minus its
overlap, is fitted as a power of the count of objects, c (objects/100)^-a, for each count of views, by least squares of logarithms. Intervals
are of 95 % by bootstrap of the objects that the networks are tested on. Prints a line for each network and count of views; draws mean
overlaps by count of objects, other objects beside training views.
"""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from study_table import METRICS, read

DRAWS = 2000
Line = dict[int, np.ndarray]
"""By count of training objects, the mean overlap of each test object."""
Lines = dict[tuple[str, int], Line]
"""By network and views of each training object."""


def lines_of(found: dict[tuple[str, str], dict[str, float]], tests: list[str], every: int) -> Lines:
    """The overlaps of each arm in its test; of several tests, in the one that its views belong to (`training views of 10`)."""
    lines: Lines = defaultdict(dict)
    for (arm, test), means in found.items():
        name = re.fullmatch(r"(\w+)-(\d+|all)x(\d+)", arm)
        if name is None:
            raise SystemExit(f"an arm is called {arm}, not NETWORK-OBJECTSxVIEWS")
        if test in tests and (len(tests) == 1 or test.endswith(f" {name[3]}")):
            objects = every if name[2] == "all" else int(name[2])
            lines[name[1], int(name[3])][objects] = np.array([means[each] for each in sorted(means)])
    return lines


def fit(line: Line, tested: np.ndarray) -> np.ndarray:
    """c and a, of these of the test objects."""
    lacks = np.log([1 - means[tested].mean() for means in line.values()])
    slope, start = np.polyfit(np.log(np.array(list(line)) / 100), lacks, 1)
    return np.array([np.exp(start), -slope])


@dataclass(frozen=True)
class Law:
    """The law of a network and a count of views."""

    constant: float
    exponent: float
    intervals: np.ndarray
    """(2, 2): lower and upper ends of both."""
    line: Line
    """The overlaps that it was fitted to."""

    def farthest(self) -> float:
        """The law's largest error over the counts of objects, as an overlap."""
        return float(max(abs(means.mean() - self.overlap(objects)) for objects, means in self.line.items()))

    def overlap(self, objects: float) -> float:
        return float(1 - self.constant * (objects / 100) ** -self.exponent)

    @classmethod
    def of(cls, line: Line) -> Law:
        tested = len(next(iter(line.values())))
        rng = np.random.default_rng(0)
        drawn = np.array([fit(line, rng.integers(tested, size=tested)) for _ in range(DRAWS)])
        constant, exponent = fit(line, np.arange(tested))
        return cls(constant, exponent, np.quantile(drawn, [0.025, 0.975], axis=0), line)

    def __str__(self) -> str:
        (c_low, a_low), (c_high, a_high) = self.intervals
        said = f"c {self.constant:.3f} [{c_low:.3f}, {c_high:.3f}], a {self.exponent:.3f} [{a_low:.3f}, {a_high:.3f}]"
        return f"{said}; an overlap lies {self.farthest():.3f} from it at most"


def draw(path: Path, tests: dict[str, Lines], laws: dict[tuple[str, int], Law]) -> None:
    """A panel per network: overlap by count of objects, a line per count of views."""
    from matplotlib import pyplot

    networks = sorted({network for network, _ in laws})
    views = sorted({each for _, each in laws})
    shades = dict(zip(views, np.linspace(0.7, 0.0, len(views))))
    figure, axes = pyplot.subplots(1, len(networks), figsize=(4.6 * len(networks), 3.8), sharey=True, squeeze=False)
    for axis, network in zip(axes[0], networks):
        for (said, lines), mark, style in zip(tests.items(), "ox", ("none", "dotted")):
            for (of, count), line in sorted(lines.items()):
                if of == network:
                    means = [line[objects].mean() for objects in sorted(line)]
                    look = {"marker": mark, "linestyle": style, "color": str(shades[count])}
                    axis.plot(sorted(line), means, label=f"{said}, {count} views", **look)
        for (of, count), law in laws.items():
            if of == network:
                many = np.geomspace(10, 600)
                axis.plot(many, [law.overlap(each) for each in many], color=str(shades[count]))
        objects = sorted({each for line in next(iter(tests.values())).values() for each in line})
        axis.set(xscale="log", xlabel="training objects", title=network)
        axis.set_xticks(objects, [str(each) for each in objects])
        axis.minorticks_off()
    axes[0][0].set_ylabel("overlap of occupied cells (IoU)")
    axes[0][0].legend(fontsize=6.5, loc="lower right")
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("rows", type=Path, metavar="ROWS", help="the folder `rows` of study.py")
    arguments.add_argument("--all", type=int, required=True, help="count of objects of the arms of all objects")
    arguments.add_argument("--test", default="holdout objects", help="what the law is fitted to")
    arguments.add_argument("--metric", choices=METRICS, default="iou")
    arguments.add_argument("--picture", type=Path, help="file for the picture")
    options = arguments.parse_args()
    found = read(options.rows, options.metric, [])["all"]
    other = lines_of(found, [options.test], options.all)
    laws = {key: Law.of(line) for key, line in sorted(other.items()) if len(line) > 1}
    for (network, views), law in laws.items():
        print(f"{network}, {views} views: {law}")
    if options.picture:
        seen = [test for test in dict.fromkeys(key[1] for key in found) if test.startswith("training views")]
        draw(options.picture, {"other objects": other, "training views": lines_of(found, seen, options.all)}, laws)


if __name__ == "__main__":
    main()

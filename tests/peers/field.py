"""Distance fields by scipy and scikit-fmm for the label sets that tests/field.rs leaves in a folder.

A case NAME is NAME.labels (u8, 1 = inside, C order); cases.json lists {name, shape, steps, periodic}, steps in the metric.
Each command writes NAME.peer (f64, C order). field.py centres DIR | thesis DIR
"""

import json
import sys
from pathlib import Path

import numpy as np


def centres(inside, case):
    """Distance to the nearest centre of the other label, unsigned: periodic axes are laid out three times."""
    from scipy.ndimage import distance_transform_edt

    tiled = np.tile(inside, [3 if periodic else 1 for periodic in case["periodic"]])
    middle = tuple(slice(n, 2 * n) if p else slice(None) for n, p in zip(case["shape"], case["periodic"]))
    out, into = (distance_transform_edt(labels, sampling=case["steps"])[middle] for labels in (tiled, ~tiled))
    return np.where(inside, out, into)


def thesis(inside, case):
    import skfmm

    return skfmm.distance(0.5 - inside, dx=1.0, order=2, periodic=case["periodic"])


def main(command, folder):
    folder = Path(folder)
    for case in json.loads((folder / "cases.json").read_text()):
        labels = np.fromfile(folder / f"{case['name']}.labels", "u1").reshape(case["shape"])
        answer = {"centres": centres, "thesis": thesis}[command](labels > 0, case)
        np.ascontiguousarray(answer, "<f8").tofile(folder / f"{case['name']}.peer")


main(*sys.argv[1:])

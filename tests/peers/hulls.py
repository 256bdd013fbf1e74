"""Epsilon and volume of hulls by qhull (scipy), for wrench sets that a test leaves in a file.

hulls.py COUNTS WRENCHES: how many wrenches each set has (u64), and all of them (f64, six each: force, torque). Prints a line
a set: epsilon and volume of the forces, of the wrenches; 0 for what qhull calls flat.
"""

import sys

import numpy as np
from scipy.spatial import ConvexHull, QhullError


def hull(points):
    try:
        found = ConvexHull(points)
    except QhullError:
        return 0.0, 0.0
    return max(0.0, -found.equations[:, -1].max()), found.volume


counts = np.fromfile(sys.argv[1], "<u8").astype(int)
wrenches = np.fromfile(sys.argv[2], "<f8").reshape(-1, 6)
for points in np.split(wrenches, np.cumsum(counts)[:-1]):
    print(*hull(points[:, :3]), *hull(points))

"""Ranges of the facts that are numbers, both ends included; `make schemas` writes them from the table of products."""

from __future__ import annotations

from math import inf
from sys import float_info

FINITE = (-float_info.max, float_info.max)
"""The range of any other fact."""

FACT_RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "completion": {
        "solid_share": (0.0, 1.0),
        "hidden_share": (0.0, 1.0),
    },
    "grasps": {
        "best_energy": (-float_info.max, inf),
        "best_epsilon": (0.0, float_info.max),
    },
    "scenes": {
        "rest_time": (0.0, float_info.max),
        "top_speed": (0.0, float_info.max),
        "depth_bodies": (0.0, float_info.max),
        "depth_container": (0.0, float_info.max),
        "drift": (0.0, float_info.max),
        "turn": (0.0, float_info.max),
    },
    "views": {
        "nearest": (0.0, float_info.max),
    },
    "amodal": {
        "solid_share": (0.0, 1.0),
        "visible_share": (0.0, 1.0),
        "purity": (0.0, 1.0),
    },
}

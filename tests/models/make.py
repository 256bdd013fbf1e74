#!/usr/bin/env python3
"""Writes the model that tests run, tests/models/thicken: a small network whose answer is known beforehand.

    .deps/torch/bin/python tests/models/make.py

Nothing is learned. A convolution along the optical axis fills twelve cells behind each seen cell, unless the camera sees through
them; a branch with random weights, shaped like the network `block`, adds a little, so that every operator of such networks
runs. Inputs and answers in golden.npz are those of ONNX Runtime. Needs numpy, onnx and onnxruntime.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

FOLDER = Path(__file__).resolve().parent / "thicken"
N = 40
SIDE = N // 4
BEHIND = 12
NAMES = ("partial", "free")


def network():
    """The graph and its weights."""
    random = np.random.RandomState(7)
    nodes, weights = [], []

    def constant(name, value):
        weights.append(numpy_helper.from_array(value, name))
        return name

    def add(operator, inputs, output, **attributes):
        nodes.append(helper.make_node(operator, inputs, [output], name=output, **attributes))
        return output

    def convolution(source, name, out, into, kernel, operator="Conv", **attributes):
        shape = (into, out, kernel, kernel, kernel) if operator == "ConvTranspose" else (out, into, kernel, kernel, kernel)
        weight = constant(f"{name}.weight", (random.randn(*shape) * (2.0 / (into * kernel**3)) ** 0.5).astype(np.float32))
        bias = constant(f"{name}.bias", (0.1 * random.randn(out)).astype(np.float32))
        return add(operator, [source, weight, bias], name, kernel_shape=[kernel] * 3, **attributes)

    both = add("Concat", list(NAMES), "both", axis=1)
    # Fill behind what is seen: one output per network output.
    axis = np.zeros((2, 2, 3, 3, BEHIND + 1), np.float32)
    axis[:, 0] = 2.0
    axis[:, 0, 1, 1] = 24.0
    axis[0, 1, 1, 1, BEHIND] = -60.0
    axis[1, 1, 1, 1, BEHIND] = -64.0
    behind = constant("behind.weight", axis)
    offset = constant("behind.bias", np.array([-9.0, -11.0], np.float32))
    # Pads: x, y, z before, then after. The kernel ends at the cell itself.
    filled = add("Conv", [both, behind, offset], "behind", kernel_shape=[3, 3, BEHIND + 1], pads=[1, 1, BEHIND, 1, 1, 0])

    # The branch: blocks of 4^3 cells become channels.
    split = constant("split", np.array([-1, 2, SIDE, 4, SIDE, 4, SIDE, 4], np.int64))
    joined = constant("joined", np.array([-1, 2 * 64, SIDE, SIDE, SIDE], np.int64))
    blocks = add("Reshape", [both, split], "blocks.split")
    blocks = add("Transpose", [blocks], "blocks.order", perm=[0, 1, 3, 5, 7, 2, 4, 6])
    blocks = add("Reshape", [blocks, joined], "blocks")
    narrow = add("Relu", [convolution(blocks, "narrow.conv", 4, 128, 1)], "narrow")
    skip = add("Relu", [convolution(narrow, "skip.conv", 4, 4, 3, pads=[1] * 6)], "skip")
    down = add("Relu", [convolution(skip, "down.conv", 8, 4, 3, strides=[2] * 3, pads=[1] * 6)], "down")
    flat = add("Flatten", [down], "flat", axis=1)
    few = constant("few.weight", (0.03 * random.randn(8, 1000)).astype(np.float32))
    few = add("Relu", [add("Gemm", [flat, few, constant("few.bias", np.zeros(8, np.float32))], "few.gemm", transB=1)], "few")
    many = constant("many.weight", (0.3 * random.randn(1000, 8)).astype(np.float32))
    many = add("Gemm", [few, many, constant("many.bias", np.zeros(1000, np.float32))], "many.gemm", transB=1)
    many = add("Reshape", [many, constant("cube", np.array([-1, 8, 5, 5, 5], np.int64))], "many")
    added = add("Add", [down, many], "added")
    up = add("Relu", [convolution(added, "up.conv", 4, 8, 2, "ConvTranspose", strides=[2] * 3)], "up")
    both_scales = add("Concat", [up, skip], "scales", axis=1)
    wide = convolution(both_scales, "wide", 128, 8, 1)
    cells = add("Reshape", [wide, constant("cells.split", np.array([-1, 2, 4, 4, 4, SIDE, SIDE, SIDE], np.int64))], "cells.split_")
    cells = add("Transpose", [cells], "cells.order", perm=[0, 1, 5, 2, 6, 3, 7, 4])
    cells = add("Reshape", [cells, constant("grid", np.array([-1, 2, N, N, N], np.int64))], "cells")

    small = add("Mul", [cells, constant("share", np.array(0.3, np.float32))], "small")
    total = add("Add", [filled, small], "total")
    # Most cells are certain, which keeps golden.npz small.
    low, high = constant("low", np.array(-6.0, np.float32)), constant("high", np.array(6.0, np.float32))
    logits = add("Clip", [total, low, high], "logits")
    halves = constant("halves", np.array([1, 1], np.int64))
    nodes.append(helper.make_node("Split", [logits, halves], ["logits.occupancy", "logits.coverage"], name="halve", axis=1))
    add("Sigmoid", ["logits.occupancy"], "occupancy")
    add("Sigmoid", ["logits.coverage"], "coverage")

    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", 1, N, N, N]) for name in (*NAMES, "occupancy", "coverage")]
    graph = helper.make_graph(nodes, "thicken", ends[:2], ends[2:], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], producer_name="tests/models/make.py")
    model.ir_version = 9
    onnx.checker.check_model(model, full_check=True)
    return model


def samples():
    """A ball and a box seen from the front: cells with a seen point, and cells that the camera sees through."""
    x, y, z = np.meshgrid(*[np.arange(N) + 0.5 - N / 2] * 3, indexing="ij")
    solids = np.stack([x**2 + y**2 + (z - 4) ** 2 < 14**2, (abs(x) < 9) & (abs(y - 2) < 12) & (abs(z - 3 + 0.3 * x) < 8)])
    first = np.cumsum(solids, axis=3)
    partial = solids & (first == 1)
    free = (first == 0).astype(bool)
    return [grid.astype(np.float32)[:, None] for grid in (partial, free)]


def main():
    FOLDER.mkdir(exist_ok=True)
    model = network()
    onnx.save(model, FOLDER / "model.onnx")
    inputs = dict(zip(NAMES, samples()))
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    outputs = dict(zip(("occupancy", "coverage"), session.run(["occupancy", "coverage"], inputs)))
    np.savez_compressed(FOLDER / "golden.npz", **inputs, **outputs)
    (FOLDER / "card.md").write_text(
        "# thicken\n\nA network for tests, made by tests/models/make.py: nothing was learned, and it completes nothing well.\n"
    )
    names = ("model.onnx", "golden.npz", "card.md")
    facts = {
        "format": "graspmill model 1",
        "network": "thicken",
        "inputs": list(NAMES),
        "outputs": ["occupancy", "coverage"],
        "resolution": N,
        "placement": {"fill": 0.8, "anchor": [0.5, 0.5, 0.45]},
        "thresholds": {"occupancy": 0.5, "coverage": 0.5},
        "seed": 7,
        "steps": 0,
        "data": [],
        "split": "none: nothing was learned",
        "versions": {"onnx": onnx.__version__, "onnxruntime": onnxruntime.__version__},
        "scores": {},
        "files": {name: hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() for name in names},
    }
    (FOLDER / "model.json").write_text(json.dumps(facts, indent=2) + "\n")


if __name__ == "__main__":
    main()

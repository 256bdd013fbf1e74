"""Writes random networks, one operator with random attributes in each, and what ONNX Runtime answers: a model's folder per network.

    networks.py OUT COUNT SEED

Each network takes a crop of `partial`, applies the operator, and adds a weighted sum of all that comes out to `free`: any number that
differs shows in `occupancy`. Needs numpy, onnx and onnxruntime.
"""

import hashlib
import io
import json
import random
import sys
from pathlib import Path
from typing import Any, Callable

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

N = 40
MODEL = Path(__file__).resolve().parents[1] / "models" / "thicken" / "model.json"

Shape = list[int]


class Network:
    """A network that grows node by node."""

    def __init__(self, seed: int) -> None:
        self.draw = random.Random(seed)
        self.numbers = np.random.RandomState(seed)
        self.nodes: list[Any] = []
        self.weights: list[Any] = []

    def pick(self, *values: Any) -> Any:
        return self.draw.choice(values)

    def constant(self, values: Any, kind: Any = np.float32) -> str:
        name = f"c{len(self.weights)}"
        self.weights.append(numpy_helper.from_array(np.asarray(values, kind), name))
        return name

    def whole(self, values: Any) -> str:
        return self.constant(values, np.int64)

    def normal(self, *shape: int) -> str:
        return self.constant(self.numbers.randn(*shape))

    def node(self, operator: str, inputs: list[str], outputs: int = 1, **attributes: Any) -> Any:
        names = [f"t{len(self.nodes)}.{index}" for index in range(outputs)]
        self.nodes.append(helper.make_node(operator, inputs, names, name=names[0], **attributes))
        return names[0] if outputs == 1 else names

    def crop(self, rank: int = 5, channels: int | None = None, sides: tuple[int, int] = (4, 9)) -> tuple[str, Shape]:
        """A part of `partial` with some channels."""
        space = [self.draw.randint(*sides) for _ in range(3)]
        begins = [self.draw.randint(0, N - side) for side in space]
        ends = [begin + side for begin, side in zip(begins, space)]
        part = self.node("Slice", ["partial", self.whole(begins), self.whole(ends), self.whole([2, 3, 4])])
        count = channels or self.draw.randint(1, 5)
        part = self.node("Conv", [part, self.normal(count, 1, 1, 1, 1), self.normal(count)])
        a, b, c = space
        shape = {5: [1, count, a, b, c], 4: [1, count, a, b * c], 3: [1, count, a * b * c], 2: [count, a * b * c]}[rank]
        return (part if rank == 5 else self.node("Reshape", [part, self.whole(shape)])), shape

    def model(self, inputs: list[str], outputs: list[tuple[str, Any]]) -> Any:
        ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 1, N, N, N]) for name in inputs]
        results = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in outputs]
        graph = helper.make_graph(self.nodes, "random", ends, results, self.weights)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
        model.ir_version = 9
        return model

    def finish(self, outputs: list[str]) -> Any:
        """The network with `occupancy`."""
        whole = self.model(["partial", "free"], [(name, None) for name in outputs])
        sizes = [found.size for found in run(whole, grids(self.numbers))]
        total = None
        for name, size in zip(outputs, sizes):
            row = self.node("Flatten", [name], axis=0)
            weights = self.constant(self.numbers.randn(size, 1) / size**0.5)
            share = self.node("Reshape", [self.node("MatMul", [row, weights]), self.whole([1, 1, 1, 1, 1])])
            total = share if total is None else self.node("Add", [total, share])
        small = self.node("Mul", ["free", self.constant(0.1)])
        self.nodes.append(helper.make_node("Sigmoid", [self.node("Add", [small, total])], ["occupancy"]))
        return self.model(["partial", "free"], [("occupancy", [1, 1, N, N, N])])


def grids(numbers: Any) -> dict[str, Any]:
    return {name: numbers.rand(1, 1, N, N, N).astype(np.float32) for name in ("partial", "free")}


def run(model: Any, inputs: dict[str, Any]) -> list[Any]:
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads, settings.log_severity_level = 1, 4
    session = onnxruntime.InferenceSession(model.SerializeToString(), settings, providers=["CPUExecutionProvider"])
    names = [end.name for end in session.get_inputs()]
    return list(session.run(None, {name: inputs[name] for name in names}))


def window(net: Network, axes: int, pools: bool) -> dict[str, Any]:
    """Kernel and attributes of a window over these axes."""
    found: dict[str, Any] = {"kernel": [net.draw.randint(1, 3) for _ in range(axes)]}
    if net.pick(0, 1):
        found["strides"] = [net.draw.randint(1, 3) for _ in range(axes)]
    padding = net.pick("none", "pads", "same")
    if net.pick(0, 1) and not pools and padding != "same":
        found["dilations"] = [net.draw.randint(1, 2) for _ in range(axes)]
    extents = [(k - 1) * d + 1 for k, d in zip(found["kernel"], found.get("dilations", [1] * axes))]
    if padding == "pads":
        found["pads"] = [net.draw.randint(0, extent - 1) for extent in extents * 2]
    if padding == "same":
        found["auto_pad"] = net.pick("SAME_UPPER", "SAME_LOWER", "VALID", "NOTSET")
    return found


def function(net: Network) -> Any:
    x, _ = net.crop(net.pick(2, 3, 4, 5))
    names = ("Abs", "Elu", "Erf", "Exp", "HardSigmoid", "LeakyRelu", "Neg", "Relu", "Sigmoid", "Softplus", "Sqrt", "Tanh")
    name, attributes = net.pick(*names), {}
    if name in ("Elu", "LeakyRelu", "HardSigmoid") and net.pick(0, 1):
        attributes["alpha"] = net.draw.uniform(-1, 2)
    return net.node(name, [net.node("Abs", [x]) if name == "Sqrt" else x], **attributes)


def arithmetic(net: Network) -> Any:
    x, shape = net.crop()
    name = net.pick("Add", "Sub", "Mul", "Div", "PRelu", "Max", "Min", "Sum")
    sides = [side if net.pick(0, 1, 1) else 1 for side in shape][net.draw.randint(0, 4) :]
    other = net.constant(net.numbers.rand(*sides) + 0.5)
    if name in ("Max", "Min", "Sum"):
        return net.node(name, [x, other, x][: net.draw.randint(1, 3)])
    return net.node(name, [x, other] if name in ("Div", "PRelu") or net.pick(0, 1) else [other, x])


def clip(net: Network) -> Any:
    bounds = net.pick([], [net.constant(-0.3)], ["", net.constant(0.4)], [net.constant(-0.2), net.constant(0.2)])
    return net.node("Clip", [net.crop()[0], *bounds])


def normalisation(net: Network) -> Any:
    x, shape = net.crop(net.pick(3, 4, 5))
    name = net.pick("BatchNormalization", "InstanceNormalization")
    count = 4 if name == "BatchNormalization" else 2
    numbers = [net.constant(net.numbers.rand(shape[1]) + 0.1) for _ in range(count)]
    return net.node(name, [x, *numbers], epsilon=net.pick(1e-5, 0.1))


def softmax(net: Network) -> Any:
    x, shape = net.crop(net.pick(2, 3, 4, 5))
    return net.node("Softmax", [x], axis=net.draw.randint(-len(shape), len(shape) - 1))


def concat(net: Network) -> Any:
    x, shape = net.crop()
    axis = net.draw.randint(0, 4)
    other = net.normal(*shape[:axis], net.draw.randint(1, 4), *shape[axis + 1 :])
    return net.node("Concat", net.pick([x, other, x], [other, x], [x, other]), axis=net.pick(axis, axis - 5))


def split(net: Network) -> Any:
    x, shape = net.crop()
    axis = net.draw.randint(2, 4)
    if net.pick(0, 1):
        first = net.draw.randint(1, shape[axis] - 1)
        return net.node("Split", [x, net.whole([first, shape[axis] - first])], 2, axis=axis)
    return net.node("Split", [x], 2, axis=axis, num_outputs=2)


def cut(net: Network) -> Any:
    x, shape = net.crop()
    axes = net.draw.sample(range(2, 5), net.draw.randint(1, 3))
    begins = [net.draw.randint(0, shape[axis] - 1) for axis in axes]
    ends = [net.draw.randint(begin + 1, shape[axis]) for begin, axis in zip(begins, axes)]
    far = [net.pick(end, 2**31, 2**62) if end == shape[axis] else end for end, axis in zip(ends, axes)]
    steps = [net.whole([net.draw.randint(1, 3) for _ in axes])] if net.pick(0, 1) else []
    from_end = [begin - shape[axis] if net.pick(0, 1) else begin for begin, axis in zip(begins, axes)]
    numbers = [net.pick(axis, axis - 5) for axis in axes]
    return net.node("Slice", [x, net.whole(from_end), net.whole(far), net.whole(numbers), *steps])


def gather(net: Network) -> Any:
    x, shape = net.crop()
    axis = net.draw.randint(0, 4)
    index = lambda: net.draw.randint(-shape[axis], shape[axis] - 1)  # noqa: E731
    places = index() if net.pick(0, 0, 1) else [index() for _ in range(net.draw.randint(1, 5))]
    return net.node("Gather", [x, net.whole(places)], axis=net.pick(axis, axis - 5))


def transpose(net: Network) -> Any:
    x, shape = net.crop(net.pick(2, 3, 4, 5))
    order = net.draw.sample(range(len(shape)), len(shape))
    return net.node("Transpose", [x], **net.pick({}, {"perm": order}))


def reshape(net: Network) -> Any:
    x, shape = net.crop()
    way = net.draw.randint(0, 4)
    if way == 0:
        return net.node("Reshape", [x, net.whole(net.pick([0, -1], [shape[4], -1, shape[1]]))])
    if way == 1:
        return net.node("Flatten", [x], axis=net.draw.randint(-4, 5))
    if way == 2:
        return net.node("Unsqueeze", [x, net.whole(net.pick([0], [-1], [0, 2], [6, 1], [3]))])
    return net.node("Squeeze", [x, net.whole([0])] if way == 3 else [x])


def shapes(net: Network) -> Any:
    """As exporters compute shapes."""
    x, _ = net.crop()
    whole = net.node("Shape", [x])
    one = net.node("Unsqueeze", [net.node("Gather", [whole, net.whole(1)], axis=0), net.whole([0])])
    same = net.node("Mul", [net.node("Add", [one, net.whole([1])]), net.whole([2])])
    same = net.node("Sub", [net.node("Div", [same, net.whole([2])]), net.whole([1])])
    rest = net.pick(net.node("Shape", [x], start=2), net.node("Slice", [whole, net.whole([2]), net.whole([5])]))
    target = net.node("Concat", [same, rest, net.whole([1])], axis=0)
    moved = net.node("Reshape", [x, net.node("Cast", [target], to=TensorProto.INT64)])
    return net.node("Add", [moved, net.node("Cast", [one], to=TensorProto.FLOAT)])


def pad(net: Network) -> Any:
    x, _ = net.crop()
    if net.pick(0, 1):
        return net.node("Pad", [x, net.whole([1, 2, 3, 1]), "", net.whole(net.pick([2, 4], [-1, -2]))], mode=net.pick("edge", "reflect"))
    pads = [0, 0, *(net.draw.randint(0, 3) for _ in range(3))] * 2
    return net.node("Pad", [x, net.whole(pads), net.constant(0.7)], mode="constant")


def convolution(net: Network) -> Any:
    groups = net.pick(1, 1, 2, 4)
    channels = groups * net.draw.randint(1, 2)
    x, shape = net.crop(net.pick(3, 4, 5), channels)
    found = window(net, len(shape) - 2, False)
    kernel, out = found.pop("kernel"), groups * net.draw.randint(1, 9)
    bias = [net.normal(out)] if net.pick(0, 1) else []
    return net.node("Conv", [x, net.normal(out, channels // groups, *kernel), *bias], group=groups, **found)


def transposed(net: Network) -> Any:
    groups = net.pick(1, 1, 2, 4)
    channels = groups * net.draw.randint(1, 2)
    x, shape = net.crop(net.pick(3, 4, 5), channels, (3, 6))
    found = window(net, len(shape) - 2, False)
    found.pop("auto_pad", None)
    kernel, out = found.pop("kernel"), net.draw.randint(1, 4)
    if net.pick(0, 1) and "strides" in found:
        found["output_padding"] = [net.draw.randint(0, stride - 1) for stride in found["strides"]]
    bias = [net.normal(out * groups)] if net.pick(0, 1) else []
    return net.node("ConvTranspose", [x, net.normal(channels, out, *kernel), *bias], group=groups, **found)


def pool(net: Network) -> Any:
    x, shape = net.crop(net.pick(3, 4, 5))
    name = net.pick("MaxPool", "AveragePool")
    found = window(net, len(shape) - 2, True)
    kernel = found.pop("kernel")
    if name == "MaxPool" and not {"pads", "auto_pad"} & set(found):
        found["dilations"] = [net.draw.randint(1, 2) for _ in kernel]
    if name == "AveragePool":
        found["count_include_pad"] = net.pick(0, 1)
    return net.node(name, [x], kernel_shape=kernel, **found)


def global_pool(net: Network) -> Any:
    return net.node(net.pick("GlobalAveragePool", "GlobalMaxPool"), [net.crop(net.pick(3, 4, 5))[0]])


def gemm(net: Network) -> Any:
    x, shape = net.crop(2)
    of_a, of_b, n = net.pick(0, 1), net.pick(0, 1), net.draw.randint(1, 20)
    m, k = reversed(shape) if of_a else shape
    weights = net.constant(net.numbers.randn(*((n, k) if of_b else (k, n))) / k**0.5)
    more = net.pick([], [net.normal(n)], [net.normal(1, n)], [net.normal(m, 1)], [net.normal(m, n)])
    return net.node("Gemm", [x, weights, *more], transA=of_a, transB=of_b, alpha=net.pick(1.0, 0.7), beta=net.pick(1.0, 1.3))


def product(net: Network) -> Any:
    x, shape = net.crop(net.pick(2, 3, 4, 5))
    k, n, way = shape[-1], net.draw.randint(1, 12), net.draw.randint(0, 3)
    if way == 0:
        return net.node("MatMul", [net.constant(net.numbers.randn(n, shape[-2]) / shape[-2] ** 0.5), x])
    if way == 1:
        order = [*range(len(shape) - 2), len(shape) - 1, len(shape) - 2]
        return net.node("MatMul", [x, net.node("Transpose", [x], perm=order)])
    before = [side if net.pick(0, 1) else 1 for side in shape[:-2]] if way == 2 else []
    return net.node("MatMul", [x, net.constant(net.numbers.randn(*before, k, n) / k**0.5)])


def reduction(net: Network) -> Any:
    x, shape = net.crop(net.pick(2, 3, 4, 5))
    axes = net.draw.sample(range(len(shape)), net.draw.randint(1, len(shape)))
    given = [net.whole([net.pick(axis, axis - len(shape)) for axis in axes])] if net.pick(0, 1, 1) else []
    keeps = net.pick(0, 1) if given and len(axes) < len(shape) else 1
    return net.node(net.pick("ReduceMax", "ReduceMean", "ReduceSum"), [x, *given], keepdims=keeps)


def resize(net: Network) -> Any:
    x, shape = net.crop(5, None, (3, 6))
    places = net.pick("half_pixel", "pytorch_half_pixel", "align_corners", "asymmetric")
    found = {"mode": net.pick("nearest", "linear"), "coordinate_transformation_mode": places}
    if found["mode"] == "nearest":
        found["nearest_mode"] = net.pick("round_prefer_floor", "round_prefer_ceil", "floor", "ceil")
    if net.pick(0, 1):
        return net.node("Resize", [x, "", net.constant([1, 1, *(net.pick(0.5, 1, 1.5, 2, 3) for _ in range(3))])], **found)
    sizes = [*shape[:2], *(net.draw.randint(1, 12) for _ in range(3))]
    return net.node("Resize", [x, "", "", net.whole(sizes)], **found)


KINDS: list[Callable[[Network], Any]] = [
    *(function, arithmetic, clip, normalisation, softmax, concat, split, cut, gather, transpose, reshape, shapes, pad),
    *(convolution, transposed, pool, global_pool, gemm, product, reduction, resize),
]


def write(folder: Path, model: Any, golden: dict[str, Any]) -> None:
    folder.mkdir(parents=True)
    packed = io.BytesIO()
    np.savez_compressed(packed, **golden)
    files = {"model.onnx": model.SerializeToString(), "golden.npz": packed.getvalue(), "card.md": b"random"}
    facts = json.loads(MODEL.read_text())
    facts["outputs"] = ["occupancy"]
    facts["files"] = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (folder / "model.json").write_text(json.dumps(facts))


def main() -> None:
    out, count, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    made = 0
    for number in range(10 * count):
        if made == count:
            break
        kind = KINDS[number % len(KINDS)]
        net = Network(1_000_003 * seed + number)
        try:
            found = kind(net)
            model = net.finish(found if isinstance(found, list) else [found])
            inputs = grids(net.numbers)
            (occupancy,) = run(model, inputs)
        except Exception as error:  # Windows that do not fit, and what ONNX Runtime does not run.
            print(f"skipped {kind.__name__}: {error}", file=sys.stderr)
            continue
        write(out / f"{made:04}-{kind.__name__}", model, {**inputs, "occupancy": occupancy})
        made += 1


if __name__ == "__main__":
    main()

"""Networks that complete grids. Each gives logits.

Only plain convolutions and matrix products, so that every engine that reads ONNX runs them.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import nn

RESOLUTION = 40
"""Cells along each axis of the grids."""
BLOCK = 4
"""Cells along each side of a block that the network `block` reads and writes at once."""
EMPTY = -2.0
"""First bias of the last layer: most cells are empty, which the first batches need not learn."""


def to_blocks(grids: torch.Tensor) -> torch.Tensor:
    """(batch, c, n, n, n) as (batch, 64 c, n/4, n/4, n/4): the cells of each block as channels."""
    channels, side = grids.shape[1], grids.shape[2] // BLOCK
    split = grids.reshape(-1, channels, side, BLOCK, side, BLOCK, side, BLOCK)
    return split.permute(0, 1, 3, 5, 7, 2, 4, 6).reshape(-1, channels * BLOCK**3, side, side, side)


def from_blocks(blocks: torch.Tensor) -> torch.Tensor:
    """The inverse of `to_blocks`."""
    channels, side = blocks.shape[1] // BLOCK**3, blocks.shape[2]
    split = blocks.reshape(-1, channels, BLOCK, BLOCK, BLOCK, side, side, side)
    n = side * BLOCK
    return split.permute(0, 1, 5, 2, 6, 3, 7, 4).reshape(-1, channels, n, n, n)


class Block(nn.Module):
    """The default: blocks of 4^3 cells as channels of a grid of 10^3, then 5^3, a dense middle, and back."""

    def __init__(self, inputs: int, outputs: int, fine: int = 32, coarse: int = 64, middle: int = 256) -> None:
        super().__init__()
        cells = coarse * (RESOLUTION // BLOCK // 2) ** 3
        self.enter = nn.Conv3d(inputs * BLOCK**3, fine, 1)
        self.look = nn.Conv3d(fine, fine, 3, padding=1)
        self.down = nn.Conv3d(fine, coarse, 2, stride=2)
        self.look_far = nn.Conv3d(coarse, coarse, 3, padding=1)
        self.gather = nn.Linear(cells, middle)
        self.spread = nn.Linear(middle, cells)
        self.up = nn.ConvTranspose3d(coarse, fine, 2, stride=2)
        self.join = nn.Conv3d(2 * fine, fine, 3, padding=1)
        self.leave = nn.Conv3d(fine, outputs * BLOCK**3, 1)
        nn.init.constant_(self.leave.bias, EMPTY)  # type: ignore[arg-type]

    def forward(self, grids: torch.Tensor) -> torch.Tensor:
        fine = self.look(self.enter(to_blocks(grids)).relu()).relu()
        coarse = self.look_far(self.down(fine).relu()).relu()
        whole = self.spread(self.gather(coarse.flatten(1)).relu()).relu()
        coarse = coarse + whole.reshape(-1, *coarse.shape[1:])
        joined = torch.cat([fine, self.up(coarse).relu()], dim=1)
        return from_blocks(self.leave(self.join(joined).relu()))


def _convolutions(inputs: int, outputs: int) -> nn.Sequential:
    """Two convolutions with batch norm, which export folds away."""
    layers: list[nn.Module] = []
    for channels in (inputs, outputs):
        layers += [nn.Conv3d(channels, outputs, 3, padding=1, bias=False), nn.BatchNorm3d(outputs), nn.ReLU()]
    return nn.Sequential(*layers)


class UNet(nn.Module):
    """A second opinion: an ordinary U-Net with 8, 16, 32 and 64 times `width` / 8 channels (Ronneberger 2015)."""

    def __init__(self, inputs: int, outputs: int, width: int = 8) -> None:
        super().__init__()
        widths = [width, 2 * width, 4 * width, 8 * width]
        self.down = nn.ModuleList(_convolutions(a, b) for a, b in zip([inputs, *widths], widths))
        self.up = nn.ModuleList(nn.ConvTranspose3d(2 * w, w, 2, stride=2) for w in widths[:-1])
        self.join = nn.ModuleList(_convolutions(2 * w, w) for w in widths[:-1])
        self.leave = nn.Conv3d(width, outputs, 1)
        nn.init.constant_(self.leave.bias, EMPTY)  # type: ignore[arg-type]

    def forward(self, grids: torch.Tensor) -> torch.Tensor:
        levels = [self.down[0](grids)]
        for layer in list(self.down)[1:]:
            levels.append(layer(nn.functional.max_pool3d(levels[-1], 2)))
        found = levels.pop()
        for level in (2, 1, 0):
            found = self.join[level](torch.cat([levels[level], self.up[level](found)], dim=1))
        return self.leave(found)  # type: ignore[no-any-return]


class Thesis(nn.Module):
    """The network of Varley, DeChant, Richardson, Ruales and Allen 2017: 430 million parameters for one output."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        convolutions = [nn.Conv3d(inputs, 64, 4), nn.Conv3d(64, 64, 4), nn.Conv3d(64, 64, 4)]
        first, second, third = convolutions
        pool, relu = nn.MaxPool3d(2), nn.ReLU()
        self.look = nn.Sequential(first, relu, second, relu, pool, third, relu, pool)
        self.dense = nn.Linear(64 * 7**3, 5000)
        self.leave = nn.Linear(5000, outputs * RESOLUTION**3)
        for layer in (*convolutions, self.dense):
            nn.init.kaiming_normal_(layer.weight)
            nn.init.zeros_(layer.bias)  # type: ignore[arg-type]
        nn.init.xavier_normal_(self.leave.weight)
        nn.init.zeros_(self.leave.bias)
        self.outputs = outputs

    def forward(self, grids: torch.Tensor) -> torch.Tensor:
        found = self.leave(self.dense(self.look(grids).flatten(1)).relu())
        return found.reshape(-1, self.outputs, RESOLUTION, RESOLUTION, RESOLUTION)  # type: ignore[no-any-return]


NETWORKS: dict[str, type[nn.Module]] = {"block": Block, "unet": UNet, "thesis": Thesis}


def network_of(name: str, inputs: int, outputs: int, sizes: dict[str, Any]) -> nn.Module:
    """A network that completes grids, with first weights by PyTorch's own random numbers."""
    return NETWORKS[name](inputs, outputs, **sizes)


def parameters_of(network: nn.Module) -> int:
    return sum(values.numel() for values in network.parameters())

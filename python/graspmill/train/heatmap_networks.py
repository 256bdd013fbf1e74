"""Networks that find grasps in images: from pixels to a map of how good palm and fingertips of a grasp would be.

A cell sees a square of `FIELD` pixels, `STRIDE` pixels from the next one's. Training runs them on such squares, each
cut out of an image with a margin (`graspmill.train.patches.cut`): it has the numbers that the whole image has there.
"""

from __future__ import annotations

import torch
from torch import nn
from torch.nn.functional import conv2d

from .patches import MARGIN
from .recipe import HeatmapRecipe, PIXELS

WINDOW = MARGIN // 2
"""Pixels on each side of a pixel that it is normalised by: twice, since the deviation there is that of differences."""
SIGMA = 2.0
"""Width of the window's Gaussian, px."""
FLOORS = {"red": 0.05, "green": 0.05, "blue": 0.05, "depth": 0.005}
"""Smallest deviation that is divided by: of colours from 0 to 1, of depths in metres."""


class LocalContrast(nn.Module):
    """Local contrast normalisation (Jarrett, Kavukcuoglu, Ranzato and LeCun 2009, section 2.1): each pixel less the
    weighted mean around it, divided by the weighted deviation there.

    Each channel is normalised by itself, since metres and colours have no common mean; pixels without a return and
    those outside of the image have no weight; and the deviation has a fixed floor, where the paper takes its mean over
    the image, so that a patch has the numbers of the whole image.
    """

    def __init__(self, channels: tuple[str, ...]) -> None:
        super().__init__()
        self.colours = len(channels) - 1
        steps = torch.arange(-WINDOW, WINDOW + 1, dtype=torch.float32)
        line = torch.exp(-(steps**2) / (2 * SIGMA**2))
        window = torch.outer(line, line) / line.sum() ** 2
        floor = torch.tensor([FLOORS[name] for name in channels]).reshape(1, -1, 1, 1)
        # No weights that are learnt or kept.
        self.register_buffer("window", window.repeat(len(channels), 1, 1, 1), persistent=False)
        self.register_buffer("floor", floor, persistent=False)

    def around(self, values: torch.Tensor) -> torch.Tensor:
        """Weighted sums over the window, nothing outside."""
        return conv2d(values, self.window, padding=WINDOW, groups=values.shape[1])  # type: ignore[arg-type]

    def forward(self, image: torch.Tensor, inside: torch.Tensor) -> torch.Tensor:
        """Images (batch, channels, height, width), depth last, 0 = no return; `inside` (batch, 1, height, width) is 0
        outside of the image."""
        has_return = (image[:, -1:] > 0).to(image.dtype)
        valid = torch.cat([inside.expand(-1, self.colours, -1, -1), has_return], dim=1) if self.colours else has_return
        weight = self.around(valid).clamp(min=1e-6)
        off = (image - self.around(image * valid) / weight) * valid
        deviation = (self.around(off * off) / weight).sqrt()
        return off / torch.maximum(deviation, self.floor)  # type: ignore[arg-type]


class OnImages(nn.Module):
    """A network after local contrast normalisation, on whole images and on squares that were cut out of them."""

    def __init__(self, pixels: tuple[str, ...], network: nn.Module) -> None:
        super().__init__()
        self.contrast, self.network = LocalContrast(pixels), network

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Whole images (batch, channels, height, width) to maps (batch, outputs, rows, columns)."""
        return self.network(self.contrast(image, torch.ones_like(image[:, :1])))  # type: ignore[no-any-return]

    def of_patches(self, squares: torch.Tensor, noise: torch.Tensor | None = None) -> torch.Tensor:
        """Squares as `graspmill.train.patches.cut` gives them to the numbers of their cells, (batch, outputs); noise is
        added to the normalised pixels."""
        pixels = self.contrast(squares[:, :-1], squares[:, -1:])[..., MARGIN:-MARGIN, MARGIN:-MARGIN]
        return self.network(pixels if noise is None else pixels + noise).flatten(1)  # type: ignore[no-any-return]


class Heatmap(nn.Module):
    """The network of table 4.1 of the thesis, for normalised pixels: a map of `outputs` numbers, a cell for each 8
    pixels. The three dense layers at its end are linear there, and so one layer; `linear=False` puts ReLU between.

    A cell sees 73 x 73 pixels. A patch of that size gives the very number that the whole image gives at that cell; a
    patch of 72 lacks the last row and column, as cells at the far borders of an image do.
    """

    def __init__(self, inputs: int = 4, outputs: int = 32, linear: bool = True) -> None:
        super().__init__()
        pool = nn.MaxPool2d(2, ceil_mode=True)
        layers: list[nn.Module] = [nn.Conv2d(inputs, 96, 11, stride=2), nn.ReLU(), pool]
        layers += [nn.Conv2d(96, 256, 3), nn.ReLU(), pool]
        for _ in range(3):
            layers += [nn.Conv2d(256, 256, 3), nn.ReLU()]
        between = nn.Identity if linear else nn.ReLU
        layers += [nn.Conv2d(256, 1000, 1), between(), nn.Conv2d(1000, 100, 1), between(), nn.Conv2d(100, outputs, 1)]
        self.layers = nn.Sequential(*layers)

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        return self.layers(image)  # type: ignore[no-any-return]


class HeatmapSmall(nn.Module):
    """A quarter of the parameters of table 4.1 for the same cells: strided convolutions in place of pooling, ReLU
    throughout. Every cell sees all of its pixels; the last row and column of table 4.1, which do not, are not there."""

    def __init__(self, inputs: int, outputs: int, width: int = 32) -> None:
        super().__init__()
        wide = 4 * width
        convolutions = [
            *(nn.Conv2d(inputs, width, 5, stride=2), nn.Conv2d(width, 2 * width, 3, stride=2)),
            nn.Conv2d(2 * width, wide, 3, stride=2),
            *(nn.Conv2d(wide, wide, side) for side in (3, 3, 3, 2, 1)),
        ]
        layers = [layer for convolution in convolutions for layer in (convolution, nn.ReLU())]
        self.layers = nn.Sequential(*layers, nn.Conv2d(wide, outputs, 1))

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        return self.layers(image)  # type: ignore[no-any-return]


NETWORKS: dict[str, type[nn.Module]] = {"heatmap": Heatmap, "heatmap-small": HeatmapSmall}


def heatmap_network_of(recipe: HeatmapRecipe, types: int) -> OnImages:
    """A recipe's network for a number of grasp types, with first weights by PyTorch's own random numbers."""
    pixels = PIXELS[recipe.pixels]
    return OnImages(pixels, NETWORKS[recipe.network](len(pixels), 4 * types, **recipe.sizes))

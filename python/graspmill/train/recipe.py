"""Recipes: the settings of a training, as a TOML file that is as strict as a job."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from .strict import BadRecipe, key, sizes_of, table_of, text_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

VARIANTS = {
    "depth": ("partial",),
    "depth-free": ("partial", "free"),
    "depth-touch": ("partial", "free", "touch"),
    "depth-or-touch": ("partial", "touch"),
    "touch": ("touch",),
}
"""Inputs of each variant, in the order of the model's; `depth-or-touch` joins both in one grid (thesis ch. 6)."""
OUTPUTS = ("occupancy", "coverage")
SIZES: dict[str, dict[str, int]] = {
    "block": {"fine": 32, "coarse": 64, "middle": 256},
    "unet": {"width": 8},
    "thesis": {},
}
"""Widths of the layers of each network that completes shapes, in channels."""
HEATMAP_SIZES: dict[str, dict[str, int]] = {"heatmap": {}, "heatmap-small": {"width": 32}}
"""Widths of the layers of each network that finds grasps in images, in channels."""
PIXELS = {"depth": ("depth",), "rgbd": ("red", "green", "blue", "depth")}
"""Channels of the images that these see."""


@dataclass(frozen=True)
class Training:
    """Steps of the optimiser (Adam)."""

    steps: int = key(3000, low=1)
    batch: int = key(32, low=1)
    rate: float = key(3e-3, low=0)
    """Learning rate, at the peak of the schedule."""
    schedule: str = key("one_cycle", choices=("one_cycle", "constant"))
    average: float = key(0.995, low=0, high=0.99999)
    """Share that the exponential average of the weights keeps per step; 0 for the weights themselves."""
    buffer: int = key(2048, low=1)
    """Samples that are mixed with each other."""


@dataclass(frozen=True)
class Augmentation:
    """Losses of the inputs of a training sample, by random numbers of (seed, step, index in the batch)."""

    hidden_share: float = key(0.3, low=0, high=1)
    """Share of the samples of which a part is hidden."""
    hide: float = key(0.4, low=0, high=0.95)
    """Largest share of the seen cells that is hidden, on one side of a line across the image."""
    drop: float = key(0.05, low=0, high=0.95)
    """Largest share of single seen cells that is lost."""
    contacts: int = key(40, low=0)
    """Largest count of touched cells that is kept."""
    blank_free: float = key(0.1, low=0, high=1)
    """Share of the samples without any cell seen to be free."""


@dataclass(frozen=True)
class Validation:
    """When, and on how many samples of each split, the network is evaluated."""

    every: int = key(250, low=1)
    samples: int = key(256, low=64)


@dataclass(frozen=True)
class Recipe:
    """A whole training."""

    name: str = key("completion")
    network: str = key("block", choices=tuple(SIZES))
    variant: str = key("depth-free", choices=tuple(VARIANTS))
    outputs: tuple[str, ...] = key(OUTPUTS, choices=OUTPUTS)
    objects: int = key(0, low=0)
    """Training objects, one of the counts of the job's `split.training_subsets`; 0 for all."""
    seed: int = key(0, low=0)
    roots: tuple[str, ...] = key(())
    """Root digests of the datasets that it may be used with; any without them."""
    sizes: dict[str, int] = field(default_factory=dict)
    training: Training = field(default_factory=Training)
    augmentation: Augmentation = field(default_factory=Augmentation)
    validation: Validation = field(default_factory=Validation)

    @property
    def inputs(self) -> tuple[str, ...]:
        return VARIANTS[self.variant]

    @property
    def channels(self) -> int:
        """Channels that the network itself reads."""
        return 1 if self.variant == "depth-or-touch" else len(self.inputs)

    def text(self) -> str:
        """The recipe with every default, as TOML."""
        return text_of(self)


@dataclass(frozen=True)
class HeatmapTraining(Training):
    """Steps of the optimiser. A batch holds whole grasps, each with its four patches."""

    batch: int = key(32, low=4)
    """Patches, a multiple of four."""
    buffer: int = key(256, low=1)
    """Grasps that are mixed with each other."""
    optimiser: str = key("adam", choices=("adam", "sgd"))
    l1: float = key(0.0, low=0)
    """Weight of the sum of the absolute weights in the loss."""
    noise: float = key(0.0, low=0)
    """Standard deviation of Gaussian noise on the normalised pixels of a patch."""


@dataclass(frozen=True)
class HeatmapRecipe:
    """A whole training of a network that finds grasps in images."""

    name: str = key("heatmap")
    network: str = key("heatmap-small", choices=tuple(HEATMAP_SIZES))
    pixels: str = key("depth", choices=tuple(PIXELS))
    """Channels of the image: `rgbd` needs the colours of the dataset."""
    targets: str = key("tested", choices=("tested", "all"))
    """Numbers of the label vectors that are learnt: those that trials determine, or all, as in the thesis."""
    points: str = key("visible", choices=("visible", "all"))
    """Points that are learnt: those that nothing in the image hides, or all."""
    seed: int = key(0, low=0)
    roots: tuple[str, ...] = key(())
    """Root digests of the datasets that it may be used with; any without them."""
    sizes: dict[str, int] = field(default_factory=dict)
    training: HeatmapTraining = field(default_factory=HeatmapTraining)
    validation: Validation = field(default_factory=Validation)

    def text(self) -> str:
        """The recipe with every default, as TOML."""
        return text_of(self)


AnyRecipe = Recipe | HeatmapRecipe


def read_recipe(path: Path) -> AnyRecipe:
    """The recipe in a file, or one of the package's own by name; its network determines its kind. Raises ``BadRecipe``."""
    own = Path(__file__).parent / "recipes"
    file = path if path.exists() else own / f"{path.name}.toml"
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        names = ", ".join(sorted(each.stem for each in own.glob("*.toml")))
        raise BadRecipe(f"{path}: no such file, and no recipe of this name; there are {names}") from None
    except ValueError as error:
        raise BadRecipe(f"{file}: it is not TOML ({error})") from error
    network = str(table.get("network", "block"))
    if network not in SIZES and network not in HEATMAP_SIZES:
        known = ", ".join((*SIZES, *HEATMAP_SIZES))
        raise BadRecipe(f"{file}: `network` is {network!r}; it must be one of {known}")
    sizes = sizes_of(str(file), (SIZES | HEATMAP_SIZES)[network], table.pop("sizes", {}))
    if network in SIZES:
        return replace(table_of(Recipe, table, str(file)), sizes=sizes)
    recipe = replace(table_of(HeatmapRecipe, table, str(file)), sizes=sizes)
    if recipe.training.batch % 4:
        given = recipe.training.batch
        raise BadRecipe(f"{file}: `training.batch` is {given}; a grasp has four patches: give a multiple of 4")
    return recipe

"""Recipes: what a training does, as a TOML file that is as strict as a job."""

from __future__ import annotations

import difflib
import json
import sys
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

R = TypeVar("R")

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
"""Widths of each network's layers, in channels."""


class BadRecipe(ValueError):
    """A recipe, or data for it, that cannot be trained with; says what to do."""


def key(default: Any, *, choices: tuple[str, ...] = (), low: float | None = None, high: float | None = None) -> Any:
    """A key of a recipe: its default, and what is allowed."""
    return field(default=default, metadata={"choices": choices, "low": low, "high": high})


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
    """When, and on how many samples of each split, the network is tried."""

    every: int = key(250, low=1)
    samples: int = key(256, low=64)


@dataclass(frozen=True)
class Recipe:
    """A whole training."""

    name: str = key("completion")
    network: str = key("block", choices=tuple(SIZES))
    variant: str = key("depth-free", choices=tuple(VARIANTS))
    outputs: tuple[str, ...] = key(OUTPUTS, choices=OUTPUTS)
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
        lines, tables = [], []
        for each in fields(self):
            value = getattr(self, each.name)
            if is_dataclass(value) or isinstance(value, dict):
                table = value if isinstance(value, dict) else vars(value)
                tables += ["", f"[{each.name}]", *(f"{name} = {json.dumps(item)}" for name, item in table.items())]
            else:
                lines.append(f"{each.name} = {json.dumps(value)}")
        return "\n".join([*lines, *tables, ""])


def read_recipe(path: Path) -> Recipe:
    """The recipe in a file, or one of the package's own by name; raises ``BadRecipe``."""
    own = Path(__file__).parent / "recipes"
    file = path if path.exists() else own / f"{path.name}.toml"
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        names = ", ".join(sorted(each.stem for each in own.glob("*.toml")))
        raise BadRecipe(f"{path}: no such file, and no recipe of this name; there are {names}") from None
    except ValueError as error:
        raise BadRecipe(f"{file}: it is no TOML ({error})") from error
    network = table.get("network", "block")
    sizes = _sizes(file, str(network), table.pop("sizes", {}))
    recipe = _table(Recipe, table, str(file), "")
    return replace(recipe, sizes=sizes)


def _sizes(file: Path, network: str, given: Any) -> dict[str, int]:
    known = SIZES.get(network, {})
    if not isinstance(given, dict):
        raise BadRecipe(f"{file}: `sizes` must be a table")
    for name, value in given.items():
        _expect_known(str(file), f"sizes.{name}", name, known)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise BadRecipe(f"{file}: `sizes.{name}` is {value!r}; it must be a whole number from 1")
    return known | given


def _expect_known(file: str, place: str, name: str, known: Any) -> None:
    if name not in known:
        near = difflib.get_close_matches(name, known, 1)
        meant = f"did you mean `{near[0]}`? " if near else ""
        raise BadRecipe(f"{file}: unknown key `{place}`; {meant}there are {', '.join(known) or 'none'}")


def _table(kind: type[R], table: dict[str, Any], file: str, before: str) -> R:
    known = {each.name: each for each in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, value in table.items():
        place = before + name
        _expect_known(file, place, name, known)
        each = known[name]
        if each.default is MISSING:
            if not isinstance(value, dict):
                raise BadRecipe(f"{file}: `{place}` must be a table")
            values[name] = _table(each.default_factory, value, file, f"{place}.")  # type: ignore[arg-type]
        else:
            values[name] = _value(each, value, f"{file}: `{place}` is {value!r}; it must be ")
    return kind(**values)


def _value(each: Any, value: Any, wrong: str) -> Any:
    """A value of the kind, within the limits, that a key states."""
    low, high, choices = (each.metadata[name] for name in ("low", "high", "choices"))
    if isinstance(each.default, tuple):
        good = isinstance(value, list) and all(isinstance(item, str) for item in value)
        good = good and (not choices or (value == [c for c in choices if c in value] and value))
        if not good:
            raise BadRecipe(
                wrong + f"a list of {'some of ' + ', '.join(choices) + ', in this order' if choices else 'texts'}"
            )
        return tuple(value)
    if isinstance(each.default, str):
        if not isinstance(value, str) or (choices and value not in choices):
            raise BadRecipe(wrong + (f"one of {', '.join(choices)}" if choices else "a text"))
        return value
    whole = isinstance(each.default, int)
    right = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
    if not right or (low is not None and value < low) or (high is not None and value > high):
        limits = f" from {low}" if low is not None else ""
        raise BadRecipe(
            wrong + f"a {'whole ' if whole else ''}number{limits}" + (f" to {high}" if high is not None else "")
        )
    return value if whole else float(value)

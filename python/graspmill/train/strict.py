"""Settings as a TOML file that is as strict as a job: dataclasses whose fields define what is allowed."""

from __future__ import annotations

import difflib
import json
from dataclasses import MISSING, field, fields, is_dataclass
from typing import Any, TypeVar

R = TypeVar("R")


class BadRecipe(ValueError):
    """A recipe, or data for it, that cannot be trained with; includes the remedy."""


def key(default: Any, *, choices: tuple[str, ...] = (), low: float | None = None, high: float | None = None) -> Any:
    """A key of a recipe: its default, and what is allowed."""
    return field(default=default, metadata={"choices": choices, "low": low, "high": high})


def text_of(recipe: Any) -> str:
    """A dataclass with every default, as TOML."""
    lines, tables = [], []
    for each in fields(recipe):
        value = getattr(recipe, each.name)
        if is_dataclass(value) or isinstance(value, dict):
            table = value if isinstance(value, dict) else vars(value)
            tables += ["", f"[{each.name}]", *(f"{name} = {json.dumps(item)}" for name, item in table.items())]
        else:
            lines.append(f"{each.name} = {json.dumps(value)}")
    return "\n".join([*lines, *tables, ""])


def sizes_of(file: str, known: dict[str, int], given: Any) -> dict[str, int]:
    """Widths of a network's layers, those that are not given by default."""
    if not isinstance(given, dict):
        raise BadRecipe(f"{file}: `sizes` must be a table")
    for name, value in given.items():
        _expect_known(file, f"sizes.{name}", name, known)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise BadRecipe(f"{file}: `sizes.{name}` is {value!r}; it must be a whole number from 1")
    return known | given


def _expect_known(file: str, place: str, name: str, known: Any) -> None:
    if name not in known:
        near = difflib.get_close_matches(name, known, 1)
        meant = f"did you mean `{near[0]}`? " if near else ""
        raise BadRecipe(f"{file}: unknown key `{place}`; {meant}there are {', '.join(known) or 'none'}")


def table_of(kind: type[R], table: dict[str, Any], file: str, before: str = "") -> R:
    """A table as a dataclass; raises `BadRecipe`, which names the key."""
    known = {each.name: each for each in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, value in table.items():
        place = before + name
        _expect_known(file, place, name, known)
        each = known[name]
        if each.default is MISSING:
            if not isinstance(value, dict):
                raise BadRecipe(f"{file}: `{place}` must be a table")
            values[name] = table_of(each.default_factory, value, file, f"{place}.")  # type: ignore[arg-type]
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

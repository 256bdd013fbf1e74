"""What both tiers of `make bench-data` print: scores beside those of good data, and whether each fault is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from data_faults import ALL, interval

DATA, FAULT, LEAK, TRIVIAL = "data", "fault", "leak", "trivial"


@dataclass(frozen=True)
class Row:
    """Scores of one way to complete shapes."""

    name: str
    kind: str
    """`DATA` as made, with a `FAULT` planted, with a `LEAK` of test objects; or `TRIVIAL`, without learning."""
    scores: np.ndarray
    """Mean Jaccard overlap of each test object, (objects,)."""
    stratum: str = ALL
    """Where it must differ."""
    against: str = ""
    """The row that it is compared with; empty: the first, of the data as made."""


@dataclass(frozen=True)
class Table:
    """Rows over the same objects; the first is of the data as made."""

    rows: Sequence[Row]
    strata: dict[str, np.ndarray]
    """Masks over the objects."""

    def loss(self, row: Row, stratum: str) -> tuple[float, float, float]:
        """By how much the row lies below that which it is compared with, object by object: mean, and 95 % interval."""
        good = next((other for other in self.rows if other.name == row.against), self.rows[0])
        loss = (good.scores - row.scores)[self.strata[stratum]]
        return float(loss.mean()), *interval(loss)

    def told(self, row: Row) -> bool:
        """Whether it differs beyond chance, to the side that it must: a leak scores too well."""
        _, low, high = self.loss(row, row.stratum)
        return high < 0 if row.kind == LEAK else low > 0

    def untold(self, *kinds: str) -> list[str]:
        return [row.name for row in self.rows if row.kind in kinds and not self.told(row)]

    def text(self) -> str:
        header = f"{'':30}" + "".join(f"  {'Jaccard':>7} {'loss, 95 % interval':26}" for _ in self.strata)
        names = f"{'':30}" + "".join(f"  {f'{name} ({mask.sum()})':34}" for name, mask in self.strata.items())
        return "\n".join([names.rstrip(), header.rstrip(), *map(self._line, self.rows)])

    def _line(self, row: Row) -> str:
        line = f"{f'({row.name})' if row.kind == TRIVIAL else row.name:30}"
        for stratum, mask in self.strata.items():
            line += f"  {row.scores[mask].mean():7.4f} "
            if row.kind == DATA:
                line += " " * 26
                continue
            mean, low, high = self.loss(row, stratum)
            mark = "*" if stratum == row.stratum and self.told(row) else " "
            line += f"{mean:+.4f} [{low:+.4f}, {high:+.4f}]{mark}"
        return line.rstrip()

    def facts(self) -> list[dict[str, Any]]:
        """The same for JSON."""
        return [
            {
                "name": row.name,
                "kind": row.kind,
                "against": None if row.kind == DATA else row.against or self.rows[0].name,
                "must_differ_over": None if row.kind == DATA else row.stratum,
                "told": None if row.kind == DATA else self.told(row),
                "strata": {
                    stratum: {
                        "objects": int(mask.sum()),
                        "jaccard": float(row.scores[mask].mean()),
                        "loss": dict(zip(("mean", "low", "high"), self.loss(row, stratum))),
                    }
                    for stratum, mask in self.strata.items()
                },
            }
            for row in self.rows
        ]

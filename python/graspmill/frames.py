"""Tables for pandas, which the package needs for nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import MissingPackage

if TYPE_CHECKING:
    import pandas as pd


def import_pandas() -> Any:
    """The module ``pandas``.

    Raises ``MissingPackage`` where it is not installed.
    """
    try:
        import pandas
    except ModuleNotFoundError as error:
        if error.name != "pandas":
            raise
        remedy = "`pip install pandas`; `data.index` has the columns of the index as NumPy arrays, without pandas"
        raise MissingPackage("pandas", "a frame", remedy) from None
    return pandas


def index_frame(columns: Mapping[str, npt.NDArray[Any]], rows: npt.NDArray[np.int64] | slice) -> pd.DataFrame:
    """Some rows of the sample index; the digests, 32 bytes per channel and sample, are left out."""
    plain = {name: column[rows] for name, column in columns.items() if not name.startswith("digest_")}
    frame: pd.DataFrame = import_pandas().DataFrame(plain)
    return frame

"""Tables for pandas, which only this module needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .errors import MissingPackage

if TYPE_CHECKING:
    import pandas as pd

    from .index import Index, Rows


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


def index_frame(index: Index, rows: Rows) -> pd.DataFrame:
    """Some rows of the sample index; the digests, 32 bytes per channel and sample, are omitted."""
    plain = {name: index.column(name, rows) for name in index if not name.startswith("digest_")}
    frame: pd.DataFrame = import_pandas().DataFrame(plain)
    return frame

"""``python -m graspmill info DIR``: what a dataset holds."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from . import __version__
from .errors import DatasetError
from .folder import Folder


def _facts(folder: Folder) -> dict[str, Any]:
    manifest = folder.manifest
    keys = ("product", "format_version", "generator", "root", "classes", "topics", "counts", "warnings")
    sizes = {"shards": len(folder.shards), "bytes": sum(shard["bytes"] for shard in manifest["shards"])}
    return {key: manifest[key] for key in keys} | sizes | {"objects": [row["name"] for row in folder.objects()]}


def _shown(line: str) -> str:
    """A line with control characters, line ends and marks of direction escaped: names come from others."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)


def _text(facts: dict[str, Any]) -> str:
    counts = facts["counts"]
    lines = [f"{facts['product']}: {counts['kept']} samples of {len(facts['objects'])} objects, {facts['generator']}"]
    lines.append(f"root      {facts['root']}")
    lines.append(f"channels  {', '.join(topic.rsplit('/', 1)[-1] for topic in facts['topics'])}")
    for split, count in counts["splits"].items():
        lines.append(f"split     {split}: {count}")
    for reason, count in counts["rejected"].items():
        lines.append(f"rejected  {reason}: {count}")
    lines += [f"fact      {name}: {total}" for name, total in counts["facts"].items()]
    lines.append(f"shards    {facts['shards']}, {facts['bytes'] / 1e6:.1f} MB")
    some = ", ".join(facts["objects"][:12])
    lines.append(f"objects   {some}{', ...' if len(facts['objects']) > 12 else ''}")
    lines += [f"warning   {warning}" for warning in facts["warnings"]]
    return "\n".join(map(_shown, lines))


def main(arguments: list[str] | None = None) -> int:
    """The command line; 0 when the dataset could be read, 2 for bad arguments, else 1."""
    parser = argparse.ArgumentParser(prog="python -m graspmill", description="Reads datasets of graspmill.")
    parser.add_argument("--version", action="version", version=__version__)
    verbs = parser.add_subparsers(dest="verb", required=True)
    info = verbs.add_parser("info", help="what a dataset holds")
    info.add_argument("dir", metavar="DIR")
    info.add_argument("--json", action="store_true", help="one JSON object")
    given = parser.parse_args(arguments)
    try:
        facts = _facts(Folder(given.dir))
    except DatasetError as error:
        print(f"error: {_shown(str(error))}", file=sys.stderr)
        return 1
    print(json.dumps(facts) if given.json else _text(facts))
    return 0


if __name__ == "__main__":
    sys.exit(main())

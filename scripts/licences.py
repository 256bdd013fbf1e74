#!/usr/bin/env python3
"""Lists the crates that are compiled into the program, with the texts of their licences.

    python scripts/licences.py [--out FILE]     Markdown, to the standard output by default
    python scripts/licences.py --expression     the SPDX expression of the program with all of them

Crates and licences are from `cargo metadata`, texts from the sources that cargo unpacked. Each text is printed once, before it
the crates that contain it. The order depends on names and versions only. Needs no network once cargo has the sources.

Exit codes: 0 done; 1 cargo failed; 2 wrong arguments.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

# Programs are found only in absolute folders of PATH: the current folder contains data.
os.environ["PATH"] = os.pathsep.join(filter(os.path.isabs, os.environ.get("PATH", "").split(os.pathsep)))

ROOT = Path(__file__).resolve().parent.parent
PLATFORM = "x86_64-unknown-linux-gnu"
OURS = "MIT OR Apache-2.0"
TEXT_NAME = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
# Sources and generated pages have such names, too.
NO_TEXT = re.compile(r"\.(rs|py|c|h|html|toml|json|yml|yaml)$", re.IGNORECASE)
HEAD = """\
# Libraries in the program

The program graspmill is compiled from the crates below and from Rust's standard library (MIT OR Apache-2.0,
<https://github.com/rust-lang/rust>). Their licences, as SPDX expressions, and the texts that they contain follow. libmujoco has
its own files of licences beside this one. Captions on pictures are bitmaps of the font Noto Sans Mono (Google, SIL Open Font License
1.1, <https://openfontlicense.org>), from the crate `noto-sans-mono-bitmap`.

"""


class Unlistable(Exception):
    """Crates that cannot be listed; the message has the reason."""


def metadata():
    cargo = os.environ.get("CARGO", "cargo")
    command = [cargo, "metadata", "--locked", "--format-version", "1", "--filter-platform", PLATFORM]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, errors="replace")
    except FileNotFoundError:
        raise Unlistable(f"{cargo} is not installed: pack as the user who built the program") from None
    if done.returncode != 0:
        raise Unlistable(f"cargo metadata failed:\n{done.stderr.strip()}")
    return json.loads(done.stdout)


def linked_crates(facts):
    """Foreign packages that the program contains: what it uses directly or through others, without tools of the build and tests."""
    packages = {package["id"]: package for package in facts["packages"]}
    nodes = {node["id"]: node for node in facts["resolve"]["nodes"]}
    macros = {id for id, package in packages.items() if any("proc-macro" in target["kind"] for target in package["targets"])}
    reached, waiting = set(), [facts["resolve"]["root"]]
    while waiting:
        id = waiting.pop()
        if id in reached or id in macros:
            continue
        reached.add(id)
        for use in nodes[id]["deps"]:
            if any(kind["kind"] is None for kind in use["dep_kinds"]):
                waiting.append(use["pkg"])
    foreign = [packages[id] for id in reached if packages[id]["source"] is not None]
    return sorted(foreign, key=lambda package: (package["name"], package["version"]))


def alternatives(expression):
    """The choices of a licence expression, if it has no other structure; else the expression alone."""
    plain = re.sub(r"\s*/\s*", " OR ", expression)
    return [plain] if "(" in plain or " AND " in plain else plain.split(" OR ")


def shown(package):
    expression = package["license"]
    return " OR ".join(alternatives(expression)) if expression else "see its text"


def expression_of(crates):
    """The licence of everything together: ours, and a term for each crate that offers neither of our two."""
    terms = set()
    for package in crates:
        choices = alternatives(package["license"] or "")
        if not {"MIT", "Apache-2.0"} & set(choices):
            terms.add(" OR ".join(choices))
        elif not {"MIT", "Apache-2.0"} <= set(choices):
            # One of the two alone is a condition for everybody.
            terms.update({"MIT", "Apache-2.0"} & set(choices))
    # libmujoco, and the font of captions.
    terms |= {"Apache-2.0", "OFL-1.1"}
    whole = [f"({term})" if " OR " in term and not term.startswith("(") else term for term in sorted(terms) if term]
    return " AND ".join([f"({OURS})", *whole])


def texts_of(package):
    """Texts of licences in the package's sources, those of bundled C code included: (path, text), by path."""
    folder = Path(package["manifest_path"]).parent
    found = []
    for parent, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if name not in ("tests", "target", "fuzz", "benches", ".git"))
        for name in sorted(files):
            path = Path(parent, name)
            inside = path.relative_to(folder)
            is_text = TEXT_NAME.match(name) or inside.parts[0].upper() in ("LICENSES", "LICENSE")
            if is_text and not NO_TEXT.search(name) and len(inside.parts) <= 3 and path.is_file():
                found.append((inside.as_posix(), path.read_text(encoding="utf-8", errors="replace").strip()))
    return found


def write(crates):
    by_text = {}
    rows, without = [], []
    for package in crates:
        name = f"{package['name']} {package['version']}"
        rows.append(f"| {package['name']} | {package['version']} | {shown(package)} | {package['repository'] or ''} |")
        texts = texts_of(package)
        if not texts:
            without.append(f"- {name}, {shown(package)}: {', '.join(package['authors']) or 'its authors'}")
        for path, text in texts:
            by_text.setdefault(" ".join(text.split()), (text, []))[1].append(f"{name} ({path})")
    parts = [HEAD, "| crate | version | licence | source |\n| --- | --- | --- | --- |\n", "\n".join(rows), "\n"]
    if without:
        parts.append("\nThese crates contain no text of their licence; the texts of the same names below are meant:\n\n")
        parts.append("\n".join(without) + "\n")
    for text, users in sorted(by_text.values(), key=lambda entry: (entry[1], entry[0])):
        parts.append(f"\n## {', '.join(users)}\n\n````text\n{text}\n````\n")
    return "".join(parts)


def self_test():
    def crate(licence):
        return {"license": licence}

    assert alternatives("MIT/Apache-2.0") == ["MIT", "Apache-2.0"] == alternatives("MIT OR Apache-2.0")
    assert expression_of([crate("MIT OR Apache-2.0"), crate("Unlicense OR MIT"), crate("Zlib")]) \
        == f"({OURS}) AND Apache-2.0 AND MIT AND OFL-1.1 AND Zlib"
    assert expression_of([crate("CC0-1.0 OR BSD-3-Clause")]) == f"({OURS}) AND Apache-2.0 AND (CC0-1.0 OR BSD-3-Clause) AND OFL-1.1"
    unicode = "(MIT OR Apache-2.0) AND Unicode-3.0"
    assert expression_of([crate(unicode)]) == f"({OURS}) AND {unicode} AND Apache-2.0 AND OFL-1.1"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, metavar="FILE")
    parser.add_argument("--expression", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        self_test()
        return
    try:
        crates = linked_crates(metadata())
    except Unlistable as error:
        print(error, file=sys.stderr)
        raise SystemExit(1) from None
    text = expression_of(crates) + "\n" if options.expression else write(crates)
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()

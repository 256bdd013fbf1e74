#!/usr/bin/env python3
"""Keeps compiled dependencies between checkouts: one folder per lockfile, toolchain and build profile.

    python scripts/dependencies.py restore       copies kept artifacts into a target folder that has none
    python scripts/dependencies.py save          copies the artifacts of registry packages from the target folder
    python scripts/dependencies.py --self-test   asserts the rules for keys and names

The kept folder is $GRASPMILL_CACHE, by default $XDG_CACHE_HOME/graspmill or ~/.cache/graspmill; `GRASPMILL_CACHE=` (empty) turns
the cache off. Only artifacts of packages from a registry are kept: crates of this repository are always compiled in their
checkout. Cargo checks every artifact by its fingerprint and compiles again what does not fit, so a wrong or missing file costs time
and never correctness. The newest two keys are kept.

Needs Python 3.8 or later, cargo and rustc. Exit code 0 also when there is nothing to restore or no room to save.
"""

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Folders of a profile's target folder that hold artifacts; names in them end in a hash of 16 digits.
FOLDERS = (".fingerprint", "build", "deps")
KEPT_KEYS = 2
HASHED = re.compile(r"^(?P<name>.+?)-[0-9a-f]{16}(?:\..+)?$")


def cache_folder():
    """The folder of the cache, or `None` where it is turned off."""
    if "GRASPMILL_CACHE" in os.environ:
        named = os.environ["GRASPMILL_CACHE"]
        return Path(named) if named else None
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "graspmill"


def key():
    """Digest of what compiled dependencies depend on: lockfile, toolchain, profiles, and flags of the environment."""
    manifest = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    profiles = manifest[manifest.index("[profile."):]
    compiler = subprocess.run(["rustc", "-vV"], stdout=subprocess.PIPE, check=True).stdout
    flags = os.environ.get("RUSTFLAGS", "")
    parts = [(ROOT / "Cargo.lock").read_bytes(), compiler, profiles.encode(), flags.encode()]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()[:24]


def registry_packages(lockfile):
    """Names of the packages that come from a registry, as file names spell them: with underscores."""
    names = set()
    for entry in lockfile.split("[[package]]")[1:]:
        if re.search(r'^source = "registry\+', entry, re.MULTILINE):
            names.add(re.search(r'^name = "(.+)"', entry, re.MULTILINE).group(1).replace("-", "_"))
    return names


def is_kept(name, libraries):
    """Whether a file or folder in one of `FOLDERS` belongs to a package from a registry."""
    match = HASHED.match(name)
    stem = match.group("name").replace("-", "_") if match else ""
    # Artifacts of the package `serde` are called libserde, and folders of the package `libc` are called libc.
    return stem in libraries or (stem.startswith("lib") and stem[3:] in libraries)


def library_names(packages):
    """Names of packages and of their libraries, which differ for a few packages."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--offline"]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    if run.returncode:
        return packages
    names = set(packages)
    for package in json.loads(run.stdout)["packages"]:
        if package["source"]:
            names.update(target["name"].replace("-", "_") for target in package["targets"]
                         if set(target["kind"]) & {"lib", "proc-macro", "rlib", "cdylib"})
    return names


def target_folder():
    return Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target") / "release"


def copy(sources, folder):
    """Copies files and folders into a folder with their times, which Cargo compares; copy-on-write where the file system has it."""
    for start in range(0, len(sources), 500):
        chunk = [str(source) for source in sources[start:start + 500]]
        subprocess.run(["cp", "-a", "--reflink=auto", "-t", str(folder), *chunk], check=True)


def restore():
    cache, target = cache_folder(), target_folder()
    if cache is None or (target / ".fingerprint").exists():
        return
    kept = cache / "dependencies" / key()
    if not kept.is_dir():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    # Complete or absent: an interrupted copy leaves only a temporary name.
    partial = Path(tempfile.mkdtemp(prefix="restored-", dir=target.parent))
    try:
        for folder in FOLDERS:
            copy([kept / folder], partial)
        target.mkdir(exist_ok=True)
        for folder in FOLDERS:
            if not (target / folder).exists():
                (partial / folder).rename(target / folder)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    os.utime(kept)
    print(f"dependencies: restored from {kept}")


def save():
    cache, target = cache_folder(), target_folder()
    if cache is None or not (target / ".fingerprint").is_dir():
        return
    store = cache / "dependencies"
    kept = store / key()
    libraries = library_names(registry_packages((ROOT / "Cargo.lock").read_text(encoding="utf-8")))
    found = {folder: {entry.name for entry in (target / folder).iterdir() if is_kept(entry.name, libraries)}
             for folder in FOLDERS if (target / folder).is_dir()}
    if kept.is_dir() and all(names <= {entry.name for entry in (kept / folder).iterdir()} for folder, names in found.items()):
        return
    store.mkdir(parents=True, exist_ok=True)
    partial = Path(tempfile.mkdtemp(prefix="partial-", dir=store))
    try:
        for folder in FOLDERS:
            (partial / folder).mkdir()
            copy([target / folder / name for name in sorted(found.get(folder, ()))], partial / folder)
        if kept.is_dir():
            old = Path(tempfile.mkdtemp(prefix="old-", dir=store))
            kept.rename(old / "kept")
            partial.rename(kept)
            shutil.rmtree(old, ignore_errors=True)
        else:
            partial.rename(kept)
        print(f"dependencies: kept in {kept}")
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"dependencies: not kept: {error}", file=sys.stderr)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    keys = sorted((entry for entry in store.iterdir() if re.fullmatch(r"[0-9a-f]{24}", entry.name)),
                  key=lambda entry: entry.stat().st_mtime, reverse=True)
    for entry in keys[KEPT_KEYS:]:
        shutil.rmtree(entry, ignore_errors=True)


def self_test():
    lockfile = ('[[package]]\nname = "own"\nversion = "1"\n[[package]]\nname = "tract-core"\nversion = "1"\n'
                'source = "registry+https://index"\n')
    assert registry_packages(lockfile) == {"tract_core"}
    libraries = {"tract_core", "serde", "libc"}
    assert is_kept("libc-0123456789abcdef", libraries) and is_kept("liblibc-0123456789abcdef.rlib", libraries)
    assert is_kept("libtract_core-0123456789abcdef.rlib", libraries)
    assert is_kept("tract-core-0123456789abcdef", libraries)
    assert is_kept("tract_core-0123456789abcdef.d", libraries)
    assert not is_kept("libgraspmill_kernel-0123456789abcdef.rlib", libraries)
    assert not is_kept("serde", libraries) and not is_kept("libserde_json-0123456789abcdef.rlib", libraries)
    assert re.fullmatch(r"[0-9a-f]{24}", key()) and key() == key()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("verb", nargs="?", choices=["restore", "save"])
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        self_test()
    elif options.verb == "restore":
        restore()
    elif options.verb == "save":
        save()
    else:
        parser.error("name a verb: restore or save")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Packs the built program: a Python wheel that needs no compiler, or an installation below a prefix.

    python scripts/package.py wheel [--out dist]
    python scripts/package.py install [--prefix /usr/local] [--destdir /]

Both contain the program without its debugging symbols, libmujoco unchanged, completions of shells, manual pages, and the licences
of everything inside. The wheel also contains the Python package. Its platform tag is computed from what program and library need;
`--tag` states another one, which is refused if it promises an older system.

Needs Python 3.8 or later and binutils' strip; `wheel` also setuptools 77 or later and pip in the same Python. No network.

Exit codes: 0 done; 1 something is missing or does not fit; 2 wrong arguments.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import elf
import licences
from fetch import LIBRARY, LIBRARY_SHA256

# Programs are found only in absolute folders of PATH: the current folder contains data.
os.environ["PATH"] = os.pathsep.join(filter(os.path.isabs, os.environ.get("PATH", "").split(os.pathsep)))

ROOT = Path(__file__).resolve().parent.parent
# Scripts of shells, by the path below `share` where each shell finds them.
COMPLETIONS = {
    "bash": "bash-completion/completions/graspmill",
    "zsh": "zsh/site-functions/_graspmill",
    "fish": "fish/vendor_completions.d/graspmill.fish",
}
# Times in the archive: its bytes depend on its content alone. 1980 is the first year that zip knows.
EPOCH = "315532800"


class Unpackable(Exception):
    """Parts that are missing or do not fit; the message has the remedy."""


def run(command, **options):
    """Output of a command."""
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, errors="replace", **options)
    except FileNotFoundError:
        raise Unpackable(f"{command[0]} is not installed") from None
    if done.returncode != 0:
        raise Unpackable(f"{' '.join(map(str, command))}:\n{done.stdout}{done.stderr}")
    return done.stdout


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content, encoding="utf-8")


def copy(source, target, mode=0o644):
    target.parent.mkdir(parents=True, exist_ok=True)
    # A running program is replaced, not overwritten.
    if target.exists():
        target.unlink()
    shutil.copyfile(source, target)
    target.chmod(mode)


def checked_library(library):
    """The library, if it is the file that the tests ran with."""
    if not library.is_file():
        raise Unpackable(f"{library} is missing: run `make setup`")
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    if digest != LIBRARY_SHA256["x86_64"]:
        raise Unpackable(f"{library} has sha256 {digest}, not that of libmujoco in scripts/fetch.py: run `make setup`")
    return library


def requirements(program, library, run_path):
    """What program and library need, if an installation of both has it."""
    if not program.is_file():
        raise Unpackable(f"{program} is missing: run `make build`")
    found = [elf.read(program), elf.read(library)]
    if f"$ORIGIN/{run_path}" not in found[0].run_path:
        raise Unpackable(f"{program} does not search $ORIGIN/{run_path} for libmujoco: run `make build`")
    foreign = {name for each in found for name in each.libraries} - elf.SYSTEM_LIBRARIES - {library.name}
    if foreign:
        raise Unpackable(f"{program} needs {', '.join(sorted(foreign))}, which systems may not have: link without it")
    return found


def platform_tag(found, wanted=None):
    """The manylinux tag of these requirements, or the wanted one if it promises no older system."""
    needed = elf.c_library(found)
    if wanted is None:
        return elf.tag_of(needed)
    match = re.fullmatch(r"manylinux_(\d+)_(\d+)_x86_64", wanted)
    if match is None:
        raise Unpackable(f"{wanted} is not a tag such as {elf.tag_of(needed)}")
    if tuple(map(int, match.groups())) < needed:
        raise Unpackable(f"{wanted} is too low: program and library need glibc {needed[0]}.{needed[1]}")
    return wanted


def put_program(program, library, binary, folder):
    """Copies the program without debugging symbols, and the library as it is."""
    copy(program, binary, 0o755)
    run([os.environ.get("STRIP", "strip"), binary])
    copy(library, folder / library.name, 0o755)


def put_documents(program, share):
    """Completions of shells and manual pages, as the program prints them."""
    for shell, path in COMPLETIONS.items():
        write(share / path, run([program, "completions", shell]))
    pages = share / "man/man1"
    pages.mkdir(parents=True, exist_ok=True)
    run([program, "man", "--out", pages])


def put_licences(library, folder):
    """Our licences, those of libmujoco and the third parties in it, and those of all crates."""
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        copy(ROOT / name, folder / name)
    for name, target in (("LICENSE", "LICENSE-MUJOCO"), ("LICENSES_THIRD_PARTY.md", "LICENSES-MUJOCO-THIRD-PARTY.md")):
        if not (library.parent / name).is_file():
            raise Unpackable(f"{library.parent / name} is missing: remove {library} and run `make setup`")
        copy(library.parent / name, folder / target)
    crates = licences.linked_crates(licences.metadata())
    write(folder / "LICENSES-CRATES.md", licences.write(crates))
    return licences.expression_of(crates)


def stage(program, library, tag, folder):
    """Writes the sources of the wheel with the program into a folder."""
    shutil.copytree(ROOT / "python/graspmill", folder / "graspmill", ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
    copy(ROOT / "scripts/fetch.py", folder / "graspmill/fetch.py")
    for name in ("README.md", "setup.py", "scripts/graspmill"):
        copy(ROOT / "python" / name, folder / name)
    put_program(program, library, folder / "graspmill/_bin/graspmill", folder / "graspmill/_lib")
    put_documents(program, folder / "share")
    expression = put_licences(library, folder)
    write(folder / "platform-tag", tag + "\n")
    project = (ROOT / "python/pyproject.toml").read_text(encoding="utf-8")
    own = f'license = "{licences.OURS}"'
    if own not in project:
        raise Unpackable(f"python/pyproject.toml lacks the line {own}")
    write(folder / "pyproject.toml", project.replace(own, f'license = "{expression}"'))


def make_wheel(program, library, wanted, out):
    tag = platform_tag(requirements(program, library, "../_lib"), wanted)
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="graspmill-wheel.") as scratch:
        sources, wheels = Path(scratch, "sources"), Path(scratch, "wheels")
        stage(program, library, tag, sources)
        command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]
        run([*command, "--wheel-dir", wheels, sources], env={**os.environ, "SOURCE_DATE_EPOCH": EPOCH})
        (made,) = wheels.iterdir()
        if not made.name.endswith(f"-py3-none-{tag}.whl"):
            raise Unpackable(f"setuptools named the wheel {made.name}, expected the tag {tag}")
        target = out / made.name
        shutil.copyfile(made, target.with_suffix(".part"))
        os.replace(target.with_suffix(".part"), target)
    return target


def install(program, library, prefix, destdir):
    requirements(program, library, "../lib/graspmill")
    # A prefix is absolute; below `destdir` it is relative.
    root = destdir / prefix.relative_to("/") if destdir else prefix
    put_program(program, library, root / "bin/graspmill", root / "lib/graspmill")
    put_documents(program, root / "share")
    put_licences(library, root / "share/doc/graspmill")
    return root


def self_test():
    found = [elf.Requirements([], {"libc.so.6": {"GLIBC_2.35"}}, []), elf.Requirements([], {"libc.so.6": {"GLIBC_2.27"}}, [])]
    assert platform_tag(found) == "manylinux_2_35_x86_64" == platform_tag(found, "manylinux_2_35_x86_64")
    assert platform_tag(found, "manylinux_2_36_x86_64") == "manylinux_2_36_x86_64"
    for wrong in ("manylinux_2_34_x86_64", "manylinux_2_4_x86_64", "linux_x86_64", "manylinux2014_x86_64"):
        try:
            platform_tag(found, wrong)
            raise AssertionError(f"{wrong} passes")
        except Unpackable:
            pass


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", nargs="?", choices=["wheel", "install"])
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/graspmill")
    parser.add_argument("--library", type=Path, default=ROOT / ".deps/mujoco" / LIBRARY)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="DIR", help="folder of the wheel")
    parser.add_argument("--tag", metavar="TAG", help="tag of the wheel's platform")
    parser.add_argument("--prefix", type=Path, default=Path("/usr/local"), help="of the installation; an absolute path")
    parser.add_argument("--destdir", type=Path, metavar="DIR", help="folder that the prefix is below, for packagers")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        for module in (elf, licences):
            module.self_test()
        self_test()
        return
    if options.verb is None:
        parser.error("name a verb: wheel or install")
    if not options.prefix.is_absolute():
        parser.error(f"--prefix {options.prefix}: give an absolute path")
    try:
        library = checked_library(options.library)
        if options.verb == "wheel":
            made = make_wheel(options.program, library, options.tag, options.out)
            print(f"{made}: {made.stat().st_size / 1e6:.1f} MB")
        else:
            print(f"installed: {install(options.program, library, options.prefix, options.destdir) / 'bin/graspmill'}")
    except (Unpackable, licences.Unlistable, elf.NotElf, OSError) as error:
        print(f"package: {error}", file=sys.stderr)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()

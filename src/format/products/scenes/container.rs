//! Containers of scenes.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::codec::{
    RecordError,
    fields::{lengthy, named, ranged},
    wire,
};
use kernel::{
    geom::{Aabb, TriMesh},
    ids::Digest,
};

/// Container of a scene, around the world's origin: the middle of its floor, z up except for a tilt.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneContainer {
    /// The plane z = 0, with a rectangle that bodies do not leave.
    Plane {
        /// Sides of the rectangle along x and y [m].
        size: [f64; 2],
    },
    /// An open box.
    Bin {
        /// Room inside [m].
        inner: [f64; 3],
        /// Thickness of walls and floor [m].
        wall: f64,
        /// Angle about x by which its side at positive y is raised [degree], below 90; 0 is upright.
        tilt_deg: f64,
    },
    /// An open container of any shape.
    Mesh {
        /// Walls, floor and the room inside.
        shape: Arc<ContainerMesh>,
        /// Angle about x by which its side at positive y is raised [degree], below 90; 0 is upright.
        tilt_deg: f64,
    },
}

/// The shape of an open container from a mesh, in its own frame [m]: the origin is the middle of its floor, z upward from it.
#[derive(Clone, Debug)]
pub struct ContainerMesh {
    mesh: TriMesh,
    inner: [f64; 3],
    digest: Digest,
}

/// Digest of the content.
impl PartialEq for ContainerMesh {
    fn eq(&self, other: &Self) -> bool {
        self.digest == other.digest
    }
}

impl ContainerMesh {
    /// Triangles of a container, at most: every record of a scene has them.
    pub const MAX_TRIANGLES: usize = 20_000;

    /// A mesh of walls and floor, and the sides along x, y and z of the upright box around the middle of its floor that is free of
    /// them [m].
    pub fn new(mesh: TriMesh, inner: [f64; 3]) -> Self {
        let [vertices, triangles] = bytes_of(&mesh);
        let sizes: Vec<u8> = inner.iter().flat_map(|size| size.to_le_bytes()).collect();
        let digest = Digest::hash_parts([b"container 1".as_slice(), &sizes, &vertices, &triangles]);
        Self { mesh, inner, digest }
    }

    /// Walls and floor.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Sides of the room inside [m].
    pub fn inner(&self) -> [f64; 3] {
        self.inner
    }

    /// Digest of shape and room.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// From a record: vertices (count, 3) f32 and triangles (count, 3) u32, little-endian.
    fn of_bytes(
        message: &'static str,
        [vertices, triangles]: [&[u8]; 2],
        inner: [f64; 3],
    ) -> Result<Self, RecordError> {
        lengthy(message, "container_vertices", vertices.len() / 12 * 12, vertices.len())?;
        lengthy(message, "container_triangles", triangles.len() / 12 * 12, triangles.len())?;
        let four = |bytes: &[u8]| <[u8; 4]>::try_from(bytes).expect("four bytes");
        let vertices: Vec<f32> = vertices.chunks_exact(4).map(|bytes| f32::from_le_bytes(four(bytes))).collect();
        let triangles: Vec<u32> = triangles.chunks_exact(4).map(|bytes| u32::from_le_bytes(four(bytes))).collect();
        let (vertices, triangles) = (vertices.as_chunks::<3>().0.to_vec(), triangles.as_chunks::<3>().0.to_vec());
        let count = triangles.len();
        let fits = (1..=Self::MAX_TRIANGLES).contains(&count);
        ranged(message, "container_triangles", count as f64, fits, "1 to 20,000 triangles")?;
        let strange = vertices.as_flattened().iter().find(|value| !value.is_finite());
        let number = f64::from(strange.copied().unwrap_or_default());
        ranged(message, "container_vertices", number, strange.is_none(), "finite")?;
        let beyond = triangles.as_flattened().iter().find(|index| **index as usize >= vertices.len());
        let index = f64::from(beyond.copied().unwrap_or_default());
        ranged(message, "container_triangles", index, beyond.is_none(), "indices of vertices")?;
        Ok(Self::new(TriMesh { vertices, triangles }, inner))
    }
}

/// Vertices and triangles as stored on disk.
fn bytes_of(mesh: &TriMesh) -> [Vec<u8>; 2] {
    [
        mesh.vertices.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect(),
        mesh.triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect(),
    ]
}

impl SceneContainer {
    /// Name on disk.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Bin { .. } => "bin",
            Self::Mesh { .. } => "mesh",
        }
    }

    /// Sides of the floor along x and y [m].
    pub fn floor(&self) -> [f64; 2] {
        match self {
            Self::Plane { size } => *size,
            Self::Bin { inner: [x, y, _], .. } => [*x, *y],
            Self::Mesh { shape, .. } => [shape.inner[0], shape.inner[1]],
        }
    }

    /// Sides of the room inside along the own frame's x, y and z [m]; `None` for a plane.
    pub fn inner(&self) -> Option<[f64; 3]> {
        match self {
            Self::Plane { .. } => None,
            Self::Bin { inner, .. } => Some(*inner),
            Self::Mesh { shape, .. } => Some(shape.inner),
        }
    }

    /// Angle about x by which the side at positive y is raised [degree].
    pub fn tilt_deg(&self) -> f64 {
        match self {
            Self::Plane { .. } => 0.0,
            Self::Bin { tilt_deg, .. } | Self::Mesh { tilt_deg, .. } => *tilt_deg,
        }
    }

    /// Pose of the container's own frame, whose z points upward from its floor.
    pub fn world_from_container(&self) -> IsometryMatrix3<f64> {
        IsometryMatrix3::rotation(Vector3::x() * self.tilt_deg().to_radians())
    }

    /// The mesh of its walls and floor, in the world [m]; `None` for a plane.
    pub fn mesh(&self) -> Option<TriMesh> {
        let mut mesh = match self {
            Self::Plane { .. } => return None,
            Self::Bin { inner, wall, .. } => TriMesh::open_box(*inner, *wall),
            Self::Mesh { shape, .. } => shape.mesh.clone(),
        };
        if self.tilt_deg() != 0.0 {
            let world_from_container = self.world_from_container();
            for corner in &mut mesh.vertices {
                let placed = world_from_container * Point3::from(corner.map(f64::from));
                *corner = placed.coords.map(|v| v as f32).into();
            }
        }
        Some(mesh)
    }

    /// The box around the room inside, in the world [m]; `None` for a plane.
    pub fn room(&self) -> Option<Aabb> {
        let [x, y, z] = self.inner()?;
        let world_from_container = self.world_from_container();
        let corners = (0..8).map(|index| {
            let [a, b, c] = [0, 1, 2].map(|bit| f64::from(index >> bit & 1));
            world_from_container * Point3::new((a - 0.5) * x, (b - 0.5) * y, c * z)
        });
        let first = world_from_container * Point3::origin();
        Some(corners.fold(Aabb { min: first, max: first }, |room, corner| Aabb {
            min: room.min.inf(&corner),
            max: room.max.sup(&corner),
        }))
    }

    /// Height of the table below it [m]: that of a plane, or of a container's lowest corner.
    pub fn table_z(&self) -> f64 {
        let rotation = self.world_from_container().rotation;
        let [cosine, sine] = [rotation[(2, 2)], rotation[(2, 1)]];
        match self {
            Self::Plane { .. } => 0.0,
            Self::Bin { inner: [_, y, _], wall, .. } => -wall * cosine - (y / 2.0 + wall) * sine,
            Self::Mesh { shape, .. } => {
                let height = |[_, y, z]: &[f32; 3]| f64::from(*z) * cosine + f64::from(*y) * sine;
                shape.mesh.vertices.iter().map(height).fold(0.0, f64::min)
            }
        }
    }

    /// Sizes as stored on disk [m], followed by the tilt of a tilted bin or mesh [degree].
    pub fn sizes(&self) -> Vec<f64> {
        let mut sizes = match self {
            Self::Plane { size } => size.to_vec(),
            Self::Bin { inner: [x, y, z], wall, .. } => vec![*x, *y, *z, *wall],
            Self::Mesh { shape, .. } => shape.inner.to_vec(),
        };
        let tilt_deg = self.tilt_deg();
        if tilt_deg != 0.0 {
            sizes.push(tilt_deg);
        }
        sizes
    }

    /// Bytes that differ between containers of one name: their sizes, and the digest of a mesh.
    pub fn identity(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.sizes().into_iter().flat_map(f64::to_le_bytes).collect();
        if let Self::Mesh { shape, .. } = self {
            bytes.extend(shape.digest.0);
        }
        bytes
    }

    /// Appends the mesh to a record, as these fields of vertices and triangles; nothing for other containers.
    pub(crate) fn encode_mesh(&self, out: &mut Vec<u8>, fields: [u32; 2]) {
        if let Self::Mesh { shape, .. } = self {
            let [vertices, triangles] = bytes_of(&shape.mesh);
            wire::bytes(out, fields[0], &vertices);
            wire::bytes(out, fields[1], &triangles);
        }
    }

    /// The container of a name, sizes and the bytes of a mesh in a record of this message.
    pub(crate) fn of(message: &'static str, name: &str, sizes: &[f64], mesh: [&[u8]; 2]) -> Result<Self, RecordError> {
        let fits = sizes.iter().find(|size| !(**size > 0.0 && size.is_finite()));
        ranged(message, "container_size", fits.copied().unwrap_or(1.0), fits.is_none(), "above 0")?;
        named(message, "container", name, &["plane", "bin", "mesh"])?;
        let own = match name {
            "plane" => 2,
            "bin" => 4,
            _ => 3,
        };
        let is_tilted = name != "plane" && sizes.len() == own + 1;
        lengthy(message, "container_size", own + usize::from(is_tilted), sizes.len())?;
        let tilt_deg = if is_tilted { sizes[own] } else { 0.0 };
        ranged(message, "container_size", tilt_deg, tilt_deg < 90.0, "a tilt below 90 degrees")?;
        Ok(match (name, sizes) {
            ("plane", _) => Self::Plane { size: [sizes[0], sizes[1]] },
            ("bin", [x, y, z, wall, ..]) => Self::Bin { inner: [*x, *y, *z], wall: *wall, tilt_deg },
            _ => {
                let inner = [sizes[0], sizes[1], sizes[2]];
                Self::Mesh { shape: Arc::new(ContainerMesh::of_bytes(message, mesh, inner)?), tilt_deg }
            }
        })
    }
}

//! One object before the camera of `scenes/single_view.xml`, compiled by MuJoCo.

use std::sync::Arc;

use mujoco_rs::wrappers::{
    mj_data::MjData,
    mj_editing::{MjSpec, MjsBody, MjsGeom},
    mj_model::{MjModel, MjtGeomBase, MjtObjBase},
};
use nalgebra::Point3;

use crate::{
    convert::{pose_from, quaternion},
    error::SimError,
    ffi,
    objects::mesh::{Inertia, add_mesh},
};
use kernel::geom::{CameraCv, CameraGl, Intrinsics, Object, Pose, TriMesh, World};

/// The scene is built into the program, so that a job needs no file for it.
const SCENE: &str = include_str!("single_view.xml");

/// Lights in addition to the one at the camera.
pub const LIGHTS: usize = 2;

/// Pixels along each side of the map of a light's shadows.
const SHADOW_PIXELS: i32 = 4096;

/// One object before the camera of `scenes/single_view.xml`, compiled. Shared by threads.
#[derive(Debug)]
pub struct SimModel {
    pub(crate) model: Arc<MjModel>,
    /// Vertices of the object [m], for the projected box; `None` when the object has no end.
    vertices: Option<Vec<[f32; 3]>>,
    pub(crate) world_from_camera: Pose<World, CameraCv>,
    pub(crate) camera: usize,
    /// Where lights throw shadows; `None` where they throw none.
    pub(crate) shadows: Option<Shadowed>,
}

/// Distances that the lights of a scene have to cover for its shadows [m].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadowed {
    /// Distance from the world's origin within which there are shadows.
    pub(crate) reach: f64,
    /// Distance of the farthest vertex from the world's origin.
    pub(crate) span: f64,
}

impl SimModel {
    /// Compiles the scene with the mesh as its object; about 40 ms for 16,000 triangles. Nothing is written to disk.
    ///
    /// # Errors
    /// When MuJoCo cannot use the mesh.
    pub fn new(mesh: &TriMesh, inertia: Inertia) -> Result<Self, SimError> {
        Self::filled(mesh, inertia, |_| ())
    }

    /// Compiles the scene with the mesh as its object, and with lights, for [`crate::SimWorker::gl_colours`]; depth is as
    /// without.
    ///
    /// # Errors
    /// When MuJoCo cannot use the mesh.
    pub fn with_lights(mesh: &TriMesh, inertia: Inertia) -> Result<Self, SimError> {
        Self::filled(mesh, inertia, add_lights)
    }

    /// Compiles meshes that are fixed in one world as one object, whose frame is that world, with lights that throw shadows within
    /// `reach` [m] of its origin, for [`crate::SimWorker::gl_scene_colours`]. Parts are painted in their order.
    ///
    /// # Errors
    /// When MuJoCo cannot use one of the meshes.
    pub fn of_scene<'m>(
        parts: impl IntoIterator<Item = (&'m TriMesh, Pose<World, Object>)>,
        reach: f64,
    ) -> Result<Self, SimError> {
        let parts: Vec<_> = parts.into_iter().collect();
        parts.iter().try_for_each(|(mesh, _)| check(mesh))?;
        let distances = parts.iter().flat_map(|(mesh, world_from_part)| {
            mesh.vertices.iter().map(|vertex| world_from_part.point(&Point3::from(vertex.map(f64::from))).coords.norm())
        });
        let span = distances.fold(0.0, f64::max);
        let mut model = Self::compile(|spec| {
            add_lights(spec);
            let visual = spec.visual_mut();
            visual.quality.shadowsize = SHADOW_PIXELS;
            visual.map.shadowclip = reach as f32;
            for (number, (mesh, world_from_part)) in parts.iter().enumerate() {
                let name = format!("part{number}");
                add_mesh(spec, &name, mesh, Inertia::Shell);
                let geom = object_body(spec).add_geom();
                show_mesh(geom, &name);
                *geom.pos_mut() = (*world_from_part.translation()).into();
                *geom.quat_mut() = quaternion(world_from_part.isometry());
            }
        })?;
        model.shadows = Some(Shadowed { reach, span });
        Ok(model)
    }

    fn filled(mesh: &TriMesh, inertia: Inertia, more: impl FnOnce(&mut MjSpec)) -> Result<Self, SimError> {
        check(mesh)?;
        let mut model = Self::compile(|spec| {
            more(spec);
            add_mesh(spec, "object", mesh, inertia);
            show_mesh(object_body(spec).add_geom(), "object");
        })?;
        model.vertices = Some(mesh.vertices.clone());
        Ok(model)
    }

    pub(crate) fn compile(fill: impl FnOnce(&mut MjSpec)) -> Result<Self, SimError> {
        ffi::prepare_library();
        let refused = |error: mujoco_rs::error::MjEditError| SimError::Refused(error.to_string());
        let mut spec = MjSpec::from_xml_string(SCENE).map_err(refused)?;
        fill(&mut spec);
        let model = Arc::new(spec.compile().map_err(refused)?);
        let camera = model
            .name_to_id(MjtObjBase::mjOBJ_CAMERA, "depth")
            .ok_or_else(|| SimError::Refused("scenes/single_view.xml has lost its camera".into()))?;
        let mut data = MjData::new(Arc::clone(&model));
        data.forward();
        let world_from_camera: Pose<World, CameraGl> = pose_from(&data.cam_xpos()[camera], &data.cam_xmat()[camera]);
        let world_from_camera = world_from_camera * Pose::cv_from_gl().inverse();
        Ok(Self { model, vertices: None, world_from_camera, camera, shadows: None })
    }

    /// The part of the image that the object's vertices project into, a pixel wider on every side; the whole image
    /// where the object reaches behind the near plane.
    pub(crate) fn projected_box(&self, camera: &Intrinsics, camera_from_object: &Pose<CameraCv, Object>) -> PixelBox {
        let whole = PixelBox { left: 0, top: 0, right: camera.width, bottom: camera.height };
        let Some(vertices) = &self.vertices else { return whole };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for vertex in vertices {
            let point = camera_from_object.point(&Point3::from(vertex.map(f64::from)));
            if point.z < camera.near {
                return whole;
            }
            let (u, v) = camera.project(&point);
            low = [low[0].min(u), low[1].min(v)];
            high = [high[0].max(u), high[1].max(v)];
        }
        let clamp = |value: f64, max: u32| value.clamp(0.0, f64::from(max)) as u32;
        let left = clamp(low[0].floor() - 1.0, camera.width);
        let top = clamp(low[1].floor() - 1.0, camera.height);
        PixelBox {
            left,
            top,
            right: clamp(high[0].ceil() + 1.0, camera.width).max(left),
            bottom: clamp(high[1].ceil() + 1.0, camera.height).max(top),
        }
    }
}

/// Gives the scene of [`SimModel::with_lights`] its lights; each image sets their directions.
pub(crate) fn add_lights(spec: &mut MjSpec) {
    for _ in 0..LIGHTS {
        spec.world_body_mut().add_light();
    }
}

/// Makes a geom of a mesh that is only drawn.
fn show_mesh(geom: &mut MjsGeom, name: &str) {
    geom.set_type(MjtGeomBase::mjGEOM_MESH);
    geom.set_meshname(name);
    // Without contacts no convex hull is made.
    geom.set_contype(0);
    geom.set_conaffinity(0);
}

/// The body that the object hangs on.
pub(crate) fn object_body(spec: &mut MjSpec) -> &mut MjsBody {
    spec.body_mut("object").expect("scenes/single_view.xml has the body \"object\" (tested)")
}

fn check(mesh: &TriMesh) -> Result<(), SimError> {
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    if vertices < 4 || triangles < 1 {
        return Err(SimError::TooSmall { vertices, triangles });
    }
    // MuJoCo counts up to nine numbers a face in 32 bits.
    if vertices.max(triangles) > i32::MAX as usize / 9 {
        return Err(SimError::TooLarge { vertices, triangles });
    }
    if let Some(vertex) = mesh.vertices.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
        return Err(SimError::NotFinite { vertex });
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= vertices) {
            return Err(SimError::NoSuchVertex { triangle, vertex, vertices });
        }
    }
    Ok(())
}

/// Pixels from (left, top) up to, but without, (right, bottom).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PixelBox {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) right: u32,
    pub(crate) bottom: u32,
}

impl PixelBox {
    pub(crate) fn width(&self) -> u32 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> u32 {
        self.bottom - self.top
    }
}

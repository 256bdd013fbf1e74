//! One image of a scene: every body alone, the nearest in front, then what a sensor makes of it.

use nalgebra::{Point3, Vector3};

use super::{loaded::LoadedMesh, settings::ViewSettings};
use crate::products::{settled::SettledScene, surroundings::SceneFixtures};
use format::{NearBody, PixelMask, SceneContainer, SceneImage, SceneInstance};
use kernel::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, SimdLevel, World},
    render::{LayeredImage, SensorModel, SensorScratch},
    seed::Stream,
};
use std::sync::Arc;

/// A scene with its meshes.
pub(super) struct SceneMeshes {
    /// One per body, in order.
    pub bodies: Vec<Arc<LoadedMesh>>,
    /// The container; `None` for a plane.
    pub container: Option<LoadedMesh>,
    /// The table's top.
    pub table: LoadedMesh,
    /// Height of the table [m].
    table_z: f64,
}

impl SceneMeshes {
    /// The meshes of a scene on a table of these sides [m].
    pub fn new(bodies: Vec<Arc<LoadedMesh>>, container: &SceneContainer, table: [f64; 2]) -> Self {
        let SceneFixtures { container, table, table_z } = SceneFixtures::new(container, table);
        Self { bodies, container: container.map(LoadedMesh::of_mesh), table: LoadedMesh::of_mesh(table), table_z }
    }

    /// The point at which cameras point: the mean of the centres of the bodies' boxes.
    pub fn middle(&self, scene: &SettledScene) -> Point3<f64> {
        let centres = self.bodies.iter().zip(&scene.bodies).map(|(mesh, (_, pose))| pose.point(&mesh.render.centre()));
        let sum = centres.fold(Vector3::zeros(), |sum, centre| sum + centre.coords);
        Point3::from(sum / self.bodies.len() as f64)
    }

    /// Whether a point in the world is inside or next to something.
    pub fn is_near(&self, scene: &SettledScene, point: &Point3<f64>, clearance: f64, level: SimdLevel) -> bool {
        let mut bodies = self.bodies.iter().zip(&scene.bodies);
        point.z < self.table_z + clearance
            || self.container.as_ref().is_some_and(|mesh| mesh.is_near(point, clearance, level))
            || bodies.any(|(mesh, (_, pose))| mesh.is_near(&pose.inverse().point(point), clearance, level))
    }
}

/// Makes images; its memory is used again.
pub(super) struct ImageMaker {
    image: LayeredImage,
    sensor: SensorScratch,
    /// Depth of the whole image, after the sensor [m].
    pub depth: DepthCrop,
    /// The record.
    pub record: SceneImage,
}

impl ImageMaker {
    /// A maker of images.
    pub fn new(camera: Intrinsics, table: [f64; 2], scene: &SettledScene, level: SimdLevel) -> Self {
        let record = SceneImage {
            sample: kernel::ids::SampleId::of_object(scene.id, kernel::ids::ItemId(0)),
            camera,
            world_from_camera: Pose::identity(),
            container: scene.container.clone(),
            table,
            bodies: Vec::new(),
            instances: Vec::new(),
            point_instances: None,
            near_draws: 0,
            unseen_draws: 0,
        };
        let image = LayeredImage::new(camera, level);
        Self { image, sensor: SensorScratch::with_sources(level), depth: DepthCrop::default(), record }
    }

    /// Renders a scene: fills the record but for its sample and its draws.
    pub fn render(
        &mut self,
        scene: &SettledScene,
        meshes: &SceneMeshes,
        camera: &Intrinsics,
        world_from_camera: &Pose<World, CameraCv>,
    ) {
        let Self { image, record, .. } = self;
        let camera_from_world = world_from_camera.inverse();
        image.begin(*camera);
        record.bodies.resize_with(scene.bodies.len(), || SceneInstance {
            object: scene.bodies[0].0,
            world_from_object: Pose::identity(),
            pixels_all: 0,
            pixels_visible: 0,
            whole_box: [0; 4],
            visible_box: [0; 4],
            mask: PixelMask::default(),
            near: None,
        });
        let bodies = scene.bodies.iter().zip(&meshes.bodies).zip(&mut record.bodies);
        for (number, (((object, world_from_object), mesh), body)) in (1..).zip(bodies) {
            let camera_from_object = camera_from_world * *world_from_object;
            body.mask.set(image.add(&mesh.render, &camera_from_object, number));
            let silhouette = image.silhouette(&mesh.render, &camera_from_object);
            let [left, top, right, bottom] = silhouette.bounds;
            (body.object, body.world_from_object) = (*object, *world_from_object);
            (body.pixels_all, body.whole_box) = (silhouette.pixels, [left, top, right - left, bottom - top]);
        }
        // Container and table are fixed in the world.
        let camera_from_fixed: Pose<CameraCv, Object> = Pose::from_isometry(*camera_from_world.isometry());
        if let Some(container) = &meshes.container {
            image.add(&container.render, &camera_from_fixed, SceneImage::CONTAINER);
        }
        image.add(&meshes.table.render, &camera_from_fixed, SceneImage::TABLE);
        record.instances.clear();
        record.instances.extend_from_slice(image.instances());
        let visible = SceneImage::visible(&record.instances, camera.width, record.bodies.len());
        for (body, (pixels, visible_box)) in record.bodies.iter_mut().zip(visible) {
            (body.pixels_visible, body.visible_box) = (pixels, visible_box);
        }
        (record.camera, record.world_from_camera) = (*camera, *world_from_camera);
        record.container.clone_from(&scene.container);
        image.depth(&mut self.depth);
    }

    /// Measures the depth by a sensor, and records which body each depth is of, and which bodies are too near.
    pub fn measure(&mut self, model: &SensorModel, stream: &mut Stream) {
        let Self { image, sensor, depth, record } = self;
        let near = nearness(&record.instances, &depth.depth, record.bodies.len(), model.range()[0] as f32);
        for (body, near) in record.bodies.iter_mut().zip(near) {
            body.near = Some(near);
        }
        model.apply_with(sensor, image.camera(), depth, stream);
        let of_point = |(depth, source): (&f32, &u32)| match *source {
            _ if depth.is_nan() => SceneImage::NOTHING,
            SensorScratch::BETWEEN => SceneImage::BETWEEN,
            source => record.instances[source as usize],
        };
        record.point_instances = Some(depth.depth.iter().zip(sensor.sources()).map(of_point).collect());
    }
}

/// Nearness of each body to a sensor that measures from a depth on [m]: by what each pixel sees, and its true depth [m].
fn nearness(instances: &[u8], depths: &[f32], bodies: usize, measures_from: f32) -> Vec<NearBody> {
    let mut near = vec![NearBody::default(); bodies];
    for (instance, depth) in instances.iter().zip(depths) {
        if let Some(body) = near.get_mut(usize::from(*instance).wrapping_sub(1)) {
            body.pixels += u32::from(*depth < measures_from);
            body.nearest = if body.nearest == 0.0 { *depth } else { body.nearest.min(*depth) };
        }
    }
    near
}

/// Views count bodies that are seen by the most pixels.
pub(super) fn most_seen(record: &SceneImage) -> u32 {
    record.bodies.iter().map(|body| body.pixels_visible).max().unwrap_or(0)
}

/// Whether a view satisfies the settings.
pub(super) fn sees_enough(record: &SceneImage, settings: &ViewSettings) -> bool {
    most_seen(record) >= settings.min_pixels
}

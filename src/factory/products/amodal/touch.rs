//! Surroundings of a body in a scene, as touch meets them.

use super::{image::ViewImage, scene::LoadedScene};
use crate::products::pair::touch::TouchObstacles;
use format::{SceneImage, VoxelPair};
use kernel::geom::Pose;

/// Everything else in the scene of a pair: other bodies, container and table. Empty if the job has no touch.
pub(super) fn obstacles<'a>(
    LoadedScene { bodies, still }: &'a LoadedScene<'_>,
    image: &ViewImage,
    pair: &'a VoxelPair,
) -> TouchObstacles<'a> {
    let mut around = TouchObstacles::default();
    for (number, (body, object)) in (1..).zip(image.record.bodies.iter().zip(bodies)) {
        let surface = object.touch.as_ref().filter(|_| u32::from(number) != pair.sample.instance);
        if let Some(surface) = surface {
            let is_solid = object.pair.kernel.render.culls_back_faces();
            around.add(number, surface, is_solid, &image.camera_from_object(body));
        }
    }
    if let Some(container) = &still.container_touch {
        let camera_from_world = pair.world_from_camera.inverse();
        around.add(SceneImage::CONTAINER, container, true, &Pose::from_isometry(*camera_from_world.isometry()));
    }
    around.set_table(SceneImage::TABLE, &still.table_touch, still.table_z, &pair.world_from_camera);
    around
}

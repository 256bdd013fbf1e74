//! Images of views, drawn again: their exact depth, which the views themselves keep in steps, or as a sensor measured it.

use format::SceneImage;
use kernel::{
    geom::{CameraCv, DepthCrop, Object, Pose, RenderMesh},
    render::LayeredImage,
};

/// Renders the depth of an image of a scene whose bodies have these meshes, with its container, if it has one, and its
/// table. Returns whether each pixel sees the same body as in the image.
pub fn redraw<'m>(
    image: &mut LayeredImage,
    record: &SceneImage,
    bodies: impl Iterator<Item = &'m RenderMesh>,
    (container, table): (Option<&RenderMesh>, &RenderMesh),
    depth: &mut DepthCrop,
) -> bool {
    let camera_from_world = record.world_from_camera.inverse();
    image.begin(record.camera);
    for (number, (body, mesh)) in (1..).zip(record.bodies.iter().zip(bodies)) {
        image.add(mesh, &(camera_from_world * body.world_from_object), number);
    }
    let camera_from_fixed: Pose<CameraCv, Object> = Pose::from_isometry(*camera_from_world.isometry());
    if let Some(container) = container {
        image.add(container, &camera_from_fixed, SceneImage::CONTAINER);
    }
    image.add(table, &camera_from_fixed, SceneImage::TABLE);
    image.depth(depth);
    image.instances() == record.instances
}

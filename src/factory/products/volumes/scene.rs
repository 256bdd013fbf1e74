//! The truth of a volume: what is at the centre of every voxel.

use std::sync::Arc;

use super::settings::VolumeSettings;
use crate::products::surroundings::SceneFixtures;
use assets::object::PreparedObject;
use format::{SceneImage, VolumeTruth};
use kernel::{
    geom::{Object, Pose, Volume, World},
    voxel::{InsideOf, mark_inside},
};

/// Fills the numbers of the voxels of a scene whose bodies have these meshes. Where two bodies overlap, the first one has the voxel;
/// bodies come before the container, and both before what is below the table.
pub(super) fn fill_truth(
    settings: &VolumeSettings,
    image: &SceneImage,
    objects: &[Arc<PreparedObject>],
    truth: &mut VolumeTruth,
) {
    let grid = &settings.grid;
    let volume_from_world: Pose<Volume, World> = settings.world_from_volume().inverse();
    truth.resolution = grid.resolution;
    truth.instances.clear();
    truth.instances.resize(grid.voxels(), VolumeTruth::FREE);
    truth.bodies.clear();
    for (number, (body, object)) in (1..).zip(image.bodies.iter().zip(objects)) {
        let inside = match object.record().watertight {
            true => InsideOf::Closed(object.mesh()),
            false => InsideOf::Cells(object.solid()),
        };
        mark_inside(inside, &(volume_from_world * body.world_from_object), grid, number, &mut truth.instances);
        truth.bodies.push((body.object, body.world_from_object));
    }
    let SceneFixtures { container, table_z, .. } = SceneFixtures::new(&image.container, image.table);
    if let Some(container) = &container {
        let pose: Pose<Volume, Object> = Pose::from_isometry(*volume_from_world.isometry());
        mark_inside(InsideOf::Closed(container), &pose, grid, VolumeTruth::CONTAINER, &mut truth.instances);
    }
    // Layers of voxels whose centres are at the table's height or below.
    let n = grid.resolution;
    let below = (0..n).take_while(|z| grid.centre([0, 0, *z]).z - settings.support_height <= table_z).count();
    for column in truth.instances.chunks_exact_mut(n as usize) {
        column[..below].iter_mut().filter(|own| **own == VolumeTruth::FREE).for_each(|own| *own = VolumeTruth::TABLE);
    }
}

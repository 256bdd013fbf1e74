//! Pictures of a scene from above: one colour per body, lighter where it is higher, and depth.

use crate::picture::{DepthRange, FLOOR, InstanceMap, Picture, WALLS, depth_picture};
use format::{Scene, SceneOverview};
use kernel::geom::DepthCrop;

/// The instance map from above, at a whole zoom.
pub(super) fn instance_picture(overview: &SceneOverview, zoom: u32) -> Picture {
    let [width, height] = overview.size;
    let grey = |instance| match instance {
        0 => Some(FLOOR),
        SceneOverview::WALLS => Some(WALLS),
        _ => None,
    };
    let depth = |column, row| overview.depth(column, row);
    InstanceMap { width, height, instances: &overview.instances, depth: &depth, grey }.picture(zoom)
}

/// The depth from above.
pub(super) fn depth_from_above(overview: &SceneOverview, zoom: u32) -> Option<Picture> {
    let [width, height] = overview.size;
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let depth = pixels.map(|(column, row)| overview.depth(column, row)).collect();
    let crop = DepthCrop { left: 0, top: 0, width, height, depth };
    DepthRange::from_crop(&crop).map(|range| depth_picture(&crop, range, zoom))
}

/// One line about a scene: bodies, contacts, and the bodies that carry others.
pub(super) fn scene_words(scene: &Scene) -> String {
    let carriers: std::collections::BTreeSet<u32> =
        scene.supports.iter().map(|support| support.by).filter(|by| *by != format::CONTAINER).collect();
    let [bodies, contacts] = [scene.bodies.len(), scene.contacts.len()];
    if let Some(import) = &scene.import {
        let [depth, drift] = [scene.depths[0].max(scene.depths[1]), scene.facts().drift[0]].map(|length| 1e3 * length);
        return format!(
            "{bodies} bodies of {}, {contacts} contacts, up to {depth:.2} mm deep, {} intersecting pairs, largest motion from rest {drift:.1} mm",
            import.source, import.crossed
        );
    }
    format!(
        "{bodies} bodies, {contacts} contacts, {} of them carry others, at rest after {:.2} s",
        carriers.len(),
        scene.rest_time
    )
}

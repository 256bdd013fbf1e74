//! Geoms that are added to a description.

use mujoco_rs::wrappers::mj_editing::MjsGeom;

/// Removes from a geom the description's defaults.
pub(crate) fn drop_defaults(geom: &mut MjsGeom) {
    geom.set_contype(1);
    geom.set_conaffinity(1);
    geom.set_priority(0);
    geom.set_margin(0.0);
    geom.set_gap(0.0);
    geom.set_solmix(1.0);
}

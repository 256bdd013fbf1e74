//! Objects of amodal pairs, from the meshes of the views, shared by all threads.

use std::sync::Arc;

use super::settings::{AmodalJob, AmodalSettings};
use crate::{
    ProduceError,
    products::{
        pair::{PairObject, touch::TouchSurface},
        viewed::ViewMeshes,
    },
    recent::Recent,
};
use kernel::{
    contact::ContactSurface,
    geom::{RenderMesh, SimdLevel},
    ids::ObjectId,
};

/// Objects that are kept, at most: about 5 MB each.
const KEPT: usize = 128;

/// An object, ready for pairs and for images of scenes.
pub(super) struct LoadedObject {
    /// Surface and solid.
    pub pair: PairObject,
    /// The surface with both its sides, as views are drawn.
    pub render: RenderMesh,
    /// The surface for touch, if the job has touch.
    pub touch: Option<TouchSurface>,
    /// The true mesh for hands, if the job has a hand.
    pub contact: Option<Arc<ContactSurface>>,
}

/// Objects of the views.
pub(super) struct LoadedObjects {
    meshes: ViewMeshes,
    recent: Recent<LoadedObject>,
}

impl LoadedObjects {
    /// Opens the meshes of the views.
    ///
    /// # Errors
    /// When they are missing, or a row of the table of assets is invalid.
    pub fn open(job: &AmodalJob) -> Result<Self, ProduceError> {
        Ok(Self { meshes: ViewMeshes::open(&job.dataset, &job.views)?, recent: Recent::new(KEPT) })
    }

    /// An object.
    ///
    /// # Errors
    /// When it is not among the meshes, or the mesh has another content.
    pub fn get(
        &self,
        object: ObjectId,
        settings: &AmodalSettings,
        level: SimdLevel,
    ) -> Result<Arc<LoadedObject>, ProduceError> {
        self.recent.get(self.meshes.index_of(object)?, || {
            let prepared = self.meshes.prepared(object)?;
            let AmodalSettings { solid_with_surface, rules, channels, touch, .. } = settings;
            let contact = touch.by_hand.as_ref().map(|_| prepared.contact_surface().map(Arc::clone)).transpose();
            Ok(LoadedObject {
                pair: PairObject::new(&prepared, *solid_with_surface, rules.truth, channels, level),
                render: RenderMesh::new(prepared.mesh(), false),
                touch: touch.is_asked().then(|| TouchSurface::of_tree(prepared.tree(), level)),
                contact: contact.map_err(|error| ProduceError::unusable(object.0.short(), error))?,
            })
        })
    }
}

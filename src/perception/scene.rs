//! A segmented picture: its plane, the objects on it, and those that cannot be completed.

use kernel::geom::TriMesh;

use crate::{
    clusters::{Cluster, ClusterRule, clusters_of},
    frame::DepthFrame,
    labels::LabelImage,
    partition::{PartitionRule, parts_of},
    plane::{Plane, PlaneRule, plane_of},
    sheet::visible_sheet,
};

/// Source of the support plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaneChoice {
    /// Found in the picture.
    Find(PlaneRule),
    /// Known before.
    Given(Plane),
    /// There is none: all points belong to objects.
    Without,
}

/// Rules by which a picture is taken apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneRule {
    /// The plane.
    pub plane: PlaneChoice,
    /// Objects on it.
    pub clusters: ClusterRule,
    /// Cut between objects that touch; `None` for the clusters by distance alone.
    pub partition: Option<PartitionRule>,
}

impl Default for SceneRule {
    fn default() -> Self {
        let clusters = ClusterRule { tolerance: PartitionRule::GAP, ..ClusterRule::default() };
        Self { plane: PlaneChoice::Find(PlaneRule::default()), clusters, partition: Some(PartitionRule::default()) }
    }
}

/// A picture with its plane and the clusters on it.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentedScene {
    /// The picture.
    pub frame: DepthFrame,
    /// The support plane; `None` if none was found or requested.
    pub plane: Option<Plane>,
    /// Objects, the largest first.
    pub clusters: Vec<Cluster>,
}

/// Why a cluster is no object that can be completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The picture shows a part of it.
    #[error("the picture's border cuts it")]
    AtBorder,
    /// No two neighbouring pixels of it see one surface.
    #[error("no triangle fits on its pixels, which all lie apart in depth")]
    NoSurface,
}

impl SegmentedScene {
    /// Takes a picture apart.
    ///
    /// # Panics
    /// If the clusters' tolerance is not positive.
    pub fn segment(frame: DepthFrame, rule: &SceneRule) -> Self {
        let points = frame.points();
        let plane = match rule.plane {
            PlaneChoice::Find(rule) => plane_of(&points, &rule),
            PlaneChoice::Given(plane) => Some(plane),
            PlaneChoice::Without => None,
        };
        assert!(rule.clusters.tolerance > 0.0, "a tolerance");
        let clusters = match &rule.partition {
            Some(partition) => parts_of(&frame, &points, plane.as_ref(), &rule.clusters, partition),
            None => clusters_of(&frame, &points, plane.as_ref(), &rule.clusters),
        };
        Self { frame, plane, clusters }
    }

    /// Puts an object whose pixels are known before the others, which lose these pixels; those left with fewer than this number
    /// points go.
    pub fn put_first(&mut self, pixels: Vec<u32>, min_points: usize) {
        for cluster in &mut self.clusters {
            cluster.pixels.retain(|pixel| pixels.binary_search(pixel).is_err());
        }
        self.clusters.retain(|cluster| cluster.pixels.len() >= min_points.max(1));
        self.clusters.insert(0, Cluster::of_pixels(&self.frame, pixels));
    }

    /// Labels of the given picture: n the n-th cluster, [`crate::PLANE_LABEL`] what lies within `reach` of the plane [m], 0 all
    /// else.
    pub fn labels(&self, reach: f64) -> LabelImage {
        LabelImage::of_scene(&self.frame, &self.clusters, self.plane.as_ref(), reach)
    }

    /// The visible surface of each cluster, in `CameraCv` [m].
    pub fn sheets(&self) -> Vec<TriMesh> {
        self.clusters.iter().map(|cluster| visible_sheet(&self.frame, &cluster.pixels)).collect()
    }
}

impl Refusal {
    /// Why a cluster with this visible surface cannot be completed; `None` if it can.
    pub fn from_cluster(cluster: &Cluster, sheet: &TriMesh) -> Option<Self> {
        if cluster.touches_border {
            Some(Self::AtBorder)
        } else {
            sheet.triangles.is_empty().then_some(Self::NoSurface)
        }
    }
}

//! A segmented picture: its plane, the objects on it, and those that cannot be completed.

use kernel::geom::TriMesh;
use nalgebra::{Point3, Vector3};

use crate::{
    clusters::{Cluster, ClusterRule, clusters_of},
    contact::{Outline, outlines_of},
    container::{Container, ContainerChoice, Region, container_of},
    cuboid::OrientedBox,
    frame::DepthFrame,
    input::without_outliers,
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
#[derive(Clone, Debug, PartialEq)]
pub struct SceneRule {
    /// The plane.
    pub plane: PlaneChoice,
    /// The container that the objects are in; found only if there is a plane to find or given.
    pub container: ContainerChoice,
    /// Objects on it.
    pub clusters: ClusterRule,
    /// Cut between objects that touch; `None` for the clusters by distance alone.
    pub partition: Option<PartitionRule>,
}

impl Default for SceneRule {
    fn default() -> Self {
        let clusters = ClusterRule { tolerance: PartitionRule::GAP, ..ClusterRule::default() };
        Self {
            plane: PlaneChoice::Find(PlaneRule::default()),
            container: ContainerChoice::Find,
            clusters,
            partition: Some(PartitionRule::default()),
        }
    }
}

/// A picture with its plane and the clusters on it.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentedScene {
    /// The picture.
    pub frame: DepthFrame,
    /// The support plane, a container's floor if there is one; `None` if none was found or requested.
    pub plane: Option<Plane>,
    /// The container that the objects are in.
    pub container: Option<Container>,
    /// Pixels of its walls and rim, in order.
    pub container_pixels: Vec<u32>,
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
        let container = match (&rule.container, rule.plane) {
            (ContainerChoice::Given(container), _) => Some(container.clone()),
            (ContainerChoice::Without, _) | (_, PlaneChoice::Without) => None,
            (ContainerChoice::Find, choice) => {
                container_of(&frame, &points, plane.as_ref(), matches!(choice, PlaneChoice::Given(_)))
            }
        };
        let plane = container.as_ref().map_or(plane, |container| Some(container.floor));
        let (points, container_pixels) = without_container(points, container.as_ref(), rule.clusters.min_height);
        let clusters = match &rule.partition {
            Some(partition) => parts_of(&frame, &points, plane.as_ref(), &rule.clusters, partition),
            None => clusters_of(&frame, &points, plane.as_ref(), &rule.clusters),
        };
        Self { frame, plane, container, container_pixels, clusters }
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

    /// Labels of the given picture: n the n-th cluster, [`crate::CONTAINER_LABEL`] a container's walls and rim,
    /// [`crate::PLANE_LABEL`] other points within `reach` of the plane [m], 0 all else.
    pub fn labels(&self, reach: f64) -> LabelImage {
        LabelImage::of_scene(&self.frame, &self.clusters, &self.container_pixels, self.plane.as_ref(), reach)
    }

    /// Unit vector against gravity, in `CameraCv`: the plane's normal; without a plane the camera is held upright.
    pub fn up(&self) -> Vector3<f64> {
        self.plane.map_or(-Vector3::y(), |plane| plane.normal)
    }

    /// The box of smallest footprint around the points of a cluster, without single points off its surface, in `CameraCv`: around
    /// what was seen, not around the whole object. `None` if all points are such.
    pub fn box_of(&self, cluster: &Cluster) -> Option<OrientedBox> {
        let pixels = without_outliers(&self.frame, &cluster.pixels);
        let points: Vec<Point3<f64>> = pixels.iter().map(|pixel| self.frame.point(*pixel)).collect();
        OrientedBox::around(&points, &self.up())
    }

    /// The outline of each cluster: its confidence, and the things that the object leans on. Points up to `gap` apart touch [m];
    /// points up to `reach` above the plane belong to it [m].
    pub fn outlines(&self, gap: f64, reach: f64) -> Vec<Outline> {
        outlines_of(&self.frame, &self.clusters, &self.container_pixels, self.plane.as_ref(), [gap, reach])
    }

    /// The visible surface of each cluster, in `CameraCv` [m].
    pub fn sheets(&self) -> Vec<TriMesh> {
        self.clusters.iter().map(|cluster| visible_sheet(&self.frame, &cluster.pixels)).collect()
    }
}

/// Points inside of a container, and the pixels of its walls and rim above `min_height` [m].
fn without_container(
    mut points: Vec<(u32, Point3<f64>)>,
    container: Option<&Container>,
    min_height: f64,
) -> (Vec<(u32, Point3<f64>)>, Vec<u32>) {
    let mut walls = Vec::new();
    if let Some(container) = container {
        points.retain(|(pixel, point)| match container.region(point) {
            Region::Inside => true,
            Region::Outside => false,
            Region::Wall => {
                if container.floor.height(point) > min_height {
                    walls.push(*pixel);
                }
                false
            }
        });
    }
    (points, walls)
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

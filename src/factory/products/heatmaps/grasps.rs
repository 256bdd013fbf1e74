//! Grasps of the bodies of a scene, as far as its images need them, and as one camera sees them.

use nalgebra::{Point3, Vector3};

use super::settings::HeatmapSettings;
use crate::products::{
    patches::{Fingertips, corner},
    picked::{BodyPicks, PickedHand, ScenePicks},
};
use format::{
    ForbiddenGrasp, PatchSquare, PickState, ProjectedPoint, SceneHeatmap, SeenGrasp, projection, window_side,
};
use kernel::geom::{CameraCv, DepthCrop, HandBase, Intrinsics, Pose, World};

/// The hand of a job, and the types that are marked.
pub(super) struct MarkedHand {
    pub hand: PickedHand,
    pub tips: Fingertips,
    /// The chosen types; of a hand without types none.
    pub types: Vec<u32>,
}

/// Grasps of the bodies of one scene.
pub(super) struct SceneGrasps {
    /// Whether the dataset of picks has grasps of each body.
    pub evaluated: Vec<bool>,
    grasps: Vec<SceneGrasp>,
}

/// A candidate, in `World`.
struct SceneGrasp {
    /// Number of the body, and index of the candidate.
    key: [u32; 2],
    /// Direction of the approach.
    approach: Vector3<f64>,
    palm: Point3<f64>,
    end: GraspEnd,
}

/// End of a candidate.
enum GraspEnd {
    /// A free one.
    Free(FreeGrasp),
    /// A free one of a type that is not marked.
    OtherType,
    /// A forbidden one, by the number of what forbids it.
    Forbidden(u8),
}

struct FreeGrasp {
    /// Run, rank and direction of the stored grasp.
    stored: [u32; 3],
    type_index: u32,
    state: PickState,
    world_from_base: Pose<World, HandBase>,
    tips: Vec<Point3<f64>>,
}

impl SceneGrasps {
    /// The grasps of a scene.
    pub fn new(picks: &ScenePicks, marked: &MarkedHand) -> Self {
        let grasps = picks.bodies.iter().flat_map(|body| grasps_of(body, marked)).collect();
        Self { evaluated: picks.evaluated.clone(), grasps }
    }

    /// Fills the rows of an image whose camera and head are set, from the grasps that approach from about the camera's
    /// direction.
    pub fn mark(&self, settings: &HeatmapSettings, depth: &DepthCrop, heatmap: &mut SceneHeatmap) {
        let axis = heatmap.world_from_camera.rotation() * Vector3::z();
        let least = libm::cos(settings.max_angle);
        let camera_from_world = heatmap.world_from_camera.inverse();
        heatmap.grasps.clear();
        heatmap.forbidden.clear();
        heatmap.evaluated.clone_from(&self.evaluated);
        heatmap.other_types = 0;
        for grasp in self.grasps.iter().filter(|grasp| grasp.approach.dot(&axis) >= least) {
            let [body, candidate] = grasp.key;
            match &grasp.end {
                GraspEnd::Free(free) => {
                    let (camera, points) = (&heatmap.camera, std::iter::once(&grasp.palm).chain(&free.tips));
                    let surface = |[column, row]: [u32; 2]| depth.at(column, row);
                    let points: Vec<ProjectedPoint> =
                        points.map(|point| ProjectedPoint::new(*point, camera, &camera_from_world, surface)).collect();
                    let [run, rank, direction] = free.stored;
                    heatmap.grasps.push(SeenGrasp {
                        body,
                        candidate,
                        run,
                        rank,
                        direction,
                        type_index: free.type_index,
                        state: free.state,
                        value: settings.label.value(free.state),
                        world_from_base: free.world_from_base,
                        patches: squares(settings, camera, &camera_from_world, &points).unwrap_or_default(),
                        points,
                    });
                }
                GraspEnd::OtherType => heatmap.other_types += 1,
                GraspEnd::Forbidden(obstacle) => {
                    let pixel = projection(&heatmap.camera, &camera_from_world.point(&grasp.palm));
                    heatmap.forbidden.push(ForbiddenGrasp { body, candidate, obstacle: *obstacle, pixel });
                }
            }
        }
    }
}

fn grasps_of<'a>(body: &'a BodyPicks, marked: &'a MarkedHand) -> impl Iterator<Item = SceneGrasp> + 'a {
    let candidates = (0..).zip(&body.candidates.candidates).zip(body.states());
    candidates.map(move |((index, candidate), state)| {
        let approach = marked.hand.world_from_approach(candidate);
        let kind = |free: bool| if free { marked.hand.kind(candidate) } else { None };
        let end = match (candidate.ways.shaped.blocked, marked.type_index(kind(candidate.is_free()))) {
            (Some(blocked), _) => GraspEnd::Forbidden(blocked.by.number()),
            (None, None) => GraspEnd::OtherType,
            (None, Some(type_index)) => GraspEnd::Free(FreeGrasp {
                stored: [candidate.run, candidate.rank, candidate.direction],
                type_index,
                state,
                world_from_base: candidate.world_from_base,
                tips: marked.tips.points(&candidate.world_from_base, &candidate.closed),
            }),
        };
        SceneGrasp {
            key: [body.body, index],
            approach: approach.rotation() * Vector3::z(),
            palm: Point3::from(*approach.translation()),
            end,
        }
    })
}

impl MarkedHand {
    /// Index of a type among the marked ones; 0 of a hand without types.
    fn type_index(&self, kind: Option<u32>) -> Option<u32> {
        if !self.hand.has_types() {
            return Some(0);
        }
        self.types.iter().position(|chosen| Some(*chosen) == kind).map(|index| index as u32)
    }
}

/// The patches around the points of a grasp, as in jobs for patches; `None` where a square of one of them exceeds the
/// image.
fn squares(
    settings: &HeatmapSettings,
    camera: &Intrinsics,
    camera_from_world: &Pose<CameraCv, World>,
    points: &[ProjectedPoint],
) -> Option<Vec<PatchSquare>> {
    let placed = |[u, v]: [f64; 2], side| Some([corner(u, side, camera.width)?, corner(v, side, camera.height)?]);
    let square = |point: &ProjectedPoint| {
        let pixel = point.pixel?;
        let window = settings
            .size
            .map_or(0, |size| window_side(size, camera.fx, camera_from_world.point(&point.point.into()).z));
        let window_corner = if window > 0 { placed(pixel, window)? } else { [0; 2] };
        Some(PatchSquare { corner: placed(pixel, settings.side)?, window, window_corner })
    };
    points.iter().map(square).collect()
}

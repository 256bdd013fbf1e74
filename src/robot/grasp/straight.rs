//! Tests whether a tool without joints reaches a pose on an object along a straight line, with container and neighbours as obstacles.

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::{
    passage::{Free, Passage, PathObstacle, Surroundings, Thing, above_ground, things},
    probes::SolidProbes,
    table::STAND_OFF,
};
use kernel::{
    contact::{ContactScratch, Probe},
    geom::Shape,
    words::PathStage,
};

/// A solid of a tool.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSolid {
    /// The solid; no mesh.
    pub shape: Shape,
    /// Pose in the frame of the tool, which approaches along its z axis.
    pub tool_from_shape: IsometryMatrix3<f64>,
    /// Whether the solid may touch the target, as soft parts do. It keeps its distance from everything else.
    pub is_soft: bool,
}

/// Follows a tool along straight approaches through scenes, with the distances of [`HandPassage`](super::HandPassage) and the same
/// stand-off of [`STAND_OFF`]; the memory of one thread.
///
/// ```
/// use std::sync::Arc;
///
/// use kernel::{contact::ContactSurface, geom::{Shape, TriMesh}, voxel::InsideTest};
/// use nalgebra::{IsometryMatrix3, Vector3};
/// use graspmill_robot::grasp::{SceneObstacle, Surroundings, ToolPassage, ToolSolid};
///
/// // A tray on the ground, and a rod of 40 mm that approaches its floor from above.
/// let tray = ContactSurface::new(&TriMesh::open_box([0.1, 0.1, 0.02], 0.005), InsideTest::WindingNumber)?;
/// let tray = SceneObstacle {
///     surface: Arc::new(tray),
///     scene_from_obstacle: IsometryMatrix3::translation(0.0, 0.0, 0.005),
/// };
/// let scene = Surroundings { container: None, ground: 0.0, objects: vec![tray] };
/// let rod = ToolSolid {
///     shape: Shape::Cylinder { radius: 0.01, half: 0.02 },
///     tool_from_shape: IsometryMatrix3::translation(0.0, 0.0, -0.02),
///     is_soft: false,
/// };
/// let mut passage = ToolPassage::new(&[rod], 0.002);
/// let down = |x| IsometryMatrix3::translation(x, 0.0, 0.001)
///     * IsometryMatrix3::rotation(Vector3::x() * std::f64::consts::PI);
/// assert!(passage.follow(&scene, 0, &down(0.0)).blocked.is_none());
/// assert!(passage.follow(&scene, 0, &down(0.045)).blocked.is_some(), "the wall of the tray");
/// # Ok::<(), kernel::geom::NoSurface>(())
/// ```
pub struct ToolPassage {
    parts: Vec<Part>,
    margin: f64,
    scratch: ContactScratch,
}

/// A solid of the tool with its probes.
struct Part {
    probes: SolidProbes,
    sharp: Probe,
    tool_from_shape: IsometryMatrix3<f64>,
    is_soft: bool,
}

impl Part {
    /// Whether the part may touch a thing.
    fn may_touch(&self, thing: &Thing<'_>) -> bool {
        self.is_soft && thing.what == PathObstacle::Target
    }
}

impl ToolPassage {
    /// A tool that keeps at least a margin from everything but the target [m].
    ///
    /// # Panics
    /// When the margin is not at least 0 and below [`Passage::FAR`], or a solid is a mesh.
    pub fn new(solids: &[ToolSolid], margin: f64) -> Self {
        assert!((0.0..Passage::FAR).contains(&margin), "a margin of {margin} m");
        let part = |solid: &ToolSolid| Part {
            probes: SolidProbes::new(&solid.shape).expect("no mesh is a solid of a tool"),
            sharp: Probe::sharp(&solid.shape).expect("no mesh is a solid of a tool"),
            tool_from_shape: solid.tool_from_shape,
            is_soft: solid.is_soft,
        };
        Self { parts: solids.iter().map(part).collect(), margin, scratch: ContactScratch::default() }
    }

    /// Follows the tool to a pose on object `target`, from [`STAND_OFF`] back along its z axis. The stage `Pregrasp` means the pose
    /// itself, `Approach` the line to it.
    ///
    /// # Panics
    /// When there is no such object.
    pub fn follow(&mut self, scene: &Surroundings, target: usize, object_from_tool: &IsometryMatrix3<f64>) -> Passage {
        let scene_from_tool = scene.objects[target].scene_from_obstacle * object_from_tool;
        let things = things(scene, target, self.margin);
        let free = self
            .at_pose(scene, &things, &scene_from_tool)
            .and_then(|lowest| self.approaching(&things, &scene_from_tool, lowest));
        free.map_or_else(|blocked| blocked, |clearance| Passage { blocked: None, clearance })
    }

    /// The tool in its pose: its lowest point over the ground [m].
    fn at_pose(&mut self, scene: &Surroundings, things: &[Thing<'_>], scene_from_tool: &IsometryMatrix3<f64>) -> Free {
        let lowest = self.lowest(scene_from_tool) - scene.ground;
        above_ground(PathStage::Pregrasp, lowest, self.margin)?;
        for thing in things {
            let obstacle_from_tool = thing.obstacle.scene_from_obstacle.inverse() * scene_from_tool;
            let mut nearest = thing.margin;
            for part in self.parts.iter().filter(|part| !part.may_touch(thing)) {
                let distance = distance(part, thing, &obstacle_from_tool, nearest, &mut self.scratch);
                nearest = nearest.min(distance);
            }
            if nearest < thing.margin {
                return Err(thing.blocks(PathStage::Pregrasp, nearest));
            }
        }
        Ok(lowest)
    }

    /// The tool on its line, from the pose backwards: its smallest distance from anything but the target [m].
    fn approaching(&mut self, things: &[Thing<'_>], scene_from_tool: &IsometryMatrix3<f64>, lowest: f64) -> Free {
        let back = scene_from_tool.rotation * Vector3::z() * -STAND_OFF;
        // A straight line is lowest at one of its ends.
        let lowest = lowest + back.z.min(0.0);
        above_ground(PathStage::Approach, lowest, self.margin)?;
        let mut least = Passage::FAR.min(lowest);
        for thing in things {
            let obstacle_from_scene = thing.obstacle.scene_from_obstacle.inverse();
            let mut nearest = thing.told();
            for part in self.parts.iter().filter(|part| !part.may_touch(thing)) {
                let scratch = &mut self.scratch;
                let advanced = thing.advance(&mut nearest, 1.0, STAND_OFF, |come, reach| {
                    let moved = obstacle_from_scene * Translation3::from(back * come) * scene_from_tool;
                    distance(part, thing, &moved, reach, scratch)
                });
                advanced.map_err(|clearance| thing.blocks(PathStage::Approach, clearance))?;
            }
            least = thing.least(least, nearest);
        }
        Ok(least)
    }

    /// Height of the lowest point of the tool in the scene [m].
    fn lowest(&self, scene_from_tool: &IsometryMatrix3<f64>) -> f64 {
        let down = -Vector3::z();
        let lowest = |part: &Part| {
            let scene_from_shape = scene_from_tool * part.tool_from_shape;
            (scene_from_shape * part.sharp.support(&(scene_from_shape.rotation.inverse() * down))).z
        };
        self.parts.iter().map(lowest).fold(f64::INFINITY, f64::min)
    }
}

/// Distance of a part from something [m], exact from -[`Passage::DEEP`] to a reach; farther away a lower bound.
fn distance(
    part: &Part,
    thing: &Thing<'_>,
    obstacle_from_tool: &IsometryMatrix3<f64>,
    reach: f64,
    scratch: &mut ContactScratch,
) -> f64 {
    let placed = obstacle_from_tool * part.tool_from_shape;
    part.probes.distance(&thing.obstacle.surface, &placed, reach, thing.what == PathObstacle::Target, scratch)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{super::passage::SceneObstacle, *};
    use kernel::{contact::ContactSurface, geom::TriMesh, voxel::InsideTest};

    fn obstacle(mesh: &TriMesh, at: [f64; 3]) -> SceneObstacle {
        let surface = ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface");
        SceneObstacle {
            surface: Arc::new(surface),
            scene_from_obstacle: IsometryMatrix3::translation(at[0], at[1], at[2]),
        }
    }

    /// A rod, 20 mm thick, that comes down to the floor of a tray, beside a wall of the bin at x = 60 mm.
    #[test]
    fn clearances_are_those_of_walls_by_hand() {
        let bin = obstacle(&TriMesh::open_box([0.12, 0.3, 0.1], 0.01), [0.0; 3]);
        let tray = obstacle(&TriMesh::open_box([0.08, 0.08, 0.02], 0.005), [0.0, 0.0, 0.005]);
        let scene = Surroundings { container: Some(bin), ground: -0.01, objects: vec![tray] };
        let rod = |is_soft| ToolSolid {
            shape: Shape::Cylinder { radius: 0.01, half: 0.03 },
            tool_from_shape: IsometryMatrix3::translation(0.0, 0.0, -0.03),
            is_soft,
        };
        let down = |x: f64, z: f64| {
            IsometryMatrix3::translation(x, 0.0, z) * IsometryMatrix3::rotation(Vector3::x() * std::f64::consts::PI)
        };
        let mut passage = ToolPassage::new(&[rod(false)], 0.002);
        let free = passage.follow(&scene, 0, &down(0.0, 0.001));
        // The floor of the tray is 5 mm above that of the bin; the rod ends 1 mm over it.
        assert!(free.blocked.is_none() && (free.clearance - 0.006).abs() < 2e-4, "{free:?}");
        let blocked = passage.follow(&scene, 0, &down(0.0, -0.001));
        assert_eq!(blocked.blocked, Some((PathStage::Pregrasp, PathObstacle::Target)), "{blocked:?}");
        // In the wall of the tray, at x = 40 mm: a soft tool may touch it, and is 1 mm from the wall of the bin.
        let into_wall = down(0.049, 0.001);
        assert_eq!(passage.follow(&scene, 0, &into_wall).blocked, Some((PathStage::Pregrasp, PathObstacle::Container)));
        let mut soft = ToolPassage::new(&[rod(true)], 0.0005);
        let free = soft.follow(&scene, 0, &into_wall);
        assert!(free.blocked.is_none() && (free.clearance - 0.001).abs() < 2e-4, "{free:?}");
        // From below, the rod starts under the ground.
        let from_below = IsometryMatrix3::translation(0.0, 0.0, -0.2);
        assert_eq!(passage.follow(&scene, 0, &from_below).blocked.map(|(_, by)| by), Some(PathObstacle::Ground));
    }
}

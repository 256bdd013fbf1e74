//! Certified joint paths from one configuration to one of several.

use super::{
    certificate::Uncertified,
    scene::{ArmScene, Checks, Touch},
    search::{search, shorten},
    settings::{PathKey, PathSettings, PathWork},
};

/// Largest number of goals of one search; further ones are left out.
pub const MAX_GOALS: usize = 8;

/// Share of an edge within which a missing certificate is that of its end.
const AT_AN_END: f64 = 1e-3;

/// A joint path on which nothing touches, by certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct JointPath {
    /// Configurations [rad or m], the start first; the arm moves straight from one to the next. A joint without limits may leave
    /// the range of one revolution.
    pub waypoints: Vec<Vec<f64>>,
    /// Index of the goal in which it ends.
    pub goal: usize,
    /// Length [rad] (see [`JointSpace`](super::JointSpace)).
    pub length: f64,
}

/// Result of a path search.
#[derive(Clone, Debug, PartialEq)]
pub enum PathVerdict {
    /// A certified path.
    Found(JointPath),
    /// Two bodies touch at the start.
    StartInCollision(Touch),
    /// Bodies touch at every goal; those of the first.
    GoalInCollision(Touch),
    /// The bounds on work were reached. That proves nothing: there may be a path.
    NotFound,
    /// The start or every free goal has less clearance than [`PathSettings::clearance`], or a path was found that is not
    /// certified after all repairs.
    Uncertain(Option<Touch>),
}

/// Plans a joint path from `start` to one of `goals` [rad or m], each within the joints' limits, and certifies it.
///
/// Trees grow by RRT-Connect, the path is shortened, and every edge is certified continuously
/// (see [`ArmScene::certify`]). An edge without a certificate is planned again with finer samples. The result depends on the
/// scene, the key and the settings only; the work is bounded by counts. Only the first [`MAX_GOALS`] goals that are free of
/// contact count.
///
/// # Panics
/// When a configuration has another length than the group, or there is no goal.
///
/// # Example
/// ```
/// use graspmill_planner::motion::{ArmScene, PathKey, PathSettings, PathVerdict, plan_path};
/// use robot::{
///     collision::{Bodies, Body, CollisionChecker, Geometry, Obstacle, Shape},
///     kinematics::{Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts},
/// };
/// use nalgebra::{IsometryMatrix3, Vector3};
///
/// // Two rods of half a metre in a plane.
/// let joint = |name: &str, x| Joint {
///     name: name.to_owned(),
///     kind: JointKind::Revolute,
///     origin: IsometryMatrix3::translation(x, 0.0, 0.0),
///     axis: Vector3::z_axis(),
///     limits: Some(JointLimits { low: -2.5, high: 2.5 }),
/// };
/// let group = PlanningGroup::new(PlanningGroupParts {
///     joints: vec![joint("shoulder", 0.0), joint("elbow", 0.5)],
///     end_effector: IsometryMatrix3::translation(0.5, 0.0, 0.0),
/// })?;
/// let rod = |link| Body {
///     name: format!("rod {link}"),
///     link,
///     geometries: vec![Geometry {
///         shape: Shape::Box { half: [0.24, 0.02, 0.02] },
///         link_from_shape: IsometryMatrix3::translation(0.25, 0.0, 0.0),
///     }],
/// };
/// let bodies = Bodies { bodies: vec![rod(1), rod(2)], pairs: Vec::new() };
/// // Prepared once; obstacles come and go.
/// let robot = ArmScene::new(&group, CollisionChecker::for_obstacles(&bodies)?);
/// let post = Geometry { shape: Shape::Cylinder { radius: 0.1, half: 1.0 }, link_from_shape: IsometryMatrix3::identity() };
/// let post = Obstacle::new(&[post])?.at(IsometryMatrix3::translation(0.7, 0.0, 0.0));
/// let scene = robot.among(&[post], |_| true);
///
/// let (start, goal) = (vec![-1.0, 0.0], vec![1.0, 0.0]);
/// let key = PathKey::new(7, b"the post");
/// let (verdict, work) = plan_path(&scene, &start, std::slice::from_ref(&goal), &key, &PathSettings::default());
/// let PathVerdict::Found(path) = verdict else { panic!("{verdict:?}") };
/// assert_eq!((path.waypoints.first(), path.waypoints.last()), (Some(&start), Some(&goal)));
/// println!("{} checks, {:.1} rad", work.checks, path.length);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan_path(
    scene: &ArmScene,
    start: &[f64],
    goals: &[Vec<f64>],
    key: &PathKey<'_>,
    settings: &PathSettings,
) -> (PathVerdict, PathWork) {
    assert!(!goals.is_empty(), "a path needs a goal");
    let joints = scene.group().len();
    assert!(goals.iter().all(|goal| goal.len() == joints) && start.len() == joints, "one value per joint");
    let (mut work, mut checks) = (PathWork::default(), Checks::default());
    let verdict = plan(scene, start, goals, key, settings, (&mut work, &mut checks));
    work.checks = checks.count;
    (verdict, work)
}

fn plan(
    scene: &ArmScene,
    start: &[f64],
    goals: &[Vec<f64>],
    key: &PathKey<'_>,
    settings: &PathSettings,
    (work, checks): (&mut PathWork, &mut Checks),
) -> PathVerdict {
    if let Some(touch) = scene.touch(start, checks) {
        return PathVerdict::StartInCollision(touch);
    }
    let touches: Vec<_> = goals.iter().map(|goal| scene.touch(goal, checks)).collect();
    if let [Some(first), others @ ..] = &touches[..]
        && others.iter().all(Option::is_some)
    {
        return PathVerdict::GoalInCollision(*first);
    }
    let clear = |goal: &usize| touches[*goal].is_none() && scene.clear_by(&goals[*goal], settings.clearance);
    let clear: Vec<usize> = (0..goals.len()).filter(clear).take(MAX_GOALS).collect();
    if clear.is_empty() || !scene.clear_by(start, settings.clearance) {
        return PathVerdict::Uncertain(None);
    }
    let ends: Vec<&[f64]> = clear.iter().map(|goal| goals[*goal].as_slice()).collect();
    let Some(mut found) = search(scene, start, &ends, key, (settings, settings.resolution), work, checks) else {
        return PathVerdict::NotFound;
    };
    shorten(scene, &mut found.path, (settings.shortcuts, settings.resolution), &mut key.shortcuts(), checks);
    match certified(scene, found.path, key, settings, (work, checks)) {
        Ok(waypoints) => {
            let length = scene.space().path_length(&waypoints);
            PathVerdict::Found(JointPath { waypoints, goal: clear[found.goal], length })
        }
        Err(refused) => PathVerdict::Uncertain(Some(refused.by)),
    }
}

/// A path that is certified edge by edge; an edge that is not is planned again from its ends.
fn certified(
    scene: &ArmScene,
    mut path: Vec<Vec<f64>>,
    key: &PathKey<'_>,
    settings: &PathSettings,
    (work, checks): (&mut PathWork, &mut Checks),
) -> Result<Vec<Vec<f64>>, Uncertified> {
    let space = scene.space();
    let (mut done, mut resolution) = (0, settings.resolution);
    while done + 1 < path.len() {
        let difference = space.difference(&path[done], &path[done + 1]);
        let Err(refused) = scene.certify(&path[done], &difference, &mut work.certificate) else {
            done += 1;
            continue;
        };
        if work.repairs >= settings.repairs {
            return Err(refused);
        }
        work.repairs += 1;
        // Finer samples see what the coarser ones passed.
        resolution *= 0.5;
        let key = PathKey { repair: key.repair + work.repairs, ..*key };
        // An end that is too near an obstacle is replaced, too.
        let first = if refused.at < AT_AN_END { done.saturating_sub(1) } else { done };
        let last = if refused.at > 1.0 - AT_AN_END { (done + 2).min(path.len() - 1) } else { done + 1 };
        let (from, to) = (path[first].clone(), path[last].clone());
        let Some(mut found) = search(scene, &from, &[&to], &key, (settings, resolution), work, checks) else {
            return Err(refused);
        };
        shorten(scene, &mut found.path, (settings.shortcuts, resolution), &mut key.shortcuts(), checks);
        path.splice(first..=last, found.path);
        space.unwind(&mut path);
        done = first;
    }
    Ok(path)
}

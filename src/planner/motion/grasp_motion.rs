//! Whether an arm can grasp at a pose: three levels, each a stricter meaning of reachable.

use super::{
    approach::{ApproachSettings, GraspPose, GraspScenes, LineBreak, Lines, follow_lines},
    inverse::{Branch, InverseArm},
    path::{JointPath, MAX_GOALS, PathVerdict, plan_path},
    scene::{Checks, Touch},
    settings::{PathKey, PathSettings, PathWork},
};

/// Part of a motion that is known to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MotionLevel {
    /// No configuration without contact reaches the grasp, as far as known.
    Unreachable,
    /// R1: a configuration without contact reaches the grasp.
    Grasp,
    /// R2: on its branch, straight lines lead from the pregrasp to the grasp, and up.
    Lines,
    /// R3: a certified joint path leads from the current configuration to that pregrasp.
    Path,
}

/// Verdict on the motion to a grasp.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionVerdict {
    /// A certified motion.
    Valid(GraspMotion),
    /// No joint values within the limits reach the grasp; where the arm has no closed form, none were found.
    NoIk,
    /// Every branch that reaches the grasp is blocked, there or on a line; by these bodies on the branch that was tried first.
    ApproachBlocked(Touch),
    /// A line leaves every branch that is not blocked: it ends, a joint would jump, or the arm gets singular.
    ApproachBranch,
    /// Two bodies touch at the current configuration.
    StartInCollision(Touch),
    /// Two bodies touch at every pregrasp on the way to it: the target is in the way of the fingers.
    GoalInCollision(Touch),
    /// No path was found within the bounds on work; that proves nothing.
    NotFound,
    /// Clearance is too small to decide.
    Uncertain,
}

/// A motion from the current configuration to a grasp and up, free of contact by certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspMotion {
    /// From the current configuration to the pregrasp.
    pub path: JointPath,
    /// From there to the grasp, and up.
    pub lines: Lines,
}

/// Verdict with the level that was reached, and the work.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionReport {
    /// Verdict.
    pub verdict: MotionVerdict,
    /// Highest level that holds.
    pub level: MotionLevel,
    /// Work spent on all parts.
    pub work: PathWork,
}

/// Settings of a grasp's motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionSettings {
    /// Approach and lift.
    pub approach: ApproachSettings,
    /// Joint path.
    pub path: PathSettings,
}

/// Plans the whole motion of a grasp (thesis, section 7.2): from the configuration `start` to a pregrasp, straight to the
/// grasp, and up.
///
/// Branches are tried in order of their distance from `start`; up to eight whose lines work are goals of the joint path.
///
/// # Panics
/// When `start` has another length than the arm, or the scenes are of other arms.
pub fn plan_grasp(
    arm: &InverseArm,
    scenes: &GraspScenes<'_>,
    start: &[f64],
    pose: &GraspPose,
    key: &PathKey<'_>,
    settings: &MotionSettings,
) -> MotionReport {
    let (mut work, mut checks) = (PathWork::default(), Checks::default());
    let space = scenes.way.space();
    let mut branches = arm.branches(&pose.grasp);
    let distance = |branch: &Branch| space.length(&space.difference(start, &branch.q));
    branches.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let lines = all_lines(arm, scenes, pose, &branches, settings, (&mut work, &mut checks));
    let (level, verdict) = match lines {
        Err((level, verdict)) => (level, verdict),
        Ok(mut lines) => {
            let goals: Vec<Vec<f64>> = lines.iter().map(|lines| lines.approach[0].clone()).collect();
            let (path, path_work) = plan_path(scenes.way, start, &goals, key, &settings.path);
            work.add(&path_work);
            match path {
                PathVerdict::Found(path) => {
                    let lines = lines.swap_remove(path.goal);
                    (MotionLevel::Path, MotionVerdict::Valid(GraspMotion { path, lines }))
                }
                PathVerdict::StartInCollision(touch) => (MotionLevel::Lines, MotionVerdict::StartInCollision(touch)),
                PathVerdict::GoalInCollision(touch) => (MotionLevel::Lines, MotionVerdict::GoalInCollision(touch)),
                PathVerdict::NotFound => (MotionLevel::Lines, MotionVerdict::NotFound),
                PathVerdict::Uncertain(_) => (MotionLevel::Lines, MotionVerdict::Uncertain),
            }
        }
    };
    work.checks += checks.count;
    MotionReport { verdict, level, work }
}

/// Lines of up to [`MAX_GOALS`] branches; the verdict where none has both.
fn all_lines(
    arm: &InverseArm,
    scenes: &GraspScenes<'_>,
    pose: &GraspPose,
    branches: &[Branch],
    settings: &MotionSettings,
    (work, checks): (&mut PathWork, &mut Checks),
) -> Result<Vec<Lines>, (MotionLevel, MotionVerdict)> {
    if branches.is_empty() {
        return Err((MotionLevel::Unreachable, MotionVerdict::NoIk));
    }
    let (mut found, mut blocked, mut left, mut tried) = (Vec::new(), None, false, 0);
    let mut level = MotionLevel::Unreachable;
    for branch in branches {
        if let Some(touch) = scenes.approach.touch(&branch.q, checks) {
            blocked = blocked.or(Some(touch));
            continue;
        }
        level = MotionLevel::Grasp;
        if tried == settings.approach.branches {
            break;
        }
        tried += 1;
        let certificate = &mut work.certificate;
        match follow_lines(arm, scenes, pose, branch, &settings.approach, (certificate, &mut *checks)) {
            Ok(lines) => found.push(lines),
            Err(LineBreak::Blocked(touch)) => blocked = blocked.or(Some(touch)),
            Err(LineBreak::Branch) => left = true,
        }
        if found.len() == MAX_GOALS {
            break;
        }
    }
    match (found.is_empty(), blocked) {
        (false, _) => Ok(found),
        // With a branch that is free but ends, the obstacles are not what prevents the motion.
        (true, Some(touch)) if !left => Err((level, MotionVerdict::ApproachBlocked(touch))),
        (true, _) => Err((level, MotionVerdict::ApproachBranch)),
    }
}

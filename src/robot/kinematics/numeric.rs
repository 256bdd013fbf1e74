//! Inverse kinematics of any chain by damped least squares.
//!
//! Levenberg-Marquardt on the pose error (Sugihara 2011, "Solvability-unconcerned inverse kinematics by the
//! Levenberg-Marquardt method": damping by the residual itself), each step clamped to the joints' limits.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

use super::PlanningGroup;
use kernel::geom::{EndEffector, Pose, World};

/// When a solution is one, and when the solver gives up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverSettings {
    /// Accepted error of the end effector's origin [m].
    pub position: f64,
    /// Accepted error of its orientation [rad].
    pub orientation: f64,
    /// Steps from one start at most.
    pub steps: u32,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self { position: 1e-9, orientation: 1e-9, steps: 100 }
    }
}

/// Joint values that bring the end effector to a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// One value per joint [rad or m], within the limits.
    pub q: Vec<f64>,
    /// Remaining error of the position [m].
    pub position: f64,
    /// Remaining error of the orientation [rad].
    pub orientation: f64,
}

/// The share by which a step has to lower the squared error while that is large.
const SLOW: f64 = 1e-5;

/// Most joints of a group that is solved: the solver works on the stack.
pub const MAX_JOINTS: usize = 16;

/// Searches for joint values within the limits that bring the end effector to `target`, from one start. `None` when the
/// descent ends elsewhere: another start may still find a solution.
///
/// # Panics
/// When `start` has another length than the group, or the group more than [`MAX_JOINTS`] joints.
pub fn solve_numeric(
    group: &PlanningGroup,
    target: &Pose<World, EndEffector>,
    start: &[f64],
    settings: &SolverSettings,
) -> Option<Solution> {
    let Descent { q, position, orientation, solved } = descend(group, target, start, settings);
    solved.then(|| Solution { q: q[..group.len()].to_vec(), position, orientation })
}

/// Where a descent ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Joint values within the limits; those beyond the group's count are 0.
    pub q: [f64; MAX_JOINTS],
    /// Remaining error of the position [m].
    pub position: f64,
    /// Remaining error of the orientation [rad].
    pub orientation: f64,
    /// Whether that is within the settings.
    pub solved: bool,
}

/// [`solve_numeric`], with the end of a descent that leads elsewhere too.
///
/// # Panics
/// Panics of [`solve_numeric`].
pub fn descend(
    group: &PlanningGroup,
    target: &Pose<World, EndEffector>,
    start: &[f64],
    settings: &SolverSettings,
) -> Descent {
    // Start within the limits, with its Jacobian and pose error.
    let count = group.len();
    let mut q = [0.0; MAX_JOINTS];
    q[..count].copy_from_slice(start);
    clamp(group, &mut q[..count]);
    let mut columns = [Vector6::zeros(); MAX_JOINTS];
    let mut next_columns = columns;
    let mut error = pose_error(&group.forward_and_columns(&q[..count], &mut columns[..count]), target);
    let mut damping = 1e-3;
    let end = |q, error: &Vector6<f64>| {
        let (position, orientation) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
        let solved = position <= settings.position && orientation <= settings.orientation;
        Descent { q, position, orientation, solved }
    };
    for _ in 0..settings.steps {
        let here = end(q, &error);
        if here.solved {
            return here;
        }
        let mut next = q;
        // Damping in proportion to the squared residual (Sugihara 2011).
        let damped = damping * error.norm_squared() + 1e-14;
        if step(group, &mut next[..count], &columns[..count], &error, damped).is_none() {
            break;
        }
        let next_pose = group.forward_and_columns(&next[..count], &mut next_columns[..count]);
        let next_error = pose_error(&next_pose, target);
        // Accepted step: the damping falls.
        if next_error.norm_squared() < error.norm_squared() {
            // Hardly better far from the target: this valley ends here.
            let stuck = next_error.norm_squared() > (1.0 - SLOW) * error.norm_squared() && error.norm_squared() > 1e-8;
            (q, columns, error) = (next, next_columns, next_error);
            damping = (damping * 0.3).max(1e-6);
            if stuck {
                break;
            }
        } else {
            // Rejected step: the damping grows until a step lowers the error, or it is hopeless.
            damping *= 8.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    Descent { solved: false, ..end(q, &error) }
}

fn clamp(group: &PlanningGroup, q: &mut [f64]) {
    for (joint, value) in group.joints().iter().zip(q) {
        if let Some(limits) = joint.limits {
            *value = value.clamp(limits.low, limits.high);
        }
    }
}

/// Moves `q` by the step that lowers |J dq - e|^2 + damping |dq|^2 most, within the limits: a joint that is at a limit
/// and would exceed it stays, and the others compensate. `None` when the numbers leave no step.
fn step(
    group: &PlanningGroup,
    q: &mut [f64],
    columns: &[Vector6<f64>],
    error: &Vector6<f64>,
    damping: f64,
) -> Option<()> {
    let mut moves = [true; MAX_JOINTS];
    loop {
        // J^T (J J^T + damping)^-1 e: the same as the normal equations', six by six.
        let mut square = Matrix6::identity() * damping;
        for (column, _) in columns.iter().zip(&moves).filter(|(_, moves)| **moves) {
            square += column * column.transpose();
        }
        let weights = square.cholesky()?.solve(error);
        // Joints at a limit that would exceed it are held, and the step is solved again without them.
        let mut held = false;
        for (joint, limits) in
            group.joints().iter().enumerate().filter_map(|(index, joint)| Some((index, joint.limits?)))
        {
            let offset = columns[joint].dot(&weights);
            let beyond = (q[joint] <= limits.low && offset < 0.0) || (q[joint] >= limits.high && offset > 0.0);
            if moves[joint] && beyond {
                moves[joint] = false;
                held = true;
            }
        }
        if held {
            continue;
        }
        for (joint, value) in q.iter_mut().enumerate().filter(|(joint, _)| moves[*joint]) {
            *value += columns[joint].dot(&weights);
        }
        clamp(group, q);
        return Some(());
    }
}

/// From a pose to a target: the displacement of the origin [m], then the rotation vector [rad], in world axes.
fn pose_error(pose: &Pose<World, EndEffector>, target: &Pose<World, EndEffector>) -> Vector6<f64> {
    let offset = target.translation() - pose.translation();
    let rotation = rotation_vector(&(target.rotation() * pose.rotation().inverse()));
    Vector6::new(offset.x, offset.y, offset.z, rotation.x, rotation.y, rotation.z)
}

/// Axis times angle, 0 to pi, of a rotation; `libm`, so the same bits everywhere.
fn rotation_vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let m = rotation.matrix();
    let twice_sine = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]);
    let (sine, cosine) = (0.5 * twice_sine.norm(), 0.5 * (m.trace() - 1.0));
    let angle = libm::atan2(sine, cosine);
    if sine > 1e-7 {
        return twice_sine * (0.5 * angle / sine);
    }
    if cosine > 0.0 {
        return twice_sine * 0.5;
    }
    // Half a revolution: the axis is that of the largest column of R + 1.
    let sum = m + Matrix3::identity();
    let column = (0..3).fold(0, |best, next| if sum[(next, next)] > sum[(best, best)] { next } else { best });
    sum.column(column).normalize() * angle
}

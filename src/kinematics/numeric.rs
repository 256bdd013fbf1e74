//! Inverse kinematics of any chain by damped least squares.
//!
//! Levenberg-Marquardt on the pose error (Sugihara 2011, "Solvability-unconcerned inverse kinematics by the
//! Levenberg-Marquardt method": damping by the residual itself), each step clamped to the joints' limits.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3, Vector6};

use super::PlanningGroup;
use crate::geom::{EndEffector, Pose, World};

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
    /// One value a joint [rad or m], within the limits.
    pub q: Vec<f64>,
    /// What is left of the position's error [m].
    pub position: f64,
    /// What is left of the orientation's error [rad].
    pub orientation: f64,
}

/// Looks for joint values within the limits that bring the end effector to `target`, from one start. `None` when the
/// descent ends elsewhere: another start may still find a solution.
///
/// # Panics
/// When `start` has another length than the group.
pub fn solve_numeric(
    group: &PlanningGroup,
    target: &Pose<World, EndEffector>,
    start: &[f64],
    settings: &SolverSettings,
) -> Option<Solution> {
    let clamp = |joint: usize, value: f64| {
        group.joints()[joint].limits.map_or(value, |limits| value.clamp(limits.low, limits.high))
    };
    let mut q: Vec<f64> = start.iter().enumerate().map(|(joint, value)| clamp(joint, *value)).collect();
    let (pose, mut jacobian) = group.forward_and_jacobian(&q);
    let mut error = pose_error(&pose, target);
    let mut damping = 1e-3;
    for _ in 0..settings.steps {
        let (position, orientation) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
        if position <= settings.position && orientation <= settings.orientation {
            return Some(Solution { q, position, orientation });
        }
        let step = damped_step(&jacobian, &error, damping * error.norm_squared() + 1e-14)?;
        let next: Vec<f64> = (0..q.len()).map(|joint| clamp(joint, q[joint] + step[joint])).collect();
        let (next_pose, next_jacobian) = group.forward_and_jacobian(&next);
        let next_error = pose_error(&next_pose, target);
        if next_error.norm_squared() < error.norm_squared() {
            (q, jacobian, error) = (next, next_jacobian, next_error);
            damping = (damping * 0.3).max(1e-6);
        } else {
            damping *= 8.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    None
}

/// From a pose to a target: the way of the origin [m], then the rotation vector [rad], in world axes.
fn pose_error(pose: &Pose<World, EndEffector>, target: &Pose<World, EndEffector>) -> Vector6<f64> {
    let way = target.translation() - pose.translation();
    let turn = rotation_vector(&(target.rotation() * pose.rotation().inverse()));
    Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z)
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
    // Half a turn: the axis is that of the largest column of R + 1.
    let sum = m + Matrix3::identity();
    let column = (0..3).fold(0, |best, next| if sum[(next, next)] > sum[(best, best)] { next } else { best });
    sum.column(column).normalize() * angle
}

/// The step that lowers |J dq - e|^2 + damping |dq|^2 most.
fn damped_step(jacobian: &nalgebra::Matrix6xX<f64>, error: &Vector6<f64>, damping: f64) -> Option<DVector<f64>> {
    let count = jacobian.ncols();
    let normal: DMatrix<f64> = jacobian.tr_mul(jacobian) + DMatrix::identity(count, count) * damping;
    let right: DVector<f64> = jacobian.tr_mul(error);
    normal.cholesky().map(|factor| factor.solve(&right))
}

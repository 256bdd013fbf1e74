//! Variables of annealing: pose of the hand, and amplitudes of its eigengrasps.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector3};

use super::{
    frame::Frame,
    numbers::{exponentials, sines},
    settings::{AmplitudeRange, Annealing},
    unsearchable::UnsearchableHand,
};
use crate::hand::Hand;
use kernel::seed::Stream;

/// Most numbers of a state.
pub(super) const MAX: usize = 16;

/// Number of variables of the pose.
const OF_POSE: usize = 6;

/// A variable that is out of range this often in a row keeps its value.
const MAX_DRAWS: u32 = 100;

/// Position x, y, z of the approach frame in the search frame [m]; its rotation about an axis at polar angle theta and
/// azimuth phi, by an angle [rad]; amplitudes. The rest of the array is 0.
pub(super) type State = [f64; MAX];

/// One variable.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Variable {
    range: [f64; 2],
    /// Longest step.
    jump: f64,
    /// Whether it wraps around from one end to the other.
    circular: bool,
}

/// Ranges and steps.
pub(super) struct Variables {
    variables: Vec<Variable>,
}

/// Whether a state has room for a hand's eigengrasps.
pub(super) fn check_amplitudes(hand: &Hand) -> Result<(), UnsearchableHand> {
    let count = hand.eigengrasps().map_or(0, |grasps| grasps.directions.len());
    let max = MAX - OF_POSE;
    if count > max { Err(UnsearchableHand::TooManyEigengrasps { count, max }) } else { Ok(()) }
}

impl Variables {
    /// Variables of the thesis, for a hand whose amplitudes were [checked](check_amplitudes).
    pub(super) fn new(hand: &Hand, settings: &Annealing) -> Self {
        let amplitudes = hand.eigengrasps().map_or(0, |grasps| grasps.directions.len());
        let along = |range, jump| Variable { range, jump, circular: false };
        let mut variables = vec![
            along([-0.25, 0.25], 0.15),
            along([-0.25, 0.25], 0.15),
            along([-0.25, 0.35], 0.15),
            along([0.0, PI], PI / 5.0),
            Variable { range: [-PI, PI], jump: FRAC_PI_2, circular: true },
            along([0.0, PI], FRAC_PI_2),
        ];
        variables.extend((0..amplitudes).map(|direction| {
            let range = match settings.amplitudes {
                AmplitudeRange::Joints => hand.amplitude_range(direction),
                AmplitudeRange::Clamped(max) => [-max, max],
            };
            along(range, (range[1] - range[0]) / 4.0)
        }));
        Self { variables }
    }

    /// A state near another: every variable moves, by steps between `temperature` and 1 times its jump whose logarithm is
    /// uniform (Ingber 1989). `log_span` is ln(1 + 1 / temperature).
    #[inline(always)]
    pub(super) fn neighbour(&self, from: &State, temperature: f64, log_span: f64, stream: &mut Stream) -> State {
        let mut draws = [0.0; MAX];
        for draw in draws.iter_mut().take(self.variables.len()) {
            *draw = 2.0 * stream.unit() - 1.0;
        }
        let mut to = [0.0; MAX];
        let steps = steps(&draws, temperature, log_span);
        for (index, variable) in self.variables.iter().enumerate() {
            let mut step = steps[index];
            let mut drawn = 0;
            to[index] = loop {
                let value = variable.brought(from[index] + step * variable.jump);
                let [low, high] = variable.range;
                if (low..=high).contains(&value) {
                    break value;
                }
                drawn += 1;
                if drawn == MAX_DRAWS {
                    break from[index];
                }
                [step] = self::steps(&[2.0 * stream.unit() - 1.0], temperature, log_span);
            };
        }
        to
    }

    /// The state that places the approach frame there, with these amplitudes, all brought within range.
    pub(super) fn state_at(&self, search_from_approach: &Frame, amplitudes: &[f64]) -> State {
        let (axis, angle) = axis_and_angle(&search_from_approach.rotation);
        let theta = libm::acos(axis.z.clamp(-1.0, 1.0));
        let phi = if axis.x == 0.0 && axis.y == 0.0 { 0.0 } else { libm::atan2(axis.y, axis.x) };
        let at = search_from_approach.origin;
        let numbers = [at.x, at.y, at.z, theta, phi, angle];
        let mut state = [0.0; MAX];
        for (index, number) in numbers.iter().chain(amplitudes).enumerate() {
            let [low, high] = self.variables[index].range;
            state[index] = number.max(low).min(high);
        }
        state
    }

    /// Number of variables.
    pub(super) fn count(&self) -> usize {
        self.variables.len()
    }

    /// The amplitudes of a state.
    pub(super) fn amplitudes<'a>(&self, state: &'a State) -> &'a [f64] {
        &state[OF_POSE..self.variables.len()]
    }
}

impl Variable {
    fn brought(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        match value {
            value if self.circular && value > high => value - (high - low),
            value if self.circular && value < low => value + (high - low),
            value => value,
        }
    }
}

/// Steps from -1 to 1 for uniform numbers from -1 to 1.
#[inline(always)]
fn steps<const N: usize>(draws: &[f64; N], temperature: f64, log_span: f64) -> [f64; N] {
    let mut spans = [0.0; N];
    for index in 0..N {
        spans[index] = draws[index].abs() * log_span;
    }
    let powers = exponentials(&spans);
    let mut out = [0.0; N];
    for index in 0..N {
        out[index] = ((powers[index] - 1.0) * temperature).copysign(draws[index]);
    }
    out
}

/// Where a state has the approach frame.
#[inline(always)]
pub(super) fn search_from_approach(state: &State) -> Frame {
    let [[s_theta, s_phi, s, _], [c_theta, c_phi, c, _]] = sines(&[state[3], state[4], state[5], 0.0]);
    let axis = Vector3::new(s_theta * c_phi, s_theta * s_phi, c_theta);
    let scaled = axis * (1.0 - c);
    let rotation = Matrix3::new(
        axis.x * scaled.x + c,
        axis.x * scaled.y - s * axis.z,
        axis.x * scaled.z + s * axis.y,
        axis.y * scaled.x + s * axis.z,
        axis.y * scaled.y + c,
        axis.y * scaled.z - s * axis.x,
        axis.z * scaled.x - s * axis.y,
        axis.z * scaled.y + s * axis.x,
        axis.z * scaled.z + c,
    );
    Frame { rotation, origin: Vector3::new(state[0], state[1], state[2]) }
}

/// Unit axis and angle from 0 to pi of a rotation; the z axis for the identity.
pub(super) fn axis_and_angle(rotation: &Matrix3<f64>) -> (Vector3<f64>, f64) {
    let twice = Vector3::new(
        rotation[(2, 1)] - rotation[(1, 2)],
        rotation[(0, 2)] - rotation[(2, 0)],
        rotation[(1, 0)] - rotation[(0, 1)],
    );
    let (sin, cos) = (twice.norm() / 2.0, (rotation.trace() - 1.0) / 2.0);
    let angle = libm::atan2(sin, cos);
    if sin > 1e-6 {
        return (twice / (2.0 * sin), angle);
    }
    if cos > 0.0 {
        return (Vector3::z(), 0.0);
    }
    // Half a revolution: the axis is in the symmetric part, (rotation + 1) / 2 = axis axis^T.
    let squares = (rotation + Matrix3::identity()) / 2.0;
    let largest = (0..3).fold(0, |best, axis| if squares[(axis, axis)] > squares[(best, best)] { axis } else { best });
    (squares.column(largest).normalize(), angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_and_angle_come_back() {
        let mut stream = Stream::of_job(5, b"", "turns");
        for _ in 0..1000 {
            let mut state = [0.0; MAX];
            state[3] = stream.uniform(0.0, PI);
            state[4] = stream.uniform(-PI, PI);
            state[5] = stream.uniform(0.0, PI);
            let frame = search_from_approach(&state);
            let (axis, angle) = axis_and_angle(&frame.rotation);
            let truth = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
            assert!((truth.matrix() - frame.rotation).norm() < 1e-9);
        }
        for half in [Vector3::x(), Vector3::y(), Vector3::new(0.6, 0.0, 0.8)] {
            let rotation = half * half.transpose() * 2.0 - Matrix3::identity();
            let (axis, angle) = axis_and_angle(&rotation);
            assert!((axis.dot(&half).abs() - 1.0).abs() < 1e-9 && (angle - PI).abs() < 1e-9);
        }
    }
}

//! Poses as lists and files give them: a position and a quaternion.

/// Deviation of a quaternion's length from 1 that is rounding.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Checks a pose of position and quaternion, in any order of the quaternion: the problem, in words.
pub fn check_pose(pose: &[f64; 7]) -> Result<(), String> {
    if let Some(number) = pose.iter().find(|number| !number.is_finite()) {
        return Err(format!("{number} is not finite"));
    }
    let length = pose[3..].iter().map(|part| part * part).sum::<f64>().sqrt();
    let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
    if is_unit { Ok(()) } else { Err(format!("a quaternion of length {length}, not 1")) }
}

//! Hands: the Barrett hand compared with the numbers it is made from, kinematics against MuJoCo's, closing against
//! geometry, tables with mistakes, and the guide.

mod closing;
mod feeling;
mod guide;
mod numbers;
mod refusals;
mod tables;

use graspmill::hand::Hand;
use nalgebra::IsometryMatrix3;

/// Index of a link in the hand's list.
fn link_named(hand: &Hand, name: &str) -> usize {
    hand.links().iter().position(|link| link == name).unwrap_or_else(|| panic!("no link {name}"))
}

/// The frames of links in a posture in degrees.
fn frames_at(hand: &Hand, posture: &[f64]) -> Vec<IsometryMatrix3<f64>> {
    let posture: Vec<f64> = posture.iter().map(|degrees| degrees.to_radians()).collect();
    hand.link_frames(&hand.posture_values(&posture))
}

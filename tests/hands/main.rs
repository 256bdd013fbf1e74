//! Hands: the Barrett hand beside the numbers it is made from, kinematics against MuJoCo's, closing against geometry, tables
//! with mistakes, and the guide.
#![cfg(feature = "sim")]

use std::path::Path;

use graspmill::{hand::Hand, sim::HandModel};
use nalgebra::IsometryMatrix3;

mod annealed;
mod closing;
mod feeling;
mod guide;
mod numbers;
mod tables;
mod trial;

const BARRETT: &str = "scenes/barrett_bh8_280.xml";
const GRIPPER: &str = "scenes/parallel_gripper.xml";

fn open(scene: &str) -> HandModel {
    HandModel::open(Path::new(scene)).unwrap_or_else(|error| panic!("{error}"))
}

/// The place of a link in the hand's list.
fn link(hand: &Hand, name: &str) -> usize {
    hand.links().iter().position(|link| link == name).unwrap_or_else(|| panic!("no link {name}"))
}

/// The frames of links in a posture in degrees.
fn frames_at(hand: &Hand, posture: &[f64]) -> Vec<IsometryMatrix3<f64>> {
    let posture: Vec<f64> = posture.iter().map(|degrees| degrees.to_radians()).collect();
    hand.link_frames(&hand.posture_values(&posture))
}

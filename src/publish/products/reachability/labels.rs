//! Labels of poses in words, in the order in which pages show them.

use kernel::geom::PoseLabel;

/// Labels, the best first.
pub(super) const ORDER: [PoseLabel; 3] = [PoseLabel::Reachable, PoseLabel::Colliding, PoseLabel::NoSolution];

/// A label in words.
pub(super) fn in_words(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::Reachable => "reachable",
        PoseLabel::Colliding => "colliding",
        PoseLabel::NoSolution => "no solution",
    }
}

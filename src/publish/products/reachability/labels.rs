//! Labels of poses as text, in the order of the pages.

use kernel::geom::PoseLabel;

/// Labels, the best first.
pub(super) const ORDER: [PoseLabel; 3] = [PoseLabel::Reachable, PoseLabel::Colliding, PoseLabel::NoSolution];

/// Text of a label.
pub(super) fn in_words(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::Reachable => "reachable",
        PoseLabel::Colliding => "colliding",
        PoseLabel::NoSolution => "no solution",
    }
}

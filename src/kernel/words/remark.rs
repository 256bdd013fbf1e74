//! Remarks on meshes: which are notes and which are warnings.

/// End of the remark on a mesh of several bodies.
pub const SEPARATE_BODIES: &str = "separate bodies";

/// The remark on a mesh whose closed shells may overlap.
pub const MAY_OVERLAP: &str = "parts may overlap";

/// Whether a remark on a mesh, alone or after the name of its object, is a note on a sound mesh: it has several bodies, or parts that
/// may overlap. All other remarks are warnings.
pub fn is_note(remark: &str) -> bool {
    remark.ends_with(SEPARATE_BODIES) || remark.ends_with(MAY_OVERLAP)
}

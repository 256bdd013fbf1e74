//! Contacts of exported models.

/// Stiffness and damping of contacts with which trials and scenes were made, as attributes of a geom or a flex.
pub(super) const CONTACT: &str = "solref=\"0.004 1\" solimp=\"0.95 0.995 0.0005 0.5 2\"";

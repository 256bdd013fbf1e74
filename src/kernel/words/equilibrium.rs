//! Bounds within which a scene is in equilibrium.

/// Depths that are allowed between two bodies, and between a body and the container [m].
pub const MAX_DEPTHS: [f64; 2] = [0.5e-3, 1e-3];

/// Motion of a centre of mass [m] and rotation [rad] that a scene may show when it is stepped from its stored poses.
pub const MAX_DRIFT: [f64; 2] = [2e-3, 2.0 * std::f64::consts::PI / 180.0];

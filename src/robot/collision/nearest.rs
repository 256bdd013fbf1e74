//! State of a search for the distance between two bodies.

/// Error of a distance [m].
pub(super) const TOLERANCE: f64 = 1e-6;

/// Where the search is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Distance found so far, or the bound up to which it matters [m].
    pub best: f64,
    /// A distance below this ends the search [m].
    pub enough: f64,
}

impl Nearest {
    /// Lowers the distance found so far.
    pub fn found(&mut self, distance: f64) {
        self.best = self.best.min(distance);
    }

    /// Ends the search: the distance is less than `enough`.
    pub fn decide(&mut self) {
        self.best = f64::NEG_INFINITY;
    }

    /// Whether the distance is known to be less than `enough`.
    pub fn decided(&self) -> bool {
        self.best < self.enough
    }

    /// Whether something at this distance or farther changes nothing.
    pub fn beyond(&self, at_least: f64) -> bool {
        at_least >= self.best - TOLERANCE
    }

    /// Whether the distance is so large that bounds by pieces of this radius decide it within a factor of three: then one that
    /// may be nearer counts as less than `enough`.
    pub fn coarse(&self, radius: f64) -> bool {
        self.enough > 3.0 * radius
    }
}

/// A body's part that a search reaches: a ball of its surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    /// Distance of the ball's centre from the other body [m].
    pub distance: f64,
    /// Radius of the ball [m].
    pub radius: f64,
}

impl Reached {
    /// Whether the ball decides alone: it is too far, or the search ends with it.
    pub fn settles(&self, nearest: &mut Nearest) -> bool {
        if nearest.beyond(self.distance - self.radius) {
            return true;
        }
        // The ball holds a point of the surface.
        nearest.found(self.distance + self.radius);
        nearest.decided()
    }
}

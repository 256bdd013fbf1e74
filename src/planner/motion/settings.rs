//! Settings of a path search, the key of its random numbers, and its work.

use super::certificate::CertificateWork;
use kernel::seed::Stream;

/// Settings of [`plan_path`](super::plan_path): those of VAMP (W. Thomason, Z. Kingston, L. Kavraki, "Motions in
/// microseconds via vectorized sampling-based planning", ICRA 2024) by default, with bounds on the work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Longest edge of a tree [rad].
    pub step: f64,
    /// Distance between checked configurations of an edge [rad].
    pub resolution: f64,
    /// Radius of the domain of a node once an extension from it failed [rad].
    pub domain: f64,
    /// Share by which that radius changes with each further failure or success.
    pub domain_change: f64,
    /// Smallest radius [rad].
    pub smallest_domain: f64,
    /// Largest number of iterations.
    pub iterations: u64,
    /// Largest number of configurations that the search checks.
    pub checks: u64,
    /// Samples rejected one after the other before the dynamic domain is dropped, and again before a new start.
    pub rejections: u64,
    /// Attempts to shorten the path.
    pub shortcuts: u32,
    /// Edges that may be planned again where no certificate was found.
    pub repairs: u32,
    /// Clearance of the start and the goals below which a verdict is uncertain [m].
    pub clearance: f64,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            step: 1.0,
            resolution: 1.0 / 32.0,
            domain: 4.0,
            domain_change: 1e-4,
            smallest_domain: 1.0,
            iterations: 100_000,
            checks: 200_000,
            rejections: 20_000,
            shortcuts: 100,
            repairs: 10,
            clearance: 1e-4,
        }
    }
}

/// Key of a search's random numbers: the same key gives the same path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathKey<'a> {
    /// Seed of the job.
    pub seed: u64,
    /// Scene and grasp, for example their ids.
    pub subject: &'a [u8],
    /// Number of the repair, 0 for the first search.
    pub(super) repair: u32,
}

impl<'a> PathKey<'a> {
    /// Key of a path in one scene to one grasp.
    pub fn new(seed: u64, subject: &'a [u8]) -> Self {
        Self { seed, subject, repair: 0 }
    }

    /// The stream of samples after some restarts.
    pub(super) fn stream(&self, restarts: u32) -> Stream {
        Stream::of_job(self.seed, self.subject, &format!("joint path {} {restarts}", self.repair))
    }

    /// The stream of shortcuts.
    pub(super) fn shortcuts(&self) -> Stream {
        Stream::of_job(self.seed, self.subject, &format!("shortcuts {}", self.repair))
    }
}

/// Work spent on a path, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathWork {
    /// Samples drawn.
    pub iterations: u64,
    /// Configurations checked for contact.
    pub checks: u64,
    /// Nodes of all trees.
    pub nodes: u64,
    /// New starts with other samples.
    pub restarts: u32,
    /// Edges planned again.
    pub repairs: u32,
    /// Work on certificates.
    pub certificate: CertificateWork,
}

impl PathWork {
    /// Adds the work of another search.
    pub(super) fn add(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.checks += other.checks;
        self.nodes += other.nodes;
        self.restarts += other.restarts;
        self.repairs += other.repairs;
        self.certificate.configurations += other.certificate.configurations;
        self.certificate.distances += other.certificate.distances;
    }
}

//! Processors that a cluster's engine granted.

use super::Variables;

/// Grant of an engine to a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grant {
    /// Processors.
    pub threads: usize,
    /// Variable that states the grant.
    pub variable: &'static str,
}

/// Variables in which engines state the processors of one task on this machine, the more exact ones of an engine first:
/// Slurm (requested, then what the node gave), PBS, Grid Engine, LSF. Kubernetes and HyperQueue bind by control group
/// or affinity, which the system reports.
const GRANTS: [&str; 5] = ["SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "NCPUS", "NSLOTS", "LSB_DJOB_NUMPROC"];

/// The engine's grant, if one is stated: on a node without binding, the system reports all of the node's processors.
pub fn granted_threads(variables: Variables) -> Option<Grant> {
    GRANTS.into_iter().find_map(|variable| {
        let threads = variables(variable)?.trim().parse().ok().filter(|threads| *threads > 0)?;
        Some(Grant { threads, variable })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_that_says_a_number_counts() {
        let grant = |set: &[(&str, &str)]| {
            granted_threads(&|name| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
                .map(|grant| grant.threads)
        };
        assert_eq!(grant(&[("SLURM_CPUS_ON_NODE", "8"), ("SLURM_CPUS_PER_TASK", "4")]), Some(4));
        assert_eq!(grant(&[("SLURM_CPUS_ON_NODE", "8")]), Some(8));
        assert_eq!(grant(&[("NSLOTS", "0")]), None);
        assert_eq!(grant(&[("NSLOTS", "many"), ("LSB_DJOB_NUMPROC", "3")]), Some(3));
        assert_eq!(grant(&[]), None);
    }
}

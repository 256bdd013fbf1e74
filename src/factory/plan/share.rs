//! Which shards of a plan are one task's.

use kernel::ids::ShardId;

/// One of several tasks that fill a folder together, and its shards: those whose number, divided by the count of tasks,
/// leaves the task's. The plan fixes the shards; how many tasks there are decides only who makes which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    task: u32,
    tasks: u32,
}

impl Share {
    /// Task `task`, counted from 0, of `tasks`; `None` where there is no such task.
    pub fn new(task: u32, tasks: u32) -> Option<Self> {
        (task < tasks).then_some(Self { task, tasks })
    }

    /// Which task, counted from 0.
    pub fn task(&self) -> u32 {
        self.task
    }

    /// Number of tasks in all.
    pub fn tasks(&self) -> u32 {
        self.tasks
    }

    /// Whether a shard is this task's.
    pub fn holds(&self, shard: ShardId) -> bool {
        shard.0 % self.tasks == self.task
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_shard_is_one_tasks() {
        for tasks in [1, 2, 7, 100] {
            let shares: Vec<_> = (0..tasks).map(|task| Share::new(task, tasks).expect("a task")).collect();
            for shard in (0..50).map(ShardId) {
                assert_eq!(shares.iter().filter(|share| share.holds(shard)).count(), 1, "{shard:?} of {tasks}");
            }
        }
        assert_eq!(Share::new(3, 3), None);
        assert_eq!(Share::new(0, 0), None);
    }
}

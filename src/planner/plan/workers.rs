//! Tasks on several threads, their results in the order of the tasks.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// Does every task once with one of the workers; results are in the order of the tasks.
pub(super) fn run_tasks<W: Send, T: Sync, R: Send>(
    workers: &mut [W],
    tasks: &[T],
    work: impl Fn(&mut W, &T) -> R + Sync,
) -> Vec<R> {
    if let [worker] = workers {
        return tasks.iter().map(|task| work(worker, task)).collect();
    }
    let (next, results) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(tasks.len())));
    thread::scope(|scope| {
        for worker in workers {
            scope.spawn(|| {
                while let Some((index, task)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    tasks.get(index).map(|task| (index, task))
                } {
                    let result = work(worker, task);
                    results.lock().expect("no thread panics with the lock").push((index, result));
                }
            });
        }
    });
    let mut results = results.into_inner().expect("no thread panics with the lock");
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_tasks() {
        let tasks: Vec<u64> = (0..500).collect();
        for threads in [1, 2, 5] {
            let found = run_tasks(&mut vec![(); threads], &tasks, |(), task| task * task);
            assert_eq!(found, tasks.iter().map(|task| task * task).collect::<Vec<_>>());
        }
    }
}

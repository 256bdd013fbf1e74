//! Things that are dear to make, kept by all threads while they are used.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// The things that were used last, by their index.
pub struct Recent<T> {
    /// Things that are kept, at most.
    most: usize,
    kept: Mutex<Kept<T>>,
}

struct Kept<T> {
    /// Number of uses so far.
    clock: u64,
    /// With the time of the last use.
    things: BTreeMap<usize, (u64, Arc<T>)>,
}

impl<T> Recent<T> {
    /// Empty at first; keeps at most this number of things.
    pub fn new(most: usize) -> Self {
        Self { most, kept: Mutex::new(Kept { clock: 0, things: BTreeMap::new() }) }
    }

    /// A thing; one that is not kept is made, by two threads at once perhaps.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn get<E>(&self, index: usize, make: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        if let Some(found) = self.find(index) {
            return Ok(found);
        }
        let made = Arc::new(make()?);
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Kept { clock, things } = &mut *kept;
        *clock += 1;
        things.insert(index, (*clock, Arc::clone(&made)));
        if things.len() > self.most {
            let oldest = things.iter().min_by_key(|(_, (used, _))| *used).map(|(index, _)| *index);
            oldest.and_then(|oldest| things.remove(&oldest));
        }
        Ok(made)
    }

    fn find(&self, index: usize) -> Option<Arc<T>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Kept { clock, things } = &mut *kept;
        *clock += 1;
        let (used, found) = things.get_mut(&index)?;
        *used = *clock;
        Some(Arc::clone(found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let recent = Recent::new(2);
        let get = |index: usize| *recent.get(index, || Ok::<_, ()>(10 * index)).expect("made");
        let is_kept = |index: usize| recent.get(index, || Err(())).is_ok();
        assert_eq!([1, 2, 1, 3].map(get), [10, 20, 10, 30]);
        assert!(is_kept(1) && !is_kept(2) && is_kept(3));
    }
}

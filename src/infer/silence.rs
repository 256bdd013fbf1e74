//! Panics of the library on this thread become errors and are not printed.

use std::{
    any::Any,
    cell::Cell,
    panic::{self, AssertUnwindSafe, PanicHookInfo, catch_unwind},
    sync::{Mutex, PoisonError, RwLock},
};

type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>;

thread_local! {
    /// Nested calls of [`catch`] on this thread.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Running calls on all threads: the first one removes the program's hook, the last one restores it.
static RUNNING: Mutex<u32> = Mutex::new(0);
/// The program's own hook while calls are running; threads outside calls still print with it.
static PROGRAMS_HOOK: RwLock<Option<Hook>> = RwLock::new(None);

/// Runs a function of the library; a panic becomes an error with its message and is not printed. Panics of other threads are
/// printed as before.
pub(crate) fn catch<T>(function: impl FnOnce() -> T) -> Result<T, String> {
    let _silence = Silence::begin();
    catch_unwind(AssertUnwindSafe(function)).map_err(|panic| words_of(&*panic))
}

struct Silence;

impl Silence {
    fn begin() -> Self {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        if *running == 0 {
            let hook = panic::take_hook();
            *PROGRAMS_HOOK.write().unwrap_or_else(PoisonError::into_inner) = Some(hook);
            panic::set_hook(Box::new(print_unless_silent));
        }
        *running += 1;
        DEPTH.set(DEPTH.get() + 1);
        Self
    }
}

impl Drop for Silence {
    fn drop(&mut self) {
        DEPTH.set(DEPTH.get() - 1);
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        *running -= 1;
        if *running == 0 {
            let hook = PROGRAMS_HOOK.write().unwrap_or_else(PoisonError::into_inner).take();
            hook.into_iter().for_each(panic::set_hook);
        }
    }
}

fn print_unless_silent(info: &PanicHookInfo<'_>) {
    if DEPTH.get() > 0 {
        return;
    }
    if let Some(hook) = &*PROGRAMS_HOOK.read().unwrap_or_else(PoisonError::into_inner) {
        hook(info);
    }
}

/// Message of a panic, with bounded length.
fn words_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("the library failed").chars().take(300).flat_map(char::escape_debug).collect()
}

#[cfg(test)]
mod tests {
    use std::{
        sync::{
            Arc, Barrier,
            atomic::{AtomicUsize, Ordering},
        },
        thread,
    };

    use super::*;

    /// One test alone, since the hook belongs to the whole process.
    #[test]
    fn panics_inside_are_silent_those_of_other_threads_are_not_and_the_hook_comes_back() {
        let heard = Arc::new(AtomicUsize::new(0));
        let before = panic::take_hook();
        let counter = Arc::clone(&heard);
        panic::set_hook(Box::new(move |info| {
            if info.payload().downcast_ref::<&str>().is_some_and(|text| text.starts_with("for this test")) {
                counter.fetch_add(1, Ordering::SeqCst);
            }
        }));

        assert_eq!(catch(|| 7), Ok(7));
        assert_eq!(catch(|| -> u32 { panic!("for this test: silent") }), Err("for this test: silent".to_owned()));
        assert_eq!(heard.load(Ordering::SeqCst), 0);

        // Two threads inside at once, and one outside that panics meanwhile.
        let meet = Barrier::new(3);
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let caught = catch(|| {
                        meet.wait();
                        meet.wait();
                        panic!("for this test: silent");
                    });
                    assert!(caught.is_err());
                });
            }
            meet.wait();
            let outside = scope.spawn(|| panic!("for this test: heard"));
            assert!(outside.join().is_err());
            meet.wait();
        });
        assert_eq!(heard.load(Ordering::SeqCst), 1);

        assert!(thread::spawn(|| panic!("for this test: heard again")).join().is_err());
        assert_eq!(heard.load(Ordering::SeqCst), 2, "the program's hook is back");
        panic::set_hook(before);
    }
}

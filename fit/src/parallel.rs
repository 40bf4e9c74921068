//! Independent work on as many threads as the machine lends, with results that do not depend on how many there are.

use biscale::error::{Error, Result};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does the work of each item on as many threads as the machine lends, each by itself on one; results in the order of the items.
///
/// # Errors
/// The first error, by the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(usize, &T) -> Result<R> + Sync) -> Result<Vec<R>> {
    let threads = rayon::current_num_threads().clamp(1, items.len().max(1));
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<Option<Result<R>>>> = Mutex::new((0..items.len()).map(|_| None).collect());
    let worker = || -> Result<()> {
        // What the library does in parallel is done by this thread alone.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|e| Error::Numeric(format!("cannot start a thread: {e}")))?;
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return Ok(()) };
            let result = pool.install(|| work(at, item));
            results.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[at] = Some(result);
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.into_iter().map(|r| r.expect("every item was worked on")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_once_each_and_comes_in_order_and_errors_are_passed_on() {
        let items: Vec<usize> = (0..20).collect();
        assert_eq!(in_parallel(&items, |at, &item| Ok(at * 100 + item)).unwrap(), (0..20).map(|k| k * 101).collect::<Vec<_>>());
        let failed = in_parallel(&items, |_, &item| if item == 3 { Err(Error::Numeric("three".into())) } else { Ok(()) });
        assert!(failed.unwrap_err().to_string().contains("three"));
    }
}

//! Independent tasks on all cores.

use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// See [`tasks_done`].
static DONE: AtomicU64 = AtomicU64::new(0);

/// How many tasks this process has done, simulations and fits alike: a waiting caller sees by it that the work goes on.
pub fn tasks_done() -> u64 {
    DONE.load(Ordering::Relaxed)
}

/// `task` of each item, in the order of the items. rayon's iterators are compiled once, below, instead of for every closure:
/// in the diagnosis they were a twelfth of its code. A task that panics lets the caller panic.
pub fn map<T: Send, R: Send>(items: impl IntoIterator<Item = T>, task: impl Fn(T) -> R + Sync) -> Vec<R> {
    enum ResultCell<T, R> {
        Open(T),
        Taken,
        Done(R),
    }
    let cells: Vec<Mutex<ResultCell<T, R>>> =
        items.into_iter().map(|t| Mutex::new(ResultCell::Open(t))).collect();
    let put = |i: usize, new: ResultCell<T, R>| {
        let mut cell = cells[i].lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *cell, new)
    };
    each(cells.len(), &|i| {
        if let ResultCell::Open(item) = put(i, ResultCell::Taken) {
            let done = task(item);
            put(i, ResultCell::Done(done));
            DONE.fetch_add(1, Ordering::Relaxed);
        }
    });
    let done = |cell: Mutex<ResultCell<T, R>>| match cell.into_inner().unwrap_or_else(PoisonError::into_inner)
    {
        ResultCell::Done(r) => Some(r),
        ResultCell::Open(_) | ResultCell::Taken => None,
    };
    cells.into_iter().filter_map(done).collect()
}

/// Two tasks in parallel.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

fn each(count: usize, task: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(task);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_their_items() {
        let squares = map(0..1000_u64, |k| k * k);
        assert_eq!(squares, (0..1000).map(|k| k * k).collect::<Vec<u64>>());
        let owned = map(vec!["a".to_owned(), "b".to_owned()], |s| s + "!");
        assert_eq!(owned, ["a!", "b!"]);
    }

    #[test]
    #[should_panic(expected = "of a task")]
    fn the_panic_of_a_task_reaches_the_caller() {
        map(0..8, |k| assert!(k != 5, "the panic of a task"));
    }
}

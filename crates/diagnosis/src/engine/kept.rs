//! What was computed once: a report needs the same free runs again and again, with the same numbers.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// Results that are kept at most; the oldest is dropped first.
const MOST: usize = 64;

type Anything = Box<dyn Any + Send>;

/// Results of any kind by what they are of, the newest last.
#[derive(Debug, Default)]
pub(super) struct KeptResults(Mutex<VecDeque<(Anything, Anything)>>);

impl KeptResults {
    /// The result of this kind that is kept, or that is made now. Errors are not kept.
    pub(super) fn get_or<K, T, E>(&self, key: K, make: impl FnOnce() -> Result<T, E>) -> Result<T, E>
    where
        K: PartialEq + Send + 'static,
        T: Clone + Send + 'static,
    {
        let all = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |(of, result): &(Anything, Anything)| {
            of.downcast_ref::<K>().filter(|of| **of == key).and_then(|_| result.downcast_ref::<T>()).cloned()
        };
        if let Some(found) = all().iter().find_map(same) {
            return Ok(found);
        }
        let made = make()?;
        let mut all = all();
        if all.len() == MOST {
            all.pop_front();
        }
        all.push_back((Box::new(key), Box::new(made.clone())));
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_made_once_as_long_as_it_is_kept_and_an_error_is_not_kept() {
        let kept = KeptResults::default();
        let mut made = Vec::new();
        let others: Vec<u32> = (10..9 + MOST as u32).collect();
        for key in [&[1, 2, 1, 2][..], &others, &[2, 1, 2]].concat() {
            let result = kept.get_or(key, || {
                made.push(key);
                if made.len() == 2 { Err("once") } else { Ok(10 * key) }
            });
            assert!(result.is_err() || result == Ok(10 * key));
        }
        // 2 failed at first; with one more than is kept 1 was dropped, and then made again in place of 2.
        assert_eq!(made, [&[1, 2, 2][..], &others, &[1, 2]].concat());
        // Another kind of the same key.
        assert_eq!(kept.get_or(1_u32, || Ok::<_, ()>("text")), Ok("text"));
    }
}

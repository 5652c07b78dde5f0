//! The event iteration: discrete states are updated until nothing requires another pass.

use crate::{AnyInstance, EventInfo, ImportError};

/// Passes of one event iteration after which it is assumed to be endless.
pub const MOST_PASSES: usize = 100;

/// Makes passes until one requires no other one. The result has what any of them changed, and the next time event of the last;
/// `None`: [`MOST_PASSES`] were not enough.
///
/// # Errors
/// Those of a pass.
pub fn iterate_events<E>(mut pass: impl FnMut() -> Result<EventInfo, E>) -> Result<Option<EventInfo>, E> {
    let mut all = EventInfo::default();
    for _ in 0..MOST_PASSES {
        let info = pass()?;
        all.next_event = info.next_event.filter(|t| t.is_finite());
        all.states_changed |= info.states_changed;
        all.nominals_changed |= info.nominals_changed;
        all.terminate |= info.terminate;
        if all.terminate || !info.again {
            return Ok(Some(all));
        }
    }
    Ok(None)
}

impl AnyInstance {
    /// In event mode: the event iteration of this FMU alone.
    ///
    /// # Errors
    /// Whatever the FMU returns; [`ImportError::EventIteration`].
    pub fn iterate_events(&mut self) -> Result<EventInfo, ImportError> {
        let settled = iterate_events(|| self.update_discrete_states())?;
        settled.ok_or_else(|| self.endless_iteration())
    }

    /// It requested another pass each time.
    pub(crate) fn endless_iteration(&self) -> ImportError {
        ImportError::EventIteration { instance: self.name().to_owned(), passes: MOST_PASSES, log: self.log() }
    }
}

#[cfg(test)]
mod tests {
    use super::{EventInfo, MOST_PASSES, iterate_events};

    #[test]
    fn passes_end_with_the_first_that_requires_no_other_one() {
        let mut made = 0;
        let all = iterate_events(|| {
            made += 1;
            Ok::<_, ()>(EventInfo {
                again: made < 3,
                states_changed: made == 1,
                next_event: Some(f64::from(made)),
                ..EventInfo::default()
            })
        });
        let wanted = EventInfo { states_changed: true, next_event: Some(3.0), ..EventInfo::default() };
        assert_eq!((all, made), (Ok(Some(wanted)), 3));
    }

    #[test]
    fn an_fmu_that_ends_the_run_makes_no_further_pass_and_an_endless_one_is_given_up() {
        let mut made = 0;
        let mut passes = |terminate| {
            made = 0;
            let all = iterate_events(|| {
                made += 1;
                Ok::<_, ()>(EventInfo { again: true, terminate, ..EventInfo::default() })
            });
            (all.map(|all| all.map(|all| all.terminate)), made)
        };
        assert_eq!(passes(true), (Ok(Some(true)), 1));
        assert_eq!(passes(false), (Ok(None), MOST_PASSES));
    }
}

//! What was computed of a model once: a report needs the same free runs again and again, with the same numbers.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use nalgebra::DMatrix;

use super::hypothesis::Hypothesis;
use super::problem::{BalanceUnknown, Compared};
use super::recordings::PreparedCase;
use super::replay::{CompleteModel, FittedReplay, FreeRunFit, Window};

/// Results of the same kind by what they are of, the newest last; the oldest is dropped where there are too many.
#[derive(Debug)]
struct KeptResults<K, T> {
    all: Mutex<VecDeque<(K, T)>>,
    most: usize,
}

impl<K: PartialEq, T: Clone> KeptResults<K, T> {
    fn new(most: usize) -> Self {
        Self { all: Mutex::new(VecDeque::new()), most }
    }
    /// The result that is kept, or that is made now. Errors are not kept.
    fn get_or<E>(&self, key: K, make: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let all = || self.all.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = all().iter().find(|(k, _)| *k == key) {
            return Ok(found.clone());
        }
        let made = make()?;
        let mut all = all();
        if all.len() == self.most {
            all.pop_front();
        }
        all.push_back((key, made.clone()));
        Ok(made)
    }
}

/// A model with its values. Of one case its equations follow from its causes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ModelKey {
    set: Vec<Hypothesis>,
    nominal: Vec<f64>,
    unknowns: Vec<BalanceUnknown>,
    theta: Vec<f64>,
}

impl ModelKey {
    /// Of a model.
    pub(super) fn of(complete: &CompleteModel) -> Self {
        let s = &complete.stated;
        let (set, unknowns) = (s.set.clone(), s.unknowns.clone());
        Self { set, nominal: s.nominal.clone(), unknowns, theta: complete.theta.clone() }
    }
}

/// Whether recordings are those for fitting or those held out; `None`: neither, they may be gone when the next ones are computed.
fn part_of(case: &PreparedCase, runs: &[Compared]) -> Option<usize> {
    [&case.train, &case.holdout].iter().position(|own| std::ptr::eq(&own[..], runs))
}

/// What a search keeps.
#[derive(Debug)]
pub(super) struct SearchMemory {
    replays: KeptResults<(ModelKey, usize), FittedReplay>,
    floors: KeptResults<(ModelKey, usize, u64), Vec<Vec<f64>>>,
    windows: KeptResults<(ModelKey, usize, f64), Vec<Window>>,
    polished: KeptResults<(ModelKey, DMatrix<f64>, usize), FreeRunFit>,
}

impl Default for SearchMemory {
    fn default() -> Self {
        let (replays, floors) = (KeptResults::new(48), KeptResults::new(8));
        Self { replays, floors, windows: KeptResults::new(8), polished: KeptResults::new(4) }
    }
}

impl SearchMemory {
    /// A recording of the case as it runs freely from where it fits best.
    pub(super) fn replay<E>(
        &self,
        case: &PreparedCase,
        (complete, run): (&CompleteModel, &Compared),
        make: impl FnOnce() -> Result<FittedReplay, E>,
    ) -> Result<FittedReplay, E> {
        match case.train.iter().chain(&case.holdout).position(|own| std::ptr::eq(own, run)) {
            Some(at) => self.replays.get_or((ModelKey::of(complete), at), make),
            None => make(),
        }
    }
    /// What noise leaves of recordings of the case.
    pub(super) fn floors<E>(
        &self,
        case: &PreparedCase,
        (complete, runs, seed): (&CompleteModel, &[Compared], u64),
        make: impl FnOnce() -> Result<Vec<Vec<f64>>, E>,
    ) -> Result<Vec<Vec<f64>>, E> {
        match part_of(case, runs) {
            Some(part) => self.floors.get_or((ModelKey::of(complete), part, seed), make),
            None => make(),
        }
    }
    /// Windows of recordings of the case.
    pub(super) fn windows<E>(
        &self,
        case: &PreparedCase,
        (complete, runs, seconds): (&CompleteModel, &[Compared], f64),
        make: impl FnOnce() -> Result<Vec<Window>, E>,
    ) -> Result<Vec<Window>, E> {
        match part_of(case, runs) {
            Some(part) => self.windows.get_or((ModelKey::of(complete), part, seconds), make),
            None => make(),
        }
    }
    /// A set that is fitted once more, freely; `information`: that of its estimate.
    pub(super) fn polished(
        &self,
        (complete, information, iterations): (CompleteModel, &DMatrix<f64>, usize),
        make: impl FnOnce() -> FreeRunFit,
    ) -> FreeRunFit {
        let key = (ModelKey::of(&complete), information.clone(), iterations);
        let made = || Ok::<_, std::convert::Infallible>(make());
        match self.polished.get_or(key, made) {
            Ok(fit) => fit,
            Err(never) => match never {},
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_made_once_as_long_as_it_is_kept_and_an_error_is_not_kept() {
        let kept: KeptResults<u32, u32> = KeptResults::new(2);
        let mut made = Vec::new();
        for key in [1, 2, 1, 2, 3, 2, 1, 2] {
            let result = kept.get_or(key, || {
                made.push(key);
                if made.len() == 2 { Err("once") } else { Ok(10 * key) }
            });
            assert!(result.is_err() || result == Ok(10 * key));
        }
        // 2 failed at first; 3 took the place of 1, which then took that of 2.
        assert_eq!(made, [1, 2, 2, 3, 1, 2]);
    }
}

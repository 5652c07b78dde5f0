//! Odds of sets by their balances alone.

use super::Thresholds;
use crate::engine::search::{FittedSet, Octave};
use crate::engine::select::SearchResult;

/// What the balances of a set come to.
struct Left<'a> {
    octaves: &'a [Octave],
    /// Sum of squares over the priors, and how many readings there are.
    prior2: f64,
    count: f64,
    /// What its unknowns cost.
    occam: f64,
}

impl<'a> From<&'a FittedSet> for Left<'a> {
    fn from(f: &'a FittedSet) -> Self {
        Self { octaves: &f.octaves, prior2: f.prior2, count: f.count(), occam: f.occam }
    }
}

/// What balances count by.
#[derive(Clone, Copy, Debug)]
pub struct Balances {
    /// Readings that count where the size of the misfit is not known.
    independent: f64,
    /// Share of the floor's power that is left at the least.
    pub(super) least: f64,
    /// Share of the readings that counts where all is misfit.
    form: f64,
}

impl Balances {
    /// As the best set leaves them.
    pub fn new(found: &SearchResult, limits: &Thresholds) -> Self {
        Self {
            independent: (found.best.count() * limits.balances.trust).min(limits.balances.most),
            least: found.least(),
            form: limits.balances.form,
        }
    }

    /// Odds (natural logarithm) of set `a` against set `b`: by the logarithm of what they leave and by its ratio to
    /// the noise, whichever is more certain where both agree. A late command against a late reading by the logarithm alone:
    /// the one moves the input's noise and the other does not, which is what they differ by at the floor.
    pub fn odds(&self, a: &FittedSet, b: &FittedSet) -> f64 {
        let late = a.is_late_where(b);
        let [a, b] = [a, b].map(Left::from);
        if late { self.by_size(&a, &b) } else { self.of(&a, &b) }
    }

    /// By the logarithm of what they leave.
    fn by_size(&self, a: &Left<'_>, b: &Left<'_>) -> f64 {
        self.concentrated(a) - self.concentrated(b) + possible(a, b)
    }

    fn of(&self, a: &Left<'_>, b: &Left<'_>) -> f64 {
        let apart = self.by_size(a, b);
        let plain = self.relative_to_misfit(a, b) + possible(a, b);
        if plain * apart > 0.0 && plain.abs() > apart.abs() { plain } else { apart }
    }

    /// Half the number of readings that count as independent, times the logarithm of the power that is left: what the
    /// likelihood is when the size of the misfit is not known.
    fn concentrated(&self, left: &Left<'_>) -> f64 {
        let power = |o: &Octave| (o.squares / o.expected).max(0.5 * self.least);
        let mean = left.octaves.iter().map(|o| power(o).ln()).sum::<f64>() / left.octaves.len() as f64;
        -0.5 * self.independent * (mean + left.prior2 / left.count)
    }

    /// Half the difference of the sums of squares in units of what the better of the two leaves, noise or misfit, octave by
    /// octave: a misfit is no noise, so that readings count the less the more of it there is.
    fn relative_to_misfit(&self, a: &Left<'_>, b: &Left<'_>) -> f64 {
        let of = |(a, b): (&Octave, &Octave)| {
            if a.expected <= 0.0 {
                return 0.0;
            }
            let size = (a.squares.min(b.squares) / a.expected).max(1.0);
            let misfit = 1.0 - 1.0 / size;
            let counts = 1.0 / (1.0 + misfit * (1.0 / self.form - 1.0));
            counts * a.count * (b.squares - a.squares) / (a.expected * size)
        };
        let readings: f64 = a.octaves.iter().zip(b.octaves).map(of).sum();
        0.5 * (readings + b.prior2 - a.prior2)
    }
}

/// How much was possible before is known to half.
fn possible(a: &Left<'_>, b: &Left<'_>) -> f64 {
    0.5 * (a.occam - b.occam)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Odds of sets that leave these powers, in floors, of 100 readings each.
    fn odds(a: [f64; 2], b: [f64; 2]) -> f64 {
        let balances = Balances { independent: 20.0, least: 1.0, form: 0.3 };
        let [a, b] =
            [a, b].map(|powers| powers.map(|p| Octave { squares: 100.0 * p, expected: 100.0, count: 100.0 }));
        let left = |octaves| Left { octaves, prior2: 0.0, count: 200.0, occam: 0.0 };
        balances.of(&left(&a), &left(&b))
    }

    #[test]
    fn noise_counts_in_full_and_misfit_in_part() {
        // At the floor: the plain likelihood, 100 (1.4 - 1) / 2.
        assert!((odds([1.0, 1.0], [1.0, 1.4]) - 20.0).abs() < 1e-9);
        assert!((odds([1.0, 1.4], [1.0, 1.0]) + 20.0).abs() < 1e-9);
        // A thousand floors of misfit: 0.3 of it compared with its own size.
        let far = odds([1000.0, 1000.0], [1000.0, 1400.0]);
        assert!((far - 0.3 * 20.0).abs() < 0.1, "{far}");
        // By the logarithm the first is the better one, by the noise the second: the logarithm holds.
        let torn = odds([400.0, 1.5], [1000.0, 1.0]);
        assert!((torn - 5.0 * (2.5f64.ln() - 1.5f64.ln())).abs() < 1e-9, "{torn}");
    }
}

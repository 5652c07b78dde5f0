//! Where the lines between verdicts are.

use crate::engine::select::{PLAIN, REQUIRED, WHOLLY};

/// Figures that were set on trials whose seeds are not those reported.
#[derive(Clone, Copy, Debug, Default)]
pub struct Thresholds {
    /// Whether there is a gap, and what makes its cause known.
    pub gap: OfGap,
    /// What balances say of sets.
    pub balances: OfBalances,
    /// What free-running simulations say of sets.
    pub free_runs: OfFreeRuns,
    /// How sure one cause is against another.
    pub odds: OfOdds,
}

/// Whether there is a gap, and what makes its cause known.
#[derive(Clone, Copy, Debug)]
pub struct OfGap {
    /// A gap is there when the power of the nominal model's residuals exceeds what the best explanation leaves by this share.
    pub shown: f64,
    /// ... or, where nothing explains it, the floor's by this; by so much a gap is plain whatever the held-out recordings are.
    pub bare: f64,
    /// Share of the balances' excess, or of the free-running gap, that an explanation has to take; below it the cause is unknown.
    pub explained: f64,
    /// Share of the balances' excess that makes a cause known by itself where nothing plain is left.
    pub known: f64,
    /// Share of either below which the other alone does not do.
    pub neither: f64,
    /// Excess that may be left whatever the share.
    pub left: f64,
    /// Times what chance leaves from which a free-running gap that nothing explains is missed, whatever the balances say.
    pub missed: f64,
    /// Share of the gap of the nominal model that refitted parameters may leave to be all that was wrong.
    pub refitted: f64,
    /// Refitted parameters that leave more than this share of a gap that only free runs show do not help.
    pub luck: f64,
    /// How steeply the odds of an unknown cause fall with the share that is explained.
    pub steep: f64,
    /// Probability of an unknown cause where no effect is claimed, at the most.
    pub unknown_at_most: f64,
}

/// What balances say of sets.
#[derive(Clone, Copy, Debug)]
pub struct OfBalances {
    /// How much of the log-likelihood ratio of the residual powers counts: the rest is attributed to form.
    pub trust: f64,
    /// Most readings that count.
    pub most: f64,
    /// Share of the readings that counts in what is misfit, where it is compared with the noise.
    pub form: f64,
    /// A cause less is no matter of a form where the whole set brings so much evidence,
    pub required: f64,
    /// and takes this share of what is missed without,
    pub wholly: f64,
    /// which is more than this share of what is missed without any.
    pub nothing: f64,
}

/// What free-running simulations say of sets.
#[derive(Clone, Copy, Debug)]
pub struct OfFreeRuns {
    /// How much the logarithm of the gap (as a power) counts.
    pub weight: f64,
    /// Times the floor up to which a simulation is as good as perfect.
    pub near: f64,
    /// Times the floor up to which gaps are alike.
    pub even: f64,
    /// Times the gap of the tuned model beyond which a free run is no evidence.
    pub diverging: f64,
    /// Two predictions that are apart by less than this share of the gap that is left are alike.
    pub alike: f64,
    /// A further cause has to divide the gap (as a power) by this where the balances do not require it,
    pub more: f64,
    /// and to take this share of what the tuned model leaves (as powers): less is attributed to the form of the others.
    pub form: f64,
    /// A cause less is as good when its gap (as a power) is less than this times that of the whole set, unless the balances
    /// require that.
    pub needless: f64,
    /// A set that leaves more than this share of what the tuned model leaves (as powers) changes nothing.
    pub idle: f64,
    /// Another effect by itself takes its place where it leaves less than this share of what that set leaves (as powers).
    pub instead: f64,
}

/// How sure one cause is against another, as natural logarithms.
#[derive(Clone, Copy, Debug)]
pub struct OfOdds {
    /// Odds below which two causes are not distinguished.
    pub apart: f64,
    /// Odds that the unknowns' ranges alone may bring for one cause against another.
    pub possible: f64,
    /// Odds of the balances that free runs cannot turn,
    pub decisive: f64,
    /// and those that count though free runs are alike.
    pub outweighs: f64,
}

impl Default for OfGap {
    fn default() -> Self {
        Self {
            shown: 0.06,
            bare: 2.0,
            explained: 0.8,
            known: 0.95,
            neither: 0.2,
            left: PLAIN,
            missed: 1.5,
            refitted: 0.1,
            luck: 0.8,
            steep: 12.0,
            unknown_at_most: 0.05,
        }
    }
}

impl Default for OfBalances {
    fn default() -> Self {
        Self { trust: 0.05, most: 400.0, form: 0.3, required: REQUIRED, wholly: WHOLLY, nothing: 1e-3 }
    }
}

impl Default for OfFreeRuns {
    fn default() -> Self {
        Self {
            weight: 4.0,
            near: 2.0,
            even: 1.2,
            diverging: 1.5,
            alike: 0.5,
            more: 3.0,
            form: 0.1,
            needless: 1.2,
            idle: 0.5,
            instead: 0.25,
        }
    }
}

impl Default for OfOdds {
    fn default() -> Self {
        Self { apart: 3.0, possible: 1.0, decisive: 40.0, outweighs: 12.0 }
    }
}

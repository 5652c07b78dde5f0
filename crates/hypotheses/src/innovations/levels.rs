//! Numbers that judge, fitted to trial cases of development seeds by logistic regression.
//!
//! `RIGHT`: `tools/levels/fit_levels.py` on the 150 joints of seed 91117 (98 rows), near the weights of the reference program (83 cases of
//! seed 88002; 114 of 88002 to 88008). `SECOND`: the same on 705 joints of seed 731130 (559 rows), near those of 91117
//! (docs/decisions/0112-levels-of-705-joints.md). Rules: 88003 to 88008; what latents are worth also on 91117.
//! `CHAIN_RIGHT`: the same program on arms of seeds 650521, 640077 and 88101 to 88111 (61 of 102 name something).

/// Weights of a logistic model, by name of the number.
pub type LogisticWeights = &'static [(&'static str, f64)];

/// The leader is right.
pub const RIGHT: LogisticWeights = &[
    ("bias", -13.831_096_398),
    ("gain", 3.569_848_045),
    ("power", 1.038_536_512),
    ("left", -1.758_619_733),
    ("rate", -0.763_957_5),
    ("had", -0.707_728_278),
];
/// A second one next to a right leader is right.
pub const SECOND: LogisticWeights = &[
    ("bias", -4.060_565_406),
    ("gain", 0.689_699_826),
    ("share", 4.144_542_132),
    ("power", 0.513_662_898),
    ("left", -0.469_010_867),
    ("same", -6.822_453_348),
];
/// Nats that an effect has to gain.
pub const QUIET: f64 = 20.0;
/// Nats within which two effects are alike, and the share of the gain.
pub const ALIKE: [f64; 2] = [12.0, 0.02];
/// Nats of the fits alone within which two effects are alike, whatever the width of their priors; see decision 89.
pub const ALIKE_FIT: f64 = 3.0;
/// Share of the gain of a late drive that a late reading has, or the other way round, from which on both are one where one angle is read.
pub const ONE_SHIFT: f64 = 0.75;
/// Effects of an ambiguous set at most.
pub const ALIKE_MOST: usize = 4;
/// Nats that the latents are worth, above which something is left.
pub const WORTH: f64 = 200.0;
/// Standard deviations of a parameter, above which a refit explains nothing.
pub const ODD: f64 = 2.7;
/// Nats from which on refitted parameters are a finding.
pub const PARAMETERS: f64 = 8.0;
/// Nats below which a leader has to take latent power away; the second where the latents had none.
pub const SMALL: [f64; 2] = [300.0, 90.0];
/// Power of latents that are at their floor.
pub const FLOOR: f64 = 1e-6;
/// An intensity above which the model is not followed.
pub const LOST: f64 = 5.0;
/// Least fall of the latents' power, in decades: of a small leader, and of a pair whose leader is not accepted.
pub const FALL: [f64; 2] = [0.1, 0.3];
/// Intensity above which alike is also a share of the gain.
pub const AUDIBLE: f64 = 0.002;
/// Change of slope of a spring, below which it is another stiffness.
pub const EQUAL_SLOPES: f64 = 0.05;

/// Numbers that judge a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainLevels {
    /// Nats that an effect has to gain, and that refitted parameters have to gain to be a finding.
    pub quiet: f64,
    /// Nats below which an effect gains nothing.
    pub nothing: f64,
    /// Latents in floors that matter: at least, and as a share of the largest.
    pub matters: f64,
    /// See `matters`.
    pub matters_share: f64,
    /// Latents in floors that are left over where nothing gains anything.
    pub loud: f64,
    /// Latents in floors below which all is explained.
    pub explained: f64,
    /// Share of the latents' power that an effect has to take away.
    pub share: f64,
    /// Nats that a second has to gain: at least, and as a share of the first's gain.
    pub second: f64,
    /// See `second`.
    pub second_share: f64,
    /// Fall of a latent's power that a second has to reach.
    pub fall_of_second: f64,
    /// Nats within which two effects are alike: at least, as a share of the gain, and at most.
    pub alike: f64,
    /// See `alike`.
    pub alike_share: f64,
    /// See `alike`.
    pub alike_most: f64,
    /// Probability of an effect that is not named.
    pub unnamed: f64,
}

/// Of the reference program for arms: chosen on its tables of 28 sealed arms and 27 of another simulator (right: 25 and 24); twelve of
/// its cases are the golden ones.
pub const CHAIN: ChainLevels = ChainLevels {
    quiet: 20.0,
    nothing: 8.0,
    matters: 6.0,
    matters_share: 0.1,
    loud: 20.0,
    explained: 4.0,
    share: 0.55,
    second: 30.0,
    second_share: 0.02,
    fall_of_second: 0.9,
    alike: 6.0,
    alike_share: 0.01,
    alike_most: 15.0,
    // 49 of its 55 verdicts are right; by the rule of succession (6 + 1) / (55 + 2).
    unnamed: 0.12,
};

/// What is named of a chain is right.
pub const CHAIN_RIGHT: LogisticWeights = &[("bias", -0.509_853_231), ("fall", 1.060_689_235)];

/// The heavy tail of the sizes of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeTail {
    /// Width of its prior, in those of the one before.
    pub wide: f64,
    /// Nats that each widening costs.
    pub cost: f64,
    /// Nats by which it has to be better than the usual width, in addition to its cost.
    pub better: f64,
    /// Nats below the base from which on it is not tried.
    pub hopeless: f64,
}

/// Of the reference program for arms, as [`CHAIN`].
pub const TAIL: SizeTail = SizeTail { wide: 6.0, cost: 1.0, better: 0.5, hopeless: 5.0 };

/// Numbers by which the search of a chain goes on. Nats are of evidence, latents are in their floors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainSearchLevels {
    /// Nats that the prior of each push costs.
    pub each_push: f64,
    /// Nats that the prior of a delay costs.
    pub delay: f64,
    /// Nats that the prior of a spring in a rigid joint costs.
    pub spring: f64,
    /// A latent error of a reading counts as this share of a latent force.
    pub of_readings: f64,
    /// Latents above which something is left to explain.
    pub left: f64,
    /// Power of the latents, as a share of the first one, below which all is explained.
    pub all: f64,
    /// Share of the best gain from which on what explains all counts.
    pub leads: f64,
    /// Nats over the base below which a family is not fitted where another one is.
    pub fitted: f64,
    /// The same where none is.
    pub fitted_alone: f64,
    /// Share of the best gain below which a family is not fitted.
    pub fitted_share: f64,
    /// The same as soon as one explains all.
    pub fitted_share_calm: f64,
    /// Nats of the best from which on effects are fitted again, along their own trajectories and at further joints.
    pub again: f64,
    /// Share of the best gain from which on one is.
    pub again_share: f64,
    /// Nats that one more joint has to gain.
    pub more_joints: f64,
    /// A companion of dry friction below this share of its level is left out: lengths only add up.
    pub companion: f64,
    /// Nats, and share of the plain one's gain, that Stribeck's term has to be worth on top of plain friction.
    pub falling: [f64; 2],
    /// Share of the latents' power that Stribeck's friction may leave of the plain one's, and the latent force below which it need not.
    pub falling_leaves: [f64; 2],
    /// Nats of the screen, and share of its best, from which on a late channel has a frame.
    pub late: [f64; 2],
    /// Latents above which long delays are looked for, and latent forces above which a rigid joint has a spring.
    pub loud: [f64; 2],
    /// Nats that one more push has to gain, and the share of them that it has to gain before it is refined.
    pub push: [f64; 2],
    /// Nats, and share of the best gain, from which on a second is looked for.
    pub first: [f64; 2],
    /// Nats that a second has to gain in the screen.
    pub second: f64,
    /// Share of what one explains, in addition to the parameters, from which on another one can do the same.
    pub same: f64,
    /// Share of the first's power below which no push is looked for.
    pub quiet: f64,
}

/// Of the reference program for arms, as [`CHAIN`].
pub const CHAIN_SEARCH: ChainSearchLevels = ChainSearchLevels {
    each_push: 6.0,
    delay: 3.0,
    spring: 4.0,
    of_readings: 0.1,
    left: 2.5,
    all: 2e-3,
    leads: 0.9,
    fitted: 5.0,
    fitted_alone: -3.0,
    fitted_share: 0.08,
    fitted_share_calm: 0.3,
    again: 15.0,
    again_share: 0.25,
    more_joints: 12.0,
    companion: -0.08,
    falling: [12.0, 0.01],
    falling_leaves: [0.7, 3.0],
    late: [15.0, 0.15],
    loud: [50.0, 4.0],
    push: [22.0, 0.4],
    first: [30.0, 0.4],
    second: 15.0,
    same: 0.9,
    quiet: 0.02,
};

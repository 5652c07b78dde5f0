//! Numbers that judge, taught on trial cases of development seeds by logistic regression.
//!
//! `RIGHT`: 83 cases of seed 88002. `SECOND`: 88002, then 88003 to 88008 (114 cases). Rules: 88003 to 88008; what latents are worth
//! also on 91117.

/// Weights of a logistic model, by name of the number.
pub type LogisticWeights = &'static [(&'static str, f64)];

/// The leader is right.
pub const RIGHT: LogisticWeights = &[
    ("bias", -13.657_457_150_587_987),
    ("gain", 3.797_237_734_998_746),
    ("power", 0.896_448_806_093_905_9),
    ("left", -0.933_316_051_614_741_5),
    ("rate", -1.199_337_434_690_606),
    ("had", -0.185_688_339_888_601_62),
];
/// A second one next to a right leader is right.
pub const SECOND: LogisticWeights = &[
    ("bias", -6.986_940_783_750_443),
    ("gain", 0.912_721_903_742_204_9),
    ("share", 10.647_341_121_528_513),
    ("power", 0.898_230_870_771_200_2),
    ("left", -0.701_845_359_859_537),
    ("same", -3.594_084_483_797_503),
];
/// Nats that an effect has to gain.
pub const QUIET: f64 = 20.0;
/// Nats within which two effects are alike, and the share of the gain.
pub const ALIKE: [f64; 2] = [12.0, 0.02];
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

//! Numbers that judge or bound. What each was set by: docs/decisions/0014-screen-by-innovations.md; those without a line
//! there are first values.

/// Correlation time of a latent torque, s.
pub const CORRELATION: f64 = 0.1;
/// Least standard deviation of a latent torque, in units of the typical torque: what any model may miss.
pub const FLOOR: f64 = 5e-4;
/// Most: beyond, readings alone would tell the motion.
pub const CEILING: f64 = 1.0;
/// What a fit begins with.
pub const BEGIN: f64 = 0.3;
/// Doubt of a parameter that its owner holds to be known, of its logarithm.
pub const KNOWN: f64 = 0.01;
/// Standard deviation of the amplitude of a form of fixed size about 1: sizes that are looked at are a factor 1.5 apart.
pub const FIXED: f64 = 0.08;
/// A form is linear in its amplitude where half of it is half to this share.
pub const LINEAR: f64 = 0.05;
/// Where linearity is looked for, in units of a cause's size.
pub const SMALL: [f64; 2] = [1.0, 0.1];
/// Intensities that a screen points at, in units of the baseline model's.
pub const INTENSITIES: [f64; 3] = [1.0, 0.3, 0.1];
/// Speeds of the motor below which friction may hold it, in units of its typical speed; the likeliest is taken. On 30
/// recordings without a gap (seed 9801) the first against none: +13,700 nats, better in 6, worse in 2.
pub const REST: [f64; 3] = [0.001, 0.003, 0.01];
/// Doubt of every parameter, of its logarithm, where the parameters are what is wrong.
pub const DOUBTED: f64 = 0.5;
/// A second cause is looked for where one leaves so many nats of what could be.
pub const SECOND: f64 = 60.0;
/// What a cause has to gain in a screen, in nats, that any is fitted where nothing else lacks.
pub const SEEN: f64 = 6.0;
/// What is worth noticing, in nats.
pub const NOTICED: f64 = 60.0;
/// What a cause has to gain, in nats, where nothing is known to lack.
pub const ALONE: f64 = 40.0;
/// The same of a law of motor friction: no recording's friction is the model's, not even without a gap (decision 0016).
pub const FRICTION: f64 = 110.0;
/// Share of what could be gained below which no cause explains what lacks.
pub const SHARE: f64 = 0.14;
/// Share of what could be gained that other parameters have to gain.
pub const EXPLAINED: f64 = 0.5;
/// Share of what the first cause brings that a second one has to bring: a right law of another form is off by some three
/// tenths, which leaves their square of its nats (decision 0016).
pub const SECOND_TO_FIRST: f64 = 0.1;
/// Latent torque above which something lacks, in units of the typical torque.
pub const LACKS: f64 = 0.004;
/// By this odds are tempered.
pub const TEMPERATURE: f64 = 8.0;
/// Odds (natural logarithm, tempered) below which two causes are not told apart: they make the set that holds nine tenths.
pub const APART: f64 = 2.2;

//! What is commanded of an axis over time.

use std::f64::consts::{PI, TAU};

use crate::draw::SeededDraw;

/// The families of experiments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Family {
    Triangles,
    Steps,
    Chirp,
    Multisine,
    Reversals,
    /// No position is controlled: the command itself is a multisine.
    OpenLoop,
}

pub(crate) const FAMILIES: [Family; 6] =
    [Family::Triangles, Family::Steps, Family::Chirp, Family::Multisine, Family::Reversals, Family::OpenLoop];

/// Time that passes without motion from 0 on, which is braked for during [`BRAKING`] s.
fn gone(t: f64) -> f64 {
    match t {
        t if t < 0.0 => 0.0,
        t if t < BRAKING => 0.5 * (t - BRAKING / PI * (PI * t / BRAKING).sin()),
        t => t - 0.5 * BRAKING,
    }
}
const BRAKING: f64 = 0.4;

/// A reference: position around `center` whose speed stays near `speed`.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceMotion {
    pub(crate) family: Family,
    pub(crate) center: f64,
    /// It is at rest from the first instant to the second, s.
    pub(crate) stands: Option<(f64, f64)>,
    speed: f64,
    frequency: f64,
    span: f64,
    /// Amplitude of speed, frequency in rad/s, phase.
    lines: Vec<(f64, f64, f64)>,
    levels: Vec<f64>,
}

impl ReferenceMotion {
    /// `top`: highest frequency in Hz that makes sense here.
    pub(crate) fn draw(d: &mut SeededDraw, family: Family, speed: f64, top: f64, span: f64) -> Self {
        let frequency = d.log(0.15, 0.5);
        let mut lines = Vec::new();
        for i in 0..6 {
            let w = TAU * 0.12 * (top / 0.12).powf((f64::from(i) + d.uniform(0.0, 0.8)) / 6.0);
            lines.push((speed * d.uniform(0.2, 0.5), w, d.phase()));
        }
        let reach = speed * 0.6;
        let mut levels: Vec<f64> = (0..64).map(|_| reach * d.uniform(-1.0, 1.0)).collect();
        levels[0] = 0.0;
        Self { family, center: 0.0, stands: None, speed, frequency, span, lines, levels }
    }

    /// Position at `t` in s (may be negative).
    pub(crate) fn at(&self, t: f64) -> f64 {
        let t = self.stands.map_or(t, |(from, to)| t - gone(t - from) + gone(t - to));
        let multisine =
            |t: f64| self.lines.iter().map(|(a, w, p)| a / w * ((w * t + p).sin() - p.sin())).sum::<f64>();
        self.center
            + match self.family {
                Family::Triangles => {
                    // A quarter of the speed, and a corner rounded over 2 % of the period.
                    let v = 0.35 * self.speed;
                    let turn = (TAU * self.frequency * t).sin() * 0.998;
                    v / (TAU * self.frequency) * turn.asin()
                }
                Family::Steps => {
                    let dwell = 0.6 / self.frequency.sqrt();
                    let s = (t / dwell + 8.0).max(0.0);
                    let (i, part) = (s.floor() as usize % 63, s.fract());
                    let blend = 0.5 * (1.0 - (PI * (part / 0.3).min(1.0)).cos());
                    self.levels[i] + (self.levels[i + 1] - self.levels[i]) * blend
                }
                Family::Chirp => {
                    let top = self.lines[5].1 / TAU;
                    let (a, b) = (self.frequency, top);
                    let s = (t + 2.0) / (self.span + 2.0);
                    let f = a * (b / a).powf(s);
                    let phase = TAU * a * (self.span + 2.0) / (b / a).ln() * ((b / a).powf(s) - 1.0);
                    0.6 * self.speed / (TAU * f) * phase.sin()
                }
                Family::Reversals => {
                    let grown = 0.08 + 0.92 * ((t + 2.0) / (self.span + 2.0)).clamp(0.0, 1.0);
                    grown * self.speed / (TAU * 2.0 * self.frequency) * (TAU * 2.0 * self.frequency * t).sin()
                }
                Family::Multisine | Family::OpenLoop => multisine(t),
            }
    }

    /// Its speed.
    pub(crate) fn rate(&self, t: f64) -> f64 {
        let h = 1e-4;
        (self.at(t + h) - self.at(t - h)) / (2.0 * h)
    }

    /// Speed-like multisine between about -1 and 1 with a slow square, for commands without control.
    pub(crate) fn shake(&self, t: f64) -> f64 {
        let fast: f64 =
            self.lines.iter().map(|(a, w, p)| a / self.speed * (w * t + p).cos()).sum::<f64>() / 1.5;
        0.6 * fast + 0.4 * (TAU * self.frequency * t + self.lines[0].2).sin().signum()
    }
}

/// The family of the motion of recording `i`.
pub(crate) fn family(d: &mut SeededDraw, i: usize) -> Family {
    // Slow motion at least once.
    if i == 0 {
        d.pick(&[Family::Triangles, Family::Reversals, Family::Multisine])
    } else {
        d.pick(&FAMILIES)
    }
}

//! What is commanded of the arm: from point to point, or sums of sines, per joint.

use std::f64::consts::TAU;

use super::chain::JOINTS;
use crate::draw::SeededDraw;

/// Time in which sines grow from nothing, s.
const GROWS: f64 = 0.8;

/// What one joint has to do.
#[derive(Clone, Debug)]
enum JointCourse {
    /// Begin, end of each move, and where it leads.
    Points(Vec<(f64, f64, f64)>),
    /// Amplitude, frequency (rad/s), phase.
    Sines(Vec<(f64, f64, f64)>),
    Rests,
}

/// A motion of all joints.
#[derive(Clone, Debug)]
pub(super) struct ArmCourse {
    center: [f64; JOINTS],
    joints: Vec<JointCourse>,
}

impl ArmCourse {
    /// Around `center`, no joint faster than about `speed`, for `span` s; only joint `alone` moves where that is given.
    pub(super) fn draw(
        d: &mut SeededDraw,
        center: [f64; JOINTS],
        speed: &[f64; JOINTS],
        span: f64,
        alone: Option<usize>,
    ) -> Self {
        let points = d.chance(0.45);
        let slow = if d.chance(0.25) { d.uniform(0.15, 0.4) } else { 1.0 };
        let mut joints = Vec::new();
        for (j, top) in speed.iter().enumerate() {
            let top = slow * top;
            let course = if points { points_of(d, top, span) } else { sines_of(d, top) };
            joints.push(if alone.is_none_or(|a| a == j) { course } else { JointCourse::Rests });
        }
        Self { center, joints }
    }

    /// Angle and rate of joint `j` at `t`.
    pub(super) fn at(&self, j: usize, t: f64) -> (f64, f64) {
        let (mut q, mut rate) = (self.center[j], 0.0);
        match &self.joints[j] {
            JointCourse::Rests => {}
            JointCourse::Points(moves) => {
                let mut from = 0.0;
                for (begin, end, to) in moves {
                    let s = ((t - begin) / (end - begin)).clamp(0.0, 1.0);
                    // Least jerk: rest at both ends.
                    let blend = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
                    q += (to - from) * blend;
                    rate += (to - from) * 30.0 * s * s * (1.0 - s) * (1.0 - s) / (end - begin);
                    from = *to;
                }
            }
            JointCourse::Sines(lines) => {
                let s = (t / GROWS).clamp(0.0, 1.0);
                let (grown, growth) = (s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / GROWS);
                for (a, w, phase) in lines {
                    let (sine, cosine) = (w * t + phase).sin_cos();
                    q += grown * a * sine;
                    rate += growth * a * sine + grown * a * w * cosine;
                }
            }
        }
        (q, rate)
    }
}

fn points_of(d: &mut SeededDraw, top: f64, span: f64) -> JointCourse {
    let (mut t, mut from, mut moves) = (d.uniform(0.1, 0.5), 0.0, Vec::new());
    while t < span {
        let to: f64 = d.uniform(-0.7, 0.7);
        // The fastest of a move of least jerk is 15/8 of its mean.
        let lasts = (1.875 * (to - from).abs() / (top * d.uniform(0.5, 1.0))).max(0.4);
        moves.push((t, t + lasts, to));
        t += lasts + if d.chance(0.6) { d.uniform(0.05, 0.6) } else { 0.0 };
        from = to;
    }
    JointCourse::Points(moves)
}

fn sines_of(d: &mut SeededDraw, top: f64) -> JointCourse {
    let count = 2 + d.below(4);
    let mut lines = Vec::new();
    for _ in 0..count {
        let w = TAU * d.log(0.1, 1.2);
        let rate = top * d.uniform(0.5, 1.2) / (count as f64).sqrt();
        lines.push(((rate / w).min(0.8 / (count as f64).sqrt()), w, d.phase()));
    }
    JointCourse::Sines(lines)
}

//! A body that the last link carries, with too little known of it; or nothing that is off.

use super::plant::{ArmValues, LINKS};
use super::scene::{finite, scales, scene};
use super::size::{OTHERS, floors, get, ratio, set};
use super::write::write;
use crate::case::{Moved, TrialCase, TrialSplit};
use crate::draw::SeededDraw;
use crate::joint::short;

/// Of so many cases one has nothing that is off.
const TURNS: usize = 3;
/// How much of the floor a mass that is off leaves when all else that is doubted is refitted.
const WEAKEST: f64 = 3.0;
const STRONGEST: f64 = 30.0;
/// The link that carries it.
const LAST: usize = LINKS - 1;

impl ArmValues {
    /// The last link with a point of `mass` kg at `at` (its axes, m).
    fn carries(mut self, mass: f64, at: [f64; 2]) -> Self {
        let (own, center) = (self.mass[LAST], self.center[LAST]);
        let all = own + mass;
        self.center[LAST] = [0, 1].map(|k| (own * center[k] + mass * at[k]) / all);
        let apart = (at[0] - center[0]).powi(2) + (at[1] - center[1]).powi(2);
        self.inertia[LAST] += own * mass / all * apart;
        self.mass[LAST] = all;
        self
    }
}

/// One draw; nothing where it does not show.
pub(super) fn attempt(seed: u64, index: usize, d: &mut SeededDraw) -> Option<TrialCase> {
    let mut s = scene(d, seed, index, None, true);
    let bare = s.values;
    let (mass, at) = (short(d.log(0.4, 3.0)), [short(bare.length[LAST] + d.uniform(0.0, 0.1)), 0.0]);
    s.values = bare.carries(mass, at);
    let plain = s.runs(s.values, &[], &[0, 1]);
    if !finite(&plain) {
        return None;
    }
    let sizes = scales(&plain, &s);
    let noise: [f64; LINKS] = std::array::from_fn(|j| short(sizes.torque[j] * d.log(3e-4, 3e-3)));
    let floor = floors(&s, &plain, noise);
    let (mut believed, mut left) = (mass, 1.0);
    if index % TURNS + 1 < TURNS {
        let (target, sign) = (d.log(WEAKEST, STRONGEST), d.sign());
        let mut by = 0.1;
        for _ in 0..6 {
            // A mass is none below 0.
            believed = short((mass + sign * by).max(0.0));
            left = ratio(&s, &s.values, bare.carries(believed, at), &[], &plain, &floor, OTHERS);
            if (left / target).ln().abs() < 0.3 {
                break;
            }
            let factor = ((target * target - 1.0) / (left * left - 1.0).max(1e-4)).sqrt();
            by = (by * factor.clamp(0.1, 8.0)).clamp(0.01, 3.0);
        }
        if !(0.8 * WEAKEST..1.6 * STRONGEST).contains(&left) || believed == mass {
            return None;
        }
    }
    let rest: Vec<usize> = (plain.len()..s.motions.len()).collect();
    let mut runs = plain;
    runs.extend(s.runs(s.values, &[], &rest));
    if !finite(&runs) {
        return None;
    }
    // All other values are exact where nothing is off.
    let off = believed != mass && d.chance(0.6);
    let (mut nominal, mut doubts) = (bare, Vec::new());
    for &i in OTHERS.iter().filter(|i| get(&bare, **i) != 0.0 && (**i < 6 || bare.flexible[0])) {
        if off {
            set(&mut nominal, i, short(get(&bare, i) * (1.0 + d.sign() * d.uniform(0.01, 0.05))));
        }
        doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
    }
    let doubt = if believed == mass {
        mass * d.uniform(0.1, 0.5)
    } else {
        (believed - mass).abs() / d.uniform(0.5, 2.0)
    };
    let mut case =
        write(TrialSplit::Rig, seed, index, &s, &[], &[], &runs, &nominal, &doubts, noise, left, None, d);
    case.payload = payload(believed, short(doubt.max(0.01)), at);
    if believed != mass {
        case.key.verdict = "parameters".into();
        case.key.moved.insert("payload.mass".into(), Moved { from: believed, to: mass });
    }
    Some(case)
}

fn payload(mass: f64, doubt: f64, at: [f64; 2]) -> toml::Table {
    let figure = [("value".to_owned(), mass.into()), ("doubt".to_owned(), doubt.into())];
    toml::Table::from_iter([
        ("link".to_owned(), toml::Value::Integer(LINKS as i64)),
        ("mass".to_owned(), toml::Value::Table(toml::Table::from_iter(figure))),
        ("centerOfMass".to_owned(), toml::Value::Array(at.iter().map(|x| (*x).into()).collect())),
    ])
}

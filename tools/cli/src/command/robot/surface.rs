//! Measures and norms over two joints: the surfaces of S1's figures 4 to 10, as CSV.

use std::fmt::Write;

use trueup_models::space::analysis::{Column, norm};
use trueup_models::space::design::{Design, Tip};

use super::measures;
use crate::args::Robot;
use crate::error::Error;
use crate::output::{say, write as write_file};

/// What a column is called and, for people, what it is.
const COLUMNS: [(&str, &str); 7] = [
    ("forceMeasure", "det(B_f^T B_f)"),
    ("torqueMeasure", "det(B_tau0^T B_tau0)"),
    ("combinedMeasure", "det of both"),
    ("coriolisForce", "norm of N_Rf"),
    ("centrifugalForce", "norm of N_Cf"),
    ("coriolisTorque", "norm of N_Rtau0"),
    ("centrifugalTorque", "norm of N_Ctau0"),
];

/// Over two joints, both from -180 to 180 degrees.
pub(super) fn write(
    args: &Robot,
    design: &Design,
    tip: &Tip,
    q: &[f64],
    over: &[usize],
) -> Result<(), Error> {
    let [a, b] = over else {
        return Err(Error::Usage("--surface takes two joints, as in --surface 2,3".into()));
    };
    let n = q.len();
    if [a, b].iter().any(|j| !(1..=n).contains(*j)) || a == b {
        return Err(Error::Usage(format!("--surface {a},{b}: give two different joints of 1 to {n}")));
    }
    let path = args.output.as_path();
    let (robot, points) = (design.robot(), args.points as usize);
    let columns: Vec<&str> = COLUMNS.iter().map(|c| c.0).collect();
    let mut text = format!("joint{a},joint{b},{}\n", columns.join(","));
    let mut most = [(f64::NEG_INFINITY, 0.0, 0.0); COLUMNS.len()];
    let angle = |k: usize| (-180.0 + 360.0 * k as f64 / f64::from(args.points)).to_radians();
    for i in 0..=points {
        for k in 0..=points {
            let mut q = q.to_vec();
            (q[a - 1], q[b - 1]) = (angle(i), angle(k));
            let r = robot.reaction(&q, tip.mount);
            let [force, torque, both] = measures(&r, &args.torque_joints);
            let pairs = |part: fn(&Column<f64>) -> [f64; 3]| {
                norm(&r.coriolis.iter().map(|c| part(&c.2)).collect::<Vec<_>>())
            };
            let squares = |part: fn(&Column<f64>) -> [f64; 3]| {
                norm(&r.centrifugal.iter().map(part).collect::<Vec<_>>())
            };
            let row = [
                force,
                torque,
                both,
                pairs(|c| c.force),
                squares(|c| c.force),
                pairs(|c| c.torque),
                squares(|c| c.torque),
            ];
            for (most, value) in most.iter_mut().zip(row) {
                if value > most.0 {
                    *most = (value, angle(i), angle(k));
                }
            }
            let values: Vec<String> = row.iter().map(|v| format!("{v:?}")).collect();
            let _ = writeln!(text, "{:?},{:?},{}", angle(i), angle(k), values.join(","));
        }
    }
    write_file(path, text.as_bytes())?;
    let mut said = format!("{}: {} rows; largest on this grid:\n", path.display(), (points + 1).pow(2));
    for ((name, what), (value, x, y)) in COLUMNS.iter().zip(most) {
        let _ = writeln!(
            said,
            "  {name:<18} {value:>14.6e} at ({:.2}, {:.2}) deg  {what}",
            x.to_degrees(),
            y.to_degrees()
        );
    }
    say(&said)
}

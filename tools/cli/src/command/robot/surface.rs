//! Measures and norms over two joints, the surfaces of S1's figures 4 to 10: as CSV or Parquet, and as a page.

mod page;

use std::fmt::Write;

use nalgebra::DMatrix;
use trueup_models::space::analysis::{SpatialColumn, norm};
use trueup_models::space::design::{DesignTip, RobotDesign};
use trueup_signals::WrittenTable;

use super::{form, measures};
use crate::args::RobotArgument;
use crate::error::CliError;
use crate::output::{can_be_written, say, write as write_file};

/// One quantity.
pub(super) struct SurfaceQuantity {
    /// Of its column.
    name: &'static str,
    /// Where S1 draws it.
    figure: u32,
    /// For people.
    what: &'static str,
    unit: &'static str,
}

const fn quantity(
    name: &'static str,
    figure: u32,
    what: &'static str,
    unit: &'static str,
) -> SurfaceQuantity {
    SurfaceQuantity { name, figure, what, unit }
}

pub(super) const QUANTITIES: [SurfaceQuantity; 7] = [
    quantity("forceMeasure", 4, "det(B_f^T B_f)", ""),
    quantity("torqueMeasure", 5, "det(B_tau0^T B_tau0)", ""),
    quantity("combinedMeasure", 6, "det of both", ""),
    quantity("coriolisForce", 7, "norm of N_Rf", "kg.m"),
    quantity("centrifugalForce", 8, "norm of N_Cf", "kg.m"),
    quantity("coriolisTorque", 9, "norm of N_Rtau0", "kg.m2"),
    quantity("centrifugalTorque", 10, "norm of N_Ctau0", "kg.m2"),
];

/// Quantities over two joints.
pub(super) struct SurfaceGrid {
    /// From 1.
    joints: [usize; 2],
    /// Angles of both, rad.
    angles: Vec<f64>,
    /// Per quantity its values, by the first joint, then the second.
    values: Vec<Vec<f64>>,
    /// Norm of B_f, and how far the hand is from a kinematic singularity (sqrt det J J^T of its position, base held; Yoshikawa
    /// 1985), in the same order: what the others are compared with.
    inertial: Vec<f64>,
    manipulability: Vec<f64>,
}

impl SurfaceGrid {
    fn of(
        args: &RobotArgument,
        design: &RobotDesign,
        tip: &DesignTip,
        q: &[f64],
        joints: [usize; 2],
    ) -> Self {
        let robot = design.robot();
        let angle = |k: u32| (-180.0 + 360.0 * f64::from(k) / f64::from(args.points)).to_radians();
        let angles: Vec<f64> = (0..=args.points).map(angle).collect();
        let mut grid = Self {
            joints,
            angles,
            values: vec![Vec::new(); QUANTITIES.len()],
            inertial: Vec::new(),
            manipulability: Vec::new(),
        };
        let mut q = q.to_vec();
        for a in grid.angles.clone() {
            for b in grid.angles.clone() {
                (q[joints[0] - 1], q[joints[1] - 1]) = (a, b);
                let r = robot.reaction(&q, tip.mount);
                let [force, torque, both] = measures(design, tip, &r, &args.torque_joints);
                let pairs: Vec<SpatialColumn<f64>> = r.coriolis.iter().map(|c| c.2).collect();
                let of = |columns: &[SpatialColumn<f64>], part: fn(&SpatialColumn<f64>) -> [f64; 3]| {
                    norm(&columns.iter().map(part).collect::<Vec<_>>())
                };
                let row = [
                    force,
                    torque,
                    both,
                    of(&pairs, |c| c.force),
                    of(&r.centrifugal, |c| c.force),
                    of(&pairs, |c| c.torque),
                    of(&r.centrifugal, |c| c.torque),
                ];
                grid.values.iter_mut().zip(row).for_each(|(list, v)| list.push(v));
                grid.inertial.push(of(&r.inertial, |c| c.force));
                grid.manipulability.push(manipulability(&form(design, tip, &q).j_m));
            }
        }
        grid
    }

    /// Angles of entry `k`.
    fn place(&self, k: usize) -> [f64; 2] {
        let n = self.angles.len();
        [self.angles[k / n], self.angles[k % n]]
    }

    /// The largest of these values and where it is.
    fn largest(&self, values: &[f64]) -> (f64, [f64; 2]) {
        let at = peak(values);
        (values.get(at).copied().unwrap_or(f64::NAN), self.place(at))
    }

    fn table(&self) -> WrittenTable {
        let count = self.angles.len().pow(2);
        let of = |i: usize| (0..count).map(|k| self.place(k)[i]).collect::<Vec<f64>>();
        let places = [0, 1].map(|i| (format!("joint{}", self.joints[i]), of(i)));
        let named = QUANTITIES.iter().zip(&self.values).map(|(q, v)| (q.name.to_owned(), v.clone()));
        WrittenTable { columns: places.into_iter().chain(named).collect() }
    }
}

/// Of a hand's position: the product of the singular values of the first three rows of J_M (6 x n, row by row).
fn manipulability(j_m: &[f64]) -> f64 {
    let n = j_m.len() / 6;
    DMatrix::from_row_slice(3, n, &j_m[..3 * n]).singular_values().iter().product()
}

/// Which of these values is the largest.
fn peak(values: &[f64]) -> usize {
    let finite = (0..values.len()).filter(|k| values[*k].is_finite());
    finite.reduce(|best, k| if values[k] > values[best] { k } else { best }).unwrap_or(0)
}

/// Over two joints, both from -180 to 180 degrees.
pub(super) fn write(
    args: &RobotArgument,
    design: &RobotDesign,
    tip: &DesignTip,
    q: &[f64],
    over: &[usize],
) -> Result<(), CliError> {
    let [a, b] = *over else {
        return Err(CliError::Usage("--surface takes two joints, as in --surface 2,3".into()));
    };
    let n = q.len();
    if [a, b].iter().any(|j| !(1..=n).contains(j)) || a == b {
        return Err(CliError::Usage(format!("--surface {a},{b}: give two different joints of 1 to {n}")));
    }
    let path = args.output.as_path();
    if !path.extension().is_some_and(|e| e == "csv" || e == "parquet") {
        return Err(CliError::Usage(format!(
            "--output {}: end its name in .csv or .parquet",
            path.display()
        )));
    }
    [Some(&args.output), args.plot.as_ref()]
        .into_iter()
        .flatten()
        .try_for_each(|file| can_be_written(file))?;
    let grid = SurfaceGrid::of(args, design, tip, q, [a, b]);
    grid.table().write(path).map_err(|e| CliError::Failed(e.to_string()))?;
    let mut said = format!("{}: {} rows; largest on this grid:\n", path.display(), grid.angles.len().pow(2));
    for (quantity, values) in QUANTITIES.iter().zip(&grid.values) {
        let (value, [x, y]) = grid.largest(values);
        let (name, what) = (quantity.name, quantity.what);
        let at = format!("({:.2}, {:.2}) deg", x.to_degrees(), y.to_degrees());
        let _ = writeln!(said, "  {name:<18} {value:>14.6e} at {at}  {what}");
    }
    if let Some(file) = &args.plot {
        write_file(file, page::html(design, &grid).as_bytes())?;
        let _ = writeln!(said, "{}", file.display());
    }
    say(&said)
}

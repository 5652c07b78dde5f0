//! `trueup robot`: what a pose of a robot on a free base shows.

mod singular;
mod surface;

use std::fmt::Write;

use nalgebra::DMatrix;
use serde_json::{Value, json};
use trueup_models::space::analysis::{MomentumForm, Reaction, SpatialColumn};
use trueup_models::space::attitude::rotation;
use trueup_models::space::design::{DesignTip, RobotDesign};
use trueup_models::space::measures::measures as measures_of;
use trueup_models::space::spatial::SpatialFrame;
use trueup_signals::did_you_mean;

use crate::args::RobotArgument;
use crate::error::CliError;
use crate::output::say;

pub(crate) fn run(args: &RobotArgument) -> Result<(), CliError> {
    // Links are looked at straight, their mass with that of their bodies.
    let read = trueup_robot::read(&args.file, args.repair_inertia)?;
    read.notes.iter().for_each(|note| crate::voice::note(note));
    if args.toml {
        return say(&read.toml().map_err(|why| CliError::at(&args.file, why))?);
    }
    let design = read.design.stiffened();
    let tip = chosen(args, &design)?;
    let q = pose(args, &design)?;
    if let Some(j) = args.torque_joints.iter().find(|j| !(1..=q.len()).contains(*j)) {
        return Err(CliError::Usage(format!(
            "--torque-joints: there is no joint {j}; they are 1 to {}",
            q.len()
        )));
    }
    if let Some(over) = &args.surface {
        return surface::write(args, &design, tip, &q, over);
    }
    let found = PoseAnalysis::of(&design, tip, &q, &args.torque_joints);
    let singular = match &args.sweep {
        Some(sweep) => Some(singular::along(&design, tip, &q, sweep)?),
        None => None,
    };
    say(&if args.json {
        let mut all = found.json(&design, tip);
        if let Some(s) = &singular {
            all["singular"] = s.json();
        }
        format!("{all:#}\n")
    } else {
        found.text(&design, tip) + &singular.map_or_else(String::new, |s| s.text(&design))
    })
}

fn chosen<'a>(args: &RobotArgument, design: &'a RobotDesign) -> Result<&'a DesignTip, CliError> {
    let names = || design.tips.iter().map(|t| t.name.as_str());
    match &args.tip {
        None => design.tips.first().ok_or_else(|| {
            CliError::at(
                &args.file,
                "there is no hand to look at; add a [[tip]] with the `body` that it is fixed to",
            )
        }),
        Some(name) => design.tips.iter().find(|t| t.name == *name).ok_or_else(|| {
            let near = did_you_mean(name, names(), "name another one");
            let all = names().collect::<Vec<_>>().join(", ");
            CliError::Usage(format!("--tip {name}: there is no such hand; {near} (there are: {all})"))
        }),
    }
}

/// Angles (ways of prismatic joints) of all joints.
fn pose(args: &RobotArgument, design: &RobotDesign) -> Result<Vec<f64>, CliError> {
    let n = design.links.len();
    if args.pose.is_empty() {
        return Ok(vec![0.0; n]);
    }
    if args.pose.len() != n || args.pose.iter().any(|v| !v.is_finite()) {
        return Err(CliError::Usage(format!(
            "--pose has {} numbers, the robot {n} joints; give one finite number each, in rad (m of prismatic joints)",
            args.pose.len()
        )));
    }
    Ok(args.pose.clone())
}

/// What [`run`] shows.
struct PoseAnalysis {
    q: Vec<f64>,
    reaction: Reaction<f64>,
    /// Of force, torque, both.
    measures: [f64; 3],
    form: MomentumForm,
    j_g: Option<Vec<f64>>,
}

/// Descending.
fn singular_values(j: &[f64]) -> Vec<f64> {
    let n = j.len() / 6;
    if n == 0 {
        return Vec::new();
    }
    let mut all: Vec<f64> = DMatrix::from_row_slice(6, n, j).singular_values().iter().copied().collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

/// Yoshikawa's manipulability, sqrt det J J^T.
fn product(singular_values: &[f64]) -> f64 {
    singular_values.iter().product()
}

/// The robot's momentum form with the base at the origin, turned by nothing.
fn form(design: &RobotDesign, tip: &DesignTip, q: &[f64]) -> MomentumForm {
    let base = SpatialFrame { rotation: rotation([1.0, 0.0, 0.0, 0.0]), origin: [0.0; 3] };
    design.unbent().momentum_form(base, q, (tip.body, tip.offset))
}

/// Measures of force, torque and both of the arm that carries the hand; of the torque those of these joints (from 1) alone, if
/// any are named: columns that are parallel by construction make the whole 0.
fn measures(
    design: &RobotDesign,
    tip: &DesignTip,
    reaction: &Reaction<f64>,
    torque_joints: &[usize],
) -> [f64; 3] {
    let arm: Vec<usize> = design.structure().tree.arm(tip.body).map(|body| body - 1).collect();
    let columns = arm.iter().filter_map(|j| reaction.inertial.get(*j));
    let named = |j: &&usize| torque_joints.is_empty() || torque_joints.contains(&(**j + 1));
    measures_of(columns, arm.iter().filter(named).filter_map(|j| reaction.inertial.get(*j)))
}

impl PoseAnalysis {
    fn of(design: &RobotDesign, tip: &DesignTip, q: &[f64], torque_joints: &[usize]) -> Self {
        let reaction = design.robot().reaction(q, tip.mount);
        let form = form(design, tip, q);
        let j_g = form.generalized_jacobian().ok();
        Self { q: q.to_vec(), measures: measures(design, tip, &reaction, torque_joints), reaction, form, j_g }
    }

    /// Name, meaning, rows.
    fn matrices(&self) -> Vec<(&'static str, &'static str, Vec<Vec<f64>>)> {
        let n = self.form.joints;
        let rows =
            |m: &[f64], columns: usize| m.chunks(columns.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>();
        let of = |columns: &[SpatialColumn<f64>], part: fn(&SpatialColumn<f64>) -> [f64; 3]| {
            (0..3).map(|i| columns.iter().map(|c| part(c)[i]).collect()).collect::<Vec<Vec<f64>>>()
        };
        let pairs: Vec<SpatialColumn<f64>> = self.reaction.coriolis.iter().map(|c| c.2).collect();
        let (b, squares) = (&self.reaction.inertial, &self.reaction.centrifugal);
        let mut all = vec![
            ("B_f", "force on the base by accelerations, kg.m", of(b, |c| c.force)),
            ("B_tau0", "torque about the mount by accelerations, kg.m2", of(b, |c| c.torque)),
            ("N_Rf", "force by products of rates, joints in pairs, kg.m", of(&pairs, |c| c.force)),
            ("N_Cf", "force by squares of rates, kg.m", of(squares, |c| c.force)),
            ("N_Rtau0", "torque by products of rates, kg.m2", of(&pairs, |c| c.torque)),
            ("N_Ctau0", "torque by squares of rates, kg.m2", of(squares, |c| c.torque)),
            ("H2", "momentum by the base's twist, about the origin", rows(&self.form.h2, 6)),
            ("H3", "momentum by the joints' rates, about the origin", rows(&self.form.h3, n)),
            ("J_s", "the tip's twist by the base's", rows(&self.form.j_s, 6)),
            ("J_M", "the tip's twist by the joints' rates, base held", rows(&self.form.j_m, n)),
        ];
        if let Some(j_g) = &self.j_g {
            all.push(("J_g", "the tip's twist by the joints' rates, base floating", rows(j_g, n)));
        }
        all
    }

    /// Singular values of J_M and of J_g, descending.
    fn values(&self) -> [Vec<f64>; 2] {
        [singular_values(&self.form.j_m), self.j_g.as_deref().map_or_else(Vec::new, singular_values)]
    }

    fn json(&self, design: &RobotDesign, tip: &DesignTip) -> Value {
        let matrices: serde_json::Map<String, Value> =
            self.matrices().into_iter().map(|(name, _, rows)| (name.to_owned(), json!(rows))).collect();
        let [held, floating] = self.values();
        json!({
            "schema": "trueup.robot/1",
            "robot": design.name,
            "tip": tip.name,
            "pose": self.q,
            "tipPosition": self.form.tip,
            "matrices": matrices,
            "pairs": self.reaction.coriolis.iter().map(|c| [c.0 + 1, c.1 + 1]).collect::<Vec<_>>(),
            "measures": {"force": self.measures[0], "torque": self.measures[1], "combined": self.measures[2]},
            "singularValues": {"J_M": held, "J_g": floating},
            "manipulability": {"J_M": product(&held), "J_g": product(&floating)},
        })
    }

    fn text(&self, design: &RobotDesign, tip: &DesignTip) -> String {
        let list = |v: &[f64]| v.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(", ");
        let mut out = format!(
            "{}: {} joints at ({}), hand `{}` at ({}) m; base at the origin, inertial axes\n",
            design.name,
            self.form.joints,
            list(&self.q),
            tip.name,
            list(&self.form.tip)
        );
        for (name, what, rows) in self.matrices() {
            let _ = writeln!(out, "\n{name}: {what}");
            for row in rows {
                let _ = writeln!(out, "  {}", row.iter().map(|v| format!("{v:>14.6e}")).collect::<String>());
            }
        }
        let [force, torque, both] = self.measures;
        let _ = writeln!(
            out,
            "\nmeasures det(B^T B): force {force:.6e}, torque {torque:.6e}, combined {both:.6e}"
        );
        let [held, floating] = self.values();
        let _ = writeln!(out, "singular values of J_M: {}", list(&held));
        let _ = writeln!(out, "singular values of J_g: {}", list(&floating));
        let (held, floating) = (product(&held), product(&floating));
        let _ = writeln!(out, "manipulability: J_M {held:.6e}, J_g {floating:.6e}");
        out
    }
}

//! The surfaces as a page: each as a surface and as a map with its maximum, and what S1 says of them beside what they are.

use trueup_models::space::design::Design;
use trueup_report::{Heat, Page, Surface, number};

use super::{Grid, QUANTITIES};

/// Fewer points than this leave out what lies between.
const CELLS: usize = 90;

pub(super) fn html(design: &Design, grid: &Grid) -> String {
    let lead = format!(
        "What the motion of joints {} and {} does to the base, over all their angles. Measures and norms are per unit of \
         acceleration (figures 4 to 6) and of products of rates (figures 7 to 10).",
        grid.joints[0], grid.joints[1]
    );
    let mut page = Page::new(&design.name, &lead);
    page.contents();
    page.section(
        "What the paper says, and what the surfaces say",
        "Correlations and maxima are those of this grid.",
    );
    page.table(&["claim of S1", "the surface", ""], &claims(grid));
    page.section("Maxima", "");
    let rows: Vec<Vec<String>> = QUANTITIES
        .iter()
        .zip(&grid.values)
        .map(|(q, values)| {
            let (most, at) = grid.largest(values);
            let [x, y] = at.map(|a| format!("{:.1} deg", a.to_degrees()));
            vec![format!("{}", q.figure), q.name.into(), q.what.into(), number(most), x, y]
        })
        .collect();
    let [a, b] = grid.joints.map(|j| format!("joint {j}"));
    page.table(&["figure", "column", "what", "largest", &a, &b], &rows);
    for (q, values) in QUANTITIES.iter().zip(&grid.values) {
        draw(&mut page, grid, (q.figure, q.what, q.unit), values, [&a, &b]);
    }
    page.finish()
}

fn draw(
    page: &mut Page,
    grid: &Grid,
    (figure, what, unit): (u32, &str, &str),
    values: &[f64],
    joints: [&str; 2],
) {
    let n = grid.angles.len();
    page.section(&format!("Figure {figure}: {what}"), "");
    let degrees: Vec<f64> = grid.angles.iter().map(|a| a.to_degrees()).collect();
    // Rows along the second joint.
    let rows: Vec<Vec<f64>> = (0..n).map(|k| (0..n).map(|i| values[i * n + k]).collect()).collect();
    let (x, y) = ([joints[0], "deg"], [joints[1], "deg"]);
    page.surface(&Surface { title: what, x, y, unit, at: [&degrees, &degrees], values: &rows });
    let step = n.div_ceil(CELLS);
    let picked: Vec<usize> = (0..n).step_by(step).collect();
    let mut edges: Vec<f64> = picked.windows(2).map(|w| 0.5 * (degrees[w[0]] + degrees[w[1]])).collect();
    edges.insert(0, -180.0);
    edges.push(180.0);
    let cells: Vec<Vec<Option<f64>>> = picked
        .iter()
        .map(|k| picked.iter().map(|i| Some(rows[*k][*i]).filter(|v| v.is_finite())).collect())
        .collect();
    let (_, at) = grid.largest(values);
    let mark = [(at[0].to_degrees(), at[1].to_degrees())];
    let title = format!("{what}; the ring is the maximum");
    page.heat(&Heat { title: &title, x, y, unit, edges: [&edges, &edges], cells: &cells, marks: &mark });
}

/// Pearson's.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>();
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

/// What S1 claims of these surfaces, what they say, and whether it holds on this robot.
fn claims(grid: &Grid) -> Vec<Vec<String>> {
    let of = |name: &str| {
        let at = QUANTITIES.iter().position(|q| q.name == name).unwrap_or(0);
        grid.values[at].as_slice()
    };
    let row = |claim: &str, found: String, holds: bool| {
        vec![claim.to_owned(), found, if holds { "holds".into() } else { "does not hold here".to_owned() }]
    };
    let largest = |v: &[f64]| grid.largest(v).0;
    let poor = |a: &[f64], b: &[f64]| correlation(a, b);
    let (inertial, coriolis) = (largest(&grid.inertial[0]), largest(of("coriolisForce")));
    let by_measure = poor(of("coriolisForce"), of("forceMeasure"));
    let by_norm = poor(of("coriolisForce"), &grid.inertial[0]);
    let (_, peak) = grid.largest(of("centrifugalForce"));
    // Stretched or folded: the last of both joints leaves the arm straight.
    let straight = peak[1].sin().abs() < 0.1;
    let torque = poor(of("centrifugalTorque"), of("torqueMeasure"));
    vec![
        row(
            "the nonlinear forces are small",
            format!(
                "per unit of rates squared at most {} kg.m, per unit of acceleration {} kg.m: it is the rates that are small",
                number(coriolis),
                number(inertial)
            ),
            coriolis < 0.5 * inertial,
        ),
        row(
            "Coriolis forces are largest where the force measure is poor",
            format!("correlation with the measure {by_measure:.2}"),
            by_measure < 0.0,
        ),
        row(
            "centrifugal forces are largest near kinematic singularities",
            format!("largest at ({:.1}, {:.1}) deg", peak[0].to_degrees(), peak[1].to_degrees()),
            straight,
        ),
        row(
            "nonlinear forces are largest where inertia forces are large: by their norm",
            format!("correlation with the norm of B_f {by_norm:.2}"),
            by_norm > 0.0,
        ),
        row(
            "the same by the determinant",
            format!("correlation with the measure {by_measure:.2}"),
            by_measure > 0.0,
        ),
        row(
            "centrifugal torques are largest near small inertial torques",
            format!("correlation with the measure {torque:.2}"),
            torque < 0.0,
        ),
    ]
}

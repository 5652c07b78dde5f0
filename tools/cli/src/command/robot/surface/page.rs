//! The surfaces as a page: each as a surface and as a map with its maximum, and what S1 states of them next to what they are.

use trueup_models::space::design::RobotDesign;
use trueup_report::{GridSurface, Heat, Page, number};

use super::{QUANTITIES, SurfaceGrid, peak};

/// Fewer points than this miss what is between.
const CELLS: usize = 90;

pub(super) fn html(design: &RobotDesign, grid: &SurfaceGrid) -> String {
    let lead = format!(
        "What the motion of joints {} and {} does to the base, over all their angles. Measures and norms are per unit of \
         acceleration (figures 4 to 6) and of products of rates (figures 7 to 10); measures are in kg.m and kg.m2 to twice \
         the number of columns.",
        grid.joints[0], grid.joints[1]
    );
    let mut page = Page::new(&design.name, &lead);
    page.contents();
    page.section("What the paper states, and what the surfaces show", "Values are those of this grid.");
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
    grid: &SurfaceGrid,
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
    page.surface(&GridSurface { title: what, x, y, unit, at: [&degrees, &degrees], values: &rows });
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
    let title = if unit.is_empty() { what.to_owned() } else { format!("{what}, {unit}") };
    let title = format!("{title}; the ring is the maximum");
    page.heat(&Heat { title: &title, x, y, unit: "", edges: [&edges, &edges], cells: &cells, marks: &mark });
}

/// Where one quantity is largest, another one as a share of its own largest value.
fn at_peak(of: &[f64], other: &[f64]) -> f64 {
    other[peak(of)] / other[peak(other)]
}

/// Less than this share of the largest value is poor, more than 1 less this is large.
const POOR: f64 = 0.1;

/// What S1 claims of these surfaces, what they say, and whether it holds on this robot.
fn claims(grid: &SurfaceGrid) -> Vec<Vec<String>> {
    let of = |name: &str| {
        let at = QUANTITIES.iter().position(|q| q.name == name).unwrap_or(0);
        grid.values[at].as_slice()
    };
    let row = |claim: &str, found: String, holds: bool| {
        vec![claim.to_owned(), found, if holds { "holds".into() } else { "does not hold here".to_owned() }]
    };
    let percent = |share: f64| format!("{:.0} % of its maximum", 100.0 * share);
    let (force, centrifugal, norm) = (of("forceMeasure"), of("centrifugalForce"), &grid.inertial);
    let (inertial, coriolis) = (grid.largest(norm).0, grid.largest(of("coriolisForce")).0);
    let by_coriolis = at_peak(of("coriolisForce"), force);
    let singular = at_peak(centrifugal, &grid.manipulability);
    let (by_norm, by_measure) = (at_peak(centrifugal, norm), at_peak(centrifugal, force));
    let torque = at_peak(of("centrifugalTorque"), of("torqueMeasure"));
    vec![
        row(
            "the nonlinear forces are small",
            format!(
                "Coriolis forces per product of rates at most {} kg.m, forces per acceleration {} kg.m: small are the rates",
                number(coriolis),
                number(inertial)
            ),
            coriolis < inertial,
        ),
        row(
            "Coriolis forces are largest where the force measure is poor",
            format!("at their maximum the measure is {}", percent(by_coriolis)),
            by_coriolis < POOR,
        ),
        row(
            "centrifugal forces are largest near kinematic singularities",
            format!("at their maximum the hand's manipulability is {}", percent(singular)),
            singular < POOR,
        ),
        row(
            "centrifugal forces are largest where inertia forces are, by their norm",
            format!(
                "at their maximum the norm of B_f is {}; column by column they are equal",
                percent(by_norm)
            ),
            by_norm > 1.0 - POOR,
        ),
        row(
            "the same by the force measure",
            format!("there the measure is {}", percent(by_measure)),
            by_measure > 1.0 - POOR,
        ),
        row(
            "centrifugal torques are largest near small inertial torques",
            format!("at their maximum the torque measure is {}", percent(torque)),
            torque < POOR,
        ),
    ]
}

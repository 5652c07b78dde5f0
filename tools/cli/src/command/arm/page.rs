//! The map as a page: what the arm does, then each joint's and link's part in it.

use trueup_flexibility::elements::{INCREMENT, squares};
use trueup_flexibility::map::RestPose;
use trueup_models::space::tree::JointType;
use trueup_report::{Heat, Page, number};

use super::asked::{ArmRequest, degrees};
use super::found::{ArmMapResult, ROUNDING, first, settled};
use super::motion;
use super::paper;

/// Elements whose share, and whose rise, is nowhere larger are named and not drawn.
const LITTLE: [f64; 2] = [0.005, 0.001];

pub(super) fn html(asked: &ArmRequest<'_>, found: &ArmMapResult) -> String {
    let [a, b] = found.grid.joints.map(|j| asked.design.links[j].name.clone());
    let lead = format!(
        "{} at rest with its motors held, over the angles of {a} and {b}: {} poses, {}. How the arm bends under its weight, how it \
         vibrates there, which joint or link that is due to.",
        asked.design.name,
        found.poses.len(),
        asked.loads()
    );
    let mut page = Page::new(&format!("What bends of {}", asked.design.name), &lead);
    page.contents();
    if let Some(scene) = motion::scene(asked, found) {
        page.section("The poses of the map", "The angles of both joints, one after the other; unbent.");
        page.scene("", &scene);
    }
    page.section("Where it is least and most", &others(asked, found));
    page.table(&["quantity", "least", "at", "most", "at"], &extremes(found, asked));
    let draw = Drawing::of(asked, found);
    page.section("First mode", "The lowest frequency with the motors held, weight counted.");
    draw.heat(&mut page, "First mode", "Hz", first);
    if found.poses.iter().any(|p| p.tip_deflection.is_some()) {
        page.section("Tip deflection", "How far the first tip is from where the unbent arm would have it.");
        draw.heat(&mut page, "Tip deflection", "mm", |p| 1e3 * p.tip());
    }
    let text = "A joint deflects by the twist of its spring, a link by the rotation of its end relative to its root (S3, Table 4). A share \
                is the size of one over the sum of all.";
    each(&mut page, &draw, (asked, found), ("Shares of the deflection", text), LITTLE[0], |p, k| {
        p.elements[k].share
    });
    let text = format!(
        "By how much the first mode's frequency rises when one joint or link alone is {} % stiffer (S3, Table 5). The rises of its \
         square add up to {} % at most in a linear conservative model without weight (Rayleigh); here they add up to {}.",
        100.0 * INCREMENT,
        100.0 * INCREMENT,
        sums(found)
    );
    each(&mut page, &draw, (asked, found), ("Sensitivity", &text), LITTLE[1], |p, k| p.elements[k].rise);
    page.finish()
}

/// The joints that do not move, what is left out, what the ring is.
fn others(asked: &ArmRequest<'_>, found: &ArmMapResult) -> String {
    let still: Vec<String> = (asked.motors.iter().enumerate())
        .filter(|(j, q)| !found.grid.joints.contains(j) && **q != 0.0)
        .map(|(j, q)| format!("joint {} at {} rad", j + 1, number(*q)))
        .collect();
    let mut text = match still.is_empty() {
        true => "All other joints are at 0.".to_owned(),
        false => format!("The other joints are at 0, but {}.", still.join(", ")),
    };
    if !found.fallen.is_empty() {
        let (fallen, all) = (found.fallen.len(), found.grid.count());
        text += &format!(" At {fallen} of {all} poses there is no rest: their cells are empty.");
    }
    if ring(asked, found).is_some() {
        text += " The ring is the posture of S3's Tables 4 and 5.";
    }
    text
}

/// Where the paper's tables are, if they are of this map.
fn ring(asked: &ArmRequest<'_>, found: &ArmMapResult) -> Option<[f64; 2]> {
    let still = |j: usize| found.grid.joints.contains(&j) || asked.motors.get(j) == paper::POSTURE.get(j);
    let here = paper::loaded_so(asked) && (0..paper::POSTURE.len()).all(still);
    let at = found.grid.joints.map(|j| paper::POSTURE.get(j).copied().unwrap_or(f64::NAN));
    let inside = at.iter().zip(&found.grid.at).all(|(q, along)| {
        along.first().is_some_and(|first| first <= q) && along.last().is_some_and(|last| q <= last)
    });
    (here && inside).then_some(at)
}

fn extremes(found: &ArmMapResult, asked: &ArmRequest<'_>) -> Vec<Vec<String>> {
    let at = |pose: &RestPose| {
        let place = found.grid.joints.iter().zip(found.place(pose)).map(|(j, q)| shown(asked, *j, q));
        place.map(|(value, unit)| format!("{} {unit}", number(value))).collect::<Vec<_>>().join(", ")
    };
    let mut rows = Vec::new();
    let mut row = |what: String, unit: &str, of: &dyn Fn(&RestPose) -> f64| {
        if let Some([low, high]) = found.extremes(of) {
            let value = |p: &RestPose| format!("{} {unit}", number(settled(of(p), ROUNDING)));
            rows.push(vec![what, value(low), at(low), value(high), at(high)]);
        }
    };
    row("first mode".to_owned(), "Hz", &first);
    row("tip deflection".to_owned(), "mm", &|p| 1e3 * p.tip());
    for (k, element) in found.elements().into_iter().enumerate() {
        let name = asked.named(element);
        row(format!("{name}: deflection"), "deg", &|p| degrees(p.elements[k].deflection));
        row(format!("{name}: rise"), "%", &|p| 100.0 * p.elements[k].rise);
    }
    rows
}

/// A picture of each element, but of those that matter nowhere.
fn each(
    page: &mut Page,
    draw: &Drawing,
    (asked, found): (&ArmRequest<'_>, &ArmMapResult),
    (heading, text): (&str, &str),
    little: f64,
    of: impl Fn(&RestPose, usize) -> f64,
) {
    page.section(heading, text);
    let mut nowhere = Vec::new();
    for (k, element) in found.elements().into_iter().enumerate() {
        let name = asked.named(element);
        if found.poses.iter().any(|p| of(p, k).abs() > little) {
            draw.heat(page, &name, "%", |p| 100.0 * of(p, k));
        } else {
            nowhere.push(name);
        }
    }
    if !nowhere.is_empty() {
        page.text(&format!("Nowhere above {} %: {}.", 100.0 * little, nowhere.join("; ")));
    }
}

/// Over all poses.
fn sums(found: &ArmMapResult) -> String {
    let of = |p: &RestPose| 100.0 * squares(p.elements.iter().map(|c| c.rise));
    found
        .extremes(of)
        .map_or_else(String::new, |[low, high]| format!("{} to {} %", number(of(low)), number(of(high))))
}

/// An angle in deg, a way in m.
fn shown(asked: &ArmRequest<'_>, joint: usize, q: f64) -> (f64, &'static str) {
    match asked.design.links[joint].joint {
        JointType::Revolute => (q.to_degrees(), "deg"),
        JointType::Prismatic => (q, "m"),
    }
}

/// What all pictures have in common.
struct Drawing<'a> {
    found: &'a ArmMapResult,
    axes: [String; 2],
    units: [&'static str; 2],
    edges: [Vec<f64>; 2],
    marks: Vec<(f64, f64)>,
}

impl<'a> Drawing<'a> {
    fn of(asked: &ArmRequest<'_>, found: &'a ArmMapResult) -> Self {
        let joints = found.grid.joints;
        let along = |k: usize| {
            let at: Vec<f64> = found.grid.at[k].iter().map(|q| shown(asked, joints[k], *q).0).collect();
            let mut edges: Vec<f64> = at.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
            edges.splice(0..0, at.first().copied());
            edges.extend(at.last());
            edges
        };
        let mark = ring(asked, found).map(|at| {
            let [x, y] = [0, 1].map(|k| shown(asked, joints[k], at[k]).0);
            (x, y)
        });
        Self {
            found,
            axes: joints.map(|j| format!("joint {}, {}", j + 1, asked.design.links[j].name)),
            units: joints.map(|j| shown(asked, j, 0.0).1),
            edges: [along(0), along(1)],
            marks: mark.into_iter().collect(),
        }
    }

    fn heat(&self, page: &mut Page, title: &str, unit: &str, of: impl Fn(&RestPose) -> f64) {
        let ArmMapResult { grid, poses, .. } = self.found;
        let mut cells = vec![vec![None; grid.at[0].len()]; grid.at[1].len()];
        for pose in poses {
            let place = self.found.place(pose);
            let at = |k: usize| grid.at[k].iter().position(|q| *q == place[k]);
            if let (Some(column), Some(row)) = (at(0), at(1)) {
                cells[row][column] = Some(of(pose)).filter(|v| v.is_finite());
            }
        }
        page.heat(&Heat {
            title,
            x: [&self.axes[0], self.units[0]],
            y: [&self.axes[1], self.units[1]],
            unit,
            edges: [&self.edges[0], &self.edges[1]],
            cells: &cells,
            marks: &self.marks,
        });
    }
}

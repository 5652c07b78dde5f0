//! A scene as SVG, without a script and for print: where it ends, and fainter where it was before.

use std::fmt::Write as _;

use trueup_scene::{PartLook, Scene, ScenePart, SceneShape};

use super::view::{SceneView, corners, pose_at};

const SIZE: (f64, f64) = (920.0, 520.0);
/// Poses before the last one, as shares of the time, each with its opacity.
const BEFORE: [(f64, f64); 3] = [(0.0, 0.16), (0.4, 0.22), (0.75, 0.3)];

/// Faces of a cuboid by its corners, outwards.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

/// A shape with its depth.
struct PaintedShape {
    depth: f64,
    svg: String,
}

/// The picture.
pub(super) fn svg(scene: &Scene, view: &SceneView) -> String {
    let (width, height) = SIZE;
    let mut out = format!(
        "<svg viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n"
    );
    let last = scene.time.len().saturating_sub(1);
    let row = |share: f64| (share * last as f64).round() as usize;
    let mut poses: Vec<(usize, f64)> =
        BEFORE.iter().map(|(share, opacity)| (row(*share), *opacity)).collect();
    poses.retain(|(row, _)| *row < last);
    poses.push((last, 1.0));
    // The first layer above all others.
    let mut layers: Vec<usize> = scene.parts.iter().map(|p| p.layer).collect();
    layers.sort_unstable_by(|a, b| b.cmp(a));
    layers.dedup();
    for (row, opacity) in poses {
        let _ = writeln!(out, "<g opacity=\"{opacity}\">");
        for layer in &layers {
            let mut shapes = Vec::new();
            let parts = scene.parts.iter().filter(|p| p.layer == *layer);
            parts.for_each(|p| paint(p, scene, view, row, &mut shapes));
            if !scene.planar {
                shapes.sort_by(|a, b| a.depth.total_cmp(&b.depth));
            }
            let opacity = if *layer > 0 { 0.5 } else { 1.0 };
            let _ = writeln!(out, "<g opacity=\"{opacity}\">");
            shapes.iter().for_each(|shape| out.push_str(&shape.svg));
            out.push_str("</g>\n");
        }
        out.push_str("</g>\n");
    }
    if view.grid > 0.0 {
        let (left, base) = (16.0, height - 14.0);
        let _ = writeln!(
            out,
            "<path d=\"M{left} {base}h{:.1}\" stroke=\"#4A5058\" stroke-width=\"2\"/><text x=\"{left}\" y=\"{}\" font-size=\"13\" fill=\"#4A5058\">{} m</text>",
            view.grid * view.scale(SIZE),
            base - 7.0,
            view.grid
        );
    }
    out.push_str("</svg>\n");
    out
}

/// Colours of the page's style in upper case: it gives them their shade, light or dark.
fn colour(part: &ScenePart, scene: &Scene) -> &'static str {
    let of_layer = ["#1C2025", "#D9541E", "#2E8B57", "#8E4EC6"];
    match part.look {
        PartLook::Lit => "#C2337F",
        PartLook::Ground => "#6B7280",
        _ if scene.layers.len() > 1 => of_layer[part.layer % of_layer.len()],
        PartLook::Base => "#4A5058",
        PartLook::Link => "#1F6FB4",
        PartLook::Motor => "#D9541E",
        PartLook::Panel => "#0F9AA8",
        PartLook::Target => "#2E8B57",
    }
}

fn paint(part: &ScenePart, scene: &Scene, view: &SceneView, row: usize, all: &mut Vec<PaintedShape>) {
    let Some(pose) = pose_at(part, row) else { return };
    let fill = colour(part, scene);
    let scale = view.scale(SIZE);
    let to = |p: [f64; 3]| view.to(SIZE, pose.placed(p));
    let mut put = |depth: f64, svg: String| all.push(PaintedShape { depth, svg });
    let path = |points: &[[f64; 3]], end: &str| {
        let mut d = String::new();
        for (k, [x, y, _]) in points.iter().enumerate() {
            let _ = write!(d, "{}{x:.1} {y:.1}", if k > 0 { "L" } else { "M" });
        }
        d + end
    };
    let mean = |points: &[[f64; 3]]| points.iter().map(|p| p[2]).sum::<f64>() / points.len().max(1) as f64;
    let line = |points: &[[f64; 3]], radius: f64| {
        let width = (2.0 * scale * radius).max(2.0);
        format!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{fill}\" stroke-width=\"{width:.1}\"/>\n",
            path(points, "")
        )
    };
    let face = |points: &[[f64; 3]], opacity: f64| {
        format!(
            "<path d=\"{}\" fill=\"{fill}\" fill-opacity=\"{opacity}\" stroke=\"{fill}\"/>\n",
            path(points, "Z")
        )
    };
    for shape in &part.shapes {
        match shape {
            SceneShape::Rod { from, to: end, radius } => {
                let points = [to(*from), to(*end)];
                put(mean(&points), line(&points, *radius));
            }
            SceneShape::Curve { points, radius } => {
                let points: Vec<_> = points.get(row).into_iter().flatten().map(|p| to(*p)).collect();
                put(mean(&points), line(&points, *radius));
            }
            SceneShape::Strip(points) => {
                let points: Vec<_> = points.get(row).into_iter().flatten().map(|p| to(*p)).collect();
                for quad in points.windows(4).step_by(2) {
                    let quad = [quad[0], quad[1], quad[3], quad[2]];
                    put(mean(&quad), face(&quad, 0.75));
                }
            }
            SceneShape::Block { center, half } => {
                let corners = corners(*center, *half).map(to);
                for (k, f) in FACES.iter().enumerate() {
                    let q = f.map(|c| corners[c]);
                    let (a, b) =
                        ([q[1][0] - q[0][0], q[1][1] - q[0][1]], [q[2][0] - q[0][0], q[2][1] - q[0][1]]);
                    if a[0] * b[1] < a[1] * b[0] {
                        put(mean(&q), face(&q, 0.9 - 0.15 * (k / 2) as f64));
                    }
                }
            }
            SceneShape::Ball { center, radius } => {
                let [x, y, depth] = to(*center);
                let radius = (scale * radius).max(2.0);
                put(
                    depth,
                    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{fill}\"/>\n"),
                );
            }
            SceneShape::Joint(at) => {
                let [x, y, depth] = to(*at);
                let lit = part.look == PartLook::Lit;
                let (ring, glow) = if lit {
                    (
                        fill,
                        format!(
                            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"16\" fill=\"{fill}\" fill-opacity=\"0.3\"/>"
                        ),
                    )
                } else {
                    ("#1C2025", String::new())
                };
                let mark = format!(
                    "{glow}<circle class=\"joint\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#FFFFFF\" stroke=\"{ring}\" stroke-width=\"2\"/>\n"
                );
                put(1e9 + depth, mark);
            }
            SceneShape::Tip(at) => {
                let [x, y, depth] = to(*at);
                put(depth, format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#8E4EC6\"/>\n"));
            }
        }
    }
}

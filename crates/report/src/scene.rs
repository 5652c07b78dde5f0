//! A scene on a page: its still picture, and its shapes and poses for the script (docs/scenes.md).

mod still;
mod view;

use std::fmt::Write as _;

use trueup_scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};

use crate::page::{Page, escape, quote};
use view::SceneView;

/// Of a scene's size the share that a written position may be off: far less than a pixel.
const RESOLUTION: f64 = 1e-5;

impl Page {
    /// A scene that moves, under a title; nothing if nothing of it is anywhere.
    pub fn scene(&mut self, title: &str, scene: &Scene) {
        let figure = figure(title, scene);
        if !figure.is_empty() {
            self.has_scenes();
            self.html(&figure);
        }
    }
}

/// The figure: still picture, legend of its layers, data; empty if there is nothing to draw.
fn figure(title: &str, scene: &Scene) -> String {
    let Some(view) = SceneView::of(scene) else { return String::new() };
    let mut legend = String::new();
    for (k, name) in scene.layers.iter().enumerate() {
        let class = LAYERS[k % LAYERS.len()];
        let _ = write!(legend, "<li><i class=\"{class}\"></i>{}</li>", escape(name));
    }
    if !legend.is_empty() {
        legend = format!("<ul class=\"legend\">{legend}</ul>\n");
    }
    let notes: String = scene.notes.iter().map(|n| format!("<p>{}</p>\n", escape(n))).collect();
    format!(
        "<figure class=\"scene\">\n<figcaption>{}</figcaption>\n{legend}<div class=\"still\">{}</div>\n{notes}\
         <script type=\"application/json\">{}</script>\n</figure>\n",
        escape(title),
        still::svg(scene, &view),
        json(scene, &view)
    )
}

/// Classes of the layers' colours.
const LAYERS: [&str; 4] = ["ink", "c1", "c2", "c3"];

fn look(part: &ScenePart) -> &'static str {
    match part.look {
        PartLook::Ground => "ground",
        PartLook::Base => "base",
        PartLook::Link => "link",
        PartLook::Motor => "motor",
        PartLook::Panel => "panel",
        PartLook::Target => "target",
        PartLook::Lit => "lit",
    }
}

/// What the script reads.
fn json(scene: &Scene, view: &SceneView) -> String {
    let digits = (-(RESOLUTION * view.half[0].max(view.half[1])).log10()).ceil().clamp(0.0, 12.0) as usize;
    let list = |values: &[f64], digits: usize| -> String {
        let mut out = String::with_capacity(8 * values.len() + 2);
        out.push('[');
        for (k, v) in values.iter().enumerate() {
            out.push_str(if k > 0 { "," } else { "" });
            put(&mut out, *v, digits);
        }
        out.push(']');
        out
    };
    let mut out = String::from("{\"schema\":\"trueup.scene/1\",");
    let span = scene.time.last().copied().unwrap_or(0.0) - scene.time.first().copied().unwrap_or(0.0);
    let of_time = (4.0 - span.max(1e-9).log10().floor()).clamp(0.0, 12.0) as usize;
    let _ = write!(
        out,
        "\"planar\":{},\"time\":{},\"layers\":[{}],\"view\":{{\"center\":{:?},\"half\":{:?},\"azimuth\":{:?},\"elevation\":{:?},\"grid\":{:?},\"floor\":{:?}}},\"parts\":[",
        scene.planar,
        list(&scene.time, of_time),
        scene.layers.iter().map(|name| quote(name)).collect::<Vec<_>>().join(","),
        view.center,
        view.half,
        view.azimuth,
        view.elevation,
        view.grid,
        view.floor
    );
    for (k, part) in scene.parts.iter().enumerate() {
        let flat = |points: &[Vec<[f64; 3]>]| list(points.concat().as_flattened(), digits);
        let shapes = part.shapes.iter().map(|shape| match shape {
            SceneShape::Rod { from, to, radius } => {
                format!("{{\"rod\":{},\"radius\":{radius:?}}}", list([*from, *to].as_flattened(), digits))
            }
            SceneShape::Block { center, half } => {
                format!("{{\"block\":{}}}", list([*center, *half].as_flattened(), digits))
            }
            SceneShape::Ball { center, radius } => {
                format!("{{\"ball\":{},\"radius\":{radius:?}}}", list(center, digits))
            }
            SceneShape::Joint(at) => format!("{{\"joint\":{}}}", list(at, digits)),
            SceneShape::Tip(at) => format!("{{\"tip\":{}}}", list(at, digits)),
            SceneShape::Curve { points, radius } => {
                format!("{{\"curve\":{},\"radius\":{radius:?}}}", flat(points))
            }
            SceneShape::Strip(points) => format!("{{\"strip\":{}}}", flat(points)),
        });
        let _ = write!(
            out,
            "{}{{\"name\":{},\"layer\":{},\"look\":\"{}\",\"shapes\":[{}],\"poses\":[",
            if k > 0 { "," } else { "" },
            quote(&part.name),
            part.layer,
            look(part),
            shapes.collect::<Vec<_>>().join(",")
        );
        for (k, pose) in part.poses.iter().enumerate() {
            out.push_str(if k > 0 { "," } else { "" });
            pose_numbers(&mut out, pose, scene.planar, digits);
        }
        out.push_str("]}");
    }
    out.push_str("]}");
    out
}

/// In the plane x, y and the angle; in space x, y, z and the quaternion w, x, y, z.
fn pose_numbers(out: &mut String, pose: &ScenePose, planar: bool, digits: usize) {
    let [x, y, z] = pose.origin;
    let [w, a, b, c] = pose.turn;
    let (places, turns) =
        if planar { (vec![x, y], vec![pose.angle()]) } else { (vec![x, y, z], vec![w, a, b, c]) };
    for (k, (value, digits)) in
        places.iter().map(|v| (v, digits)).chain(turns.iter().map(|v| (v, 5))).enumerate()
    {
        out.push_str(if k > 0 { "," } else { "" });
        put(out, *value, digits);
    }
}

/// So many digits behind the point, without zeros that are not needed.
fn put(out: &mut String, value: f64, digits: usize) {
    let begin = out.len();
    let _ = write!(out, "{value:.digits$}");
    if out[begin..].contains('.') {
        let kept = out.trim_end_matches('0').trim_end_matches('.').len();
        out.truncate(kept);
    }
    if out[begin..] == *"-0" {
        out.truncate(begin);
        out.push('0');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_right() {
        for (value, text) in [(0.1 + 0.2, "0.3"), (-1e-9, "0"), (120.0, "120"), (-0.25, "-0.25")] {
            let mut out = String::from("10");
            put(&mut out, value, 5);
            assert_eq!(out, format!("10{text}"));
        }
        let mut out = String::new();
        put(&mut out, 1200.0, 0);
        assert_eq!(out, "1200");
    }
}

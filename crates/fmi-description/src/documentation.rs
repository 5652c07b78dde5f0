//! documentation/index.html from the variable table.

use std::fmt::Write as _;

use trueup_fmi::table::{BoundaryType, Causality, ModelTable, TableVariable, Variability};

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:62em;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:1em 0}td,th{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:left;\
vertical-align:top}th{background:#f4f4f4}td.number{text-align:right;font-variant-numeric:tabular-nums}\
td:first-child{white-space:nowrap}sub,sup{line-height:0}code{font-size:95%}svg{max-width:100%;height:auto}";

/// The page: description, picture of the mechanism (SVG), equations (HTML fragment), variables.
pub fn html(table: &ModelTable, equations: &str, picture: &str) -> String {
    let mut s = String::new();
    let (name, description) = (escape(&table.name), escape(&table.description));
    let _ = write!(
        s,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{name}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>{name}</h1>\n<p>{description}</p>\n"
    );
    // An XML declaration is not allowed inside HTML.
    let picture = picture.find("<svg").map_or("", |at| &picture[at..]);
    let _ = writeln!(
        s,
        "<figure>\n{}\n</figure>\n<h2>Equations</h2>\n{}",
        picture.trim_end(),
        equations.trim_end()
    );
    let _ = writeln!(
        s,
        "<h2>Default experiment</h2>\n<p>0 to {:?} s, tolerance {:?}, step {:?} s; its result is next to this page: \
         <a href=\"{name}_ref.csv\">{name}_ref.csv</a>.</p>",
        table.experiment.stop_time, table.experiment.tolerance, table.experiment.step_size
    );
    // Title, causality, tunable: only these, only the others, all.
    let sections = [
        ("Inputs", Causality::Input, None),
        ("Outputs", Causality::Output, None),
        ("Parameters that may change between steps", Causality::Parameter, Some(true)),
        ("Parameters that are fixed", Causality::Parameter, Some(false)),
        ("Internal variables", Causality::Local, None),
    ];
    for (title, causality, tunable) in sections {
        let belongs = |v: &&TableVariable| {
            v.causality == causality && tunable.is_none_or(|t| t == (v.variability == Variability::Tunable))
        };
        let variables: Vec<_> = table.variables.iter().filter(belongs).collect();
        if variables.is_empty() {
            continue;
        }
        let _ = writeln!(
            s,
            "<h2>{title}</h2>\n<table>\n<tr><th>Name</th><th>Unit</th><th>Start</th><th>Range</th><th>Meaning</th></tr>"
        );
        for v in variables {
            row(&mut s, table, v);
        }
        let _ = writeln!(s, "</table>");
    }
    for e in &table.enumerations {
        let _ = writeln!(s, "<h2>{}</h2>\n<p>{}</p>\n<table>", escape(e.name), escape(e.description));
        for (item, (name, meaning)) in (1..).zip(&e.items) {
            let _ = writeln!(
                s,
                "<tr><td>{item}</td><td><code>{}</code></td><td>{}</td></tr>",
                escape(name),
                escape(meaning)
            );
        }
        let _ = writeln!(s, "</table>");
    }
    s.push_str("</body>\n</html>\n");
    s
}

fn row(s: &mut String, table: &ModelTable, v: &TableVariable) {
    let size: String = v.dimensions.iter().map(|n| format!("[{n}]")).collect();
    let start: Vec<String> = v.start.iter().map(|x| start_text(table, v, *x)).collect();
    let _ = writeln!(
        s,
        "<tr><td><code>{}{size}</code></td><td>{}</td><td class=\"number\">{}</td><td>{}</td><td>{}</td></tr>",
        escape(&v.name),
        escape(v.unit),
        escape(&start.join(", ")),
        escape(&range(table, v)),
        escape(&v.description),
    );
}

fn start_text(table: &ModelTable, v: &TableVariable, x: f64) -> String {
    match v.kind {
        BoundaryType::Boolean => (x != 0.0).to_string(),
        BoundaryType::Integer => format!("{}", x as i64),
        BoundaryType::Real => format!("{x:?}"),
        BoundaryType::Enumeration(index) => {
            let item = table.enumerations.get(index).and_then(|e| e.items.get((x as usize).wrapping_sub(1)));
            item.map_or_else(|| format!("{}", x as i64), |(name, _)| (*name).to_owned())
        }
    }
}

fn range(table: &ModelTable, v: &TableVariable) -> String {
    if let BoundaryType::Enumeration(index) = v.kind {
        return table.enumerations.get(index).map(|e| e.name.to_owned()).unwrap_or_default();
    }
    let lower = v.min.map(|x| format!("{} {x:?}", if v.exclusive { ">" } else { "\u{2265}" }));
    let upper = v.max.map(|x| format!("\u{2264} {x:?}"));
    [lower, upper].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

//! What a page must hold whatever it is given.
#![allow(clippy::unwrap_used)]

use trueup_report::{Axis, Chart, Heat, Page, Style};

fn page(charts: &[Chart<'_>]) -> String {
    let mut page = Page::new("<Title> & \"more\"", "lead");
    page.section("Section", "text");
    charts.iter().for_each(|c| page.chart(c));
    page.table(&["<a>"], &[vec!["1 < 2".into()]]);
    page.finish()
}

/// The text between the tags, of every occurrence.
fn parts<'a>(html: &'a str, begin: &str, end: &str) -> Vec<&'a str> {
    html.split(begin).skip(1).map(|s| s.split(end).next().unwrap()).collect()
}

#[test]
fn it_is_one_file_and_every_chart_has_a_picture_and_its_samples() {
    let (x, y) = ([0.0, 0.1, 0.2], [1.0, f64::NAN, -3.5e-9]);
    let chart = Chart::over_time("angle", "rad").line("a</script><b>", &x, &y).band(0.05, 0.15);
    let html = page(&[chart.clone(), chart]);
    for elsewhere in [" src=", "href=", "@import", "url("] {
        assert!(!html.contains(elsewhere), "{elsewhere}");
    }
    assert_eq!(parts(&html, "<svg ", "</svg>").len(), 2);
    assert!(html.contains("&lt;Title&gt; &amp;") && html.contains("1 &lt; 2"), "{html}");
    assert!(html.contains("Permission is hereby granted"), "the licence of the charts' script is missing");
    for json in parts(&html, "<script type=\"application/json\">", "</script>") {
        let data: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(data["series"][0]["name"], "a</script><b>");
        assert_eq!(data["data"].to_string(), "[[0.0,0.1,0.2],[1.0,null,-3.5e-9]]");
        assert_eq!(data["x"]["text"], "time in s");
    }
}

#[test]
fn a_long_series_is_thinned_and_keeps_its_peak() {
    let x: Vec<f64> = (0..2_000_000).map(|k| 1e-4 * f64::from(k)).collect();
    let mut y: Vec<f64> = x.iter().map(|x| x.sin()).collect();
    y[1_234_567] = 9.0;
    let html = page(&[Chart::over_time("", "").line("y", &x, &y)]);
    assert!(html.len() < 500_000, "{} bytes", html.len());
    assert!(html.contains(",9.0,") && html.contains("123.4567"), "the peak is gone");
}

#[test]
fn nothing_to_draw_is_no_reason_to_fail() {
    let (x, nan, zero) = ([1.0, 2.0], [f64::NAN; 2], [0.0; 2]);
    let logarithmic = || Axis::new("x", "").logarithmic();
    let html = page(&[
        Chart::over_time("empty", ""),
        Chart::over_time("no sample", "").line("none", &[], &[]),
        Chart::over_time("not finite", "").line("nan", &x, &nan),
        Chart::over_time("constant", "m").series("zero", &x, &zero, Style::Step),
        Chart::new("not positive", logarithmic(), logarithmic()).line("zero", &x, &zero),
        Chart::over_time("one sample", "").series("one", &x[..1], &x[..1], Style::Points),
    ]);
    assert_eq!(parts(&html, "<svg ", "</svg>").len(), 6);
}

#[test]
fn a_picture_has_its_title_its_legend_and_all_series() {
    let (x, y) = ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
    let names: Vec<String> = (0..6).map(|k| format!("a curve with the long name <{k}>")).collect();
    let chart = Chart::over_time("This & that", "m");
    let picture = names.iter().fold(chart, |c, n| c.line(n, &x, &y)).picture();
    assert!(picture.starts_with("<svg ") && picture.trim_end().ends_with("</svg>"));
    assert!(picture.contains("This &amp; that") && picture.contains("long name &lt;5&gt;"));
    // Each colour in the legend and in the plot.
    for colour in ["#1f6fb4", "#d9541e", "#2e8b57", "#8e4ec6", "#b8860b", "#0f9aa8"] {
        let all = picture.to_lowercase().matches(colour).count();
        assert!(all >= 2, "{colour}: {all}");
    }
    // Nothing of the legend is outside.
    let places = parts(&picture, "<rect x=\"", "\"");
    assert!(places.iter().filter_map(|x| x.parse::<f64>().ok()).all(|x| x < 4600.0));
}

#[test]
fn the_scale_of_a_map_begins_where_its_values_may() {
    let scale = |low: f64| {
        let cells = [vec![Some(low), Some(4.0)], vec![None, Some(3.0)]];
        let mut page = Page::new("", "");
        page.heat(&Heat {
            title: "a <map>",
            x: ["x", "m"],
            y: ["y", ""],
            unit: "Hz",
            edges: [&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]],
            cells: &cells,
            marks: &[(1.0, 1.0)],
        });
        let html = page.finish();
        let texts = parts(&html, "text-anchor=\"start\">", "</text>");
        texts.into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(scale(1.0), ["4 Hz", "2 Hz", "0 Hz"]);
    assert_eq!(scale(-1.0), ["4 Hz", "0 Hz", "-4 Hz"]);
    // Rounding is no sign.
    assert_eq!(scale(-1e-12), ["4 Hz", "2 Hz", "0 Hz"]);
}

/// A browser ends lines after hyphens, that of an exponent too.
#[test]
fn figures_stay_in_one_line() {
    let mut page = Page::new("t", "");
    page.section("s", "from 2e-4 on");
    page.table(&["a"], &[vec!["2.7e-4 to 3.1e-4 N.m & more".into()], vec!["0.64 rad, safe-1, 2e-x".into()]]);
    let html = page.finish();
    for part in [
        "<p>from <span class=\"figure\">2e-4</span> on</p>",
        "<td class=\"number\" data-label=\"a\"><span><span class=\"figure\">2.7e-4</span> to <span class=\"figure\">3.1e-4</span> N.m &amp; more</span></td>",
        "<td class=\"number\" data-label=\"a\">0.64 rad, safe-1, 2e-x</td>",
    ] {
        assert!(html.contains(part), "{part}");
    }
}

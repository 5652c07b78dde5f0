//! Pages of diagnoses in a headless browser.

use std::path::{Path, PathBuf};
use std::process::Command;

use trueup_diagnosis::outcome::Verdict;

use crate::diagnosis::{CHARTS, page};

/// A headless browser, if this machine has one.
fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("TRUEUP_CHROMIUM").map(PathBuf::from);
    let found = named.or_else(|| {
        let path = std::env::var_os("PATH")?;
        let names = ["chromium", "chromium-browser", "google-chrome"];
        std::env::split_paths(&path).flat_map(|p| names.map(|n| p.join(n))).find(|p| p.is_file())
    });
    if found.is_none() {
        eprintln!(
            "SKIPPED: no chromium on PATH (or named by TRUEUP_CHROMIUM), so no browser has looked at the page"
        );
    }
    found
}

fn browse(browser: &Path, folder: &Path, file: &str, arguments: &[&str]) -> (String, String) {
    let url = format!("file://{}", folder.join(file).display());
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let fixed =
        ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"];
    let more = [
        "--disable-component-update",
        "--disable-sync",
        "--enable-logging=stderr",
        "--virtual-time-budget=5000",
    ];
    let done =
        Command::new(browser).args(fixed).args(more).arg(profile).args(arguments).arg(url).output().unwrap();
    (String::from_utf8_lossy(&done.stdout).into(), String::from_utf8_lossy(&done.stderr).into())
}

/// What a browser finds too wide at a width: of the page, of texts in their boxes, of pictures' texts; and figures over two lines.
const MEASURE: &str = r##"<script>
addEventListener("load", () => setTimeout(() => {
  document.querySelectorAll("details").forEach((d) => { d.open = true; });
  const found = [], width = innerWidth, name = (e) => e.tagName + " " + e.textContent.trim().slice(0, 40);
  if (document.scrollingElement.scrollWidth > width) found.push("the page: " + document.scrollingElement.scrollWidth);
  for (const e of document.querySelectorAll("body *")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.getClientRects().length || e.closest("script, style")) continue;
    const box = e.getBoundingClientRect(), svg = e.closest("svg");
    if (svg) {
      const frame = svg.getBoundingClientRect();
      if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1) found.push("cut: " + name(e));
      continue;
    }
    if (box.right > width + 1 || box.left < -1) found.push("outside: " + name(e));
    if (e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1) found.push("overflows: " + name(e));
  }
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode;
    if (node.parentElement.closest("script, style, svg, code")) continue;
    for (const figure of node.data.matchAll(/(?<![\w.-])[-+]?\d[\d.]*(e[-+]?\d+)?(?![\w.-])/g)) {
      const range = document.createRange();
      range.setStart(node, figure.index);
      range.setEnd(node, figure.index + figure[0].length);
      if (new Set([...range.getClientRects()].map((r) => Math.round(r.top))).size > 1) found.push("broken: " + figure[0]);
    }
  }
  const shown = parent.document.createElement("pre");
  shown.textContent = "MEASURED " + width + ": " + (found.join("; ") || "all fits") + " END";
  parent.document.body.append(shown);
}, 300));
</script></body>"##;

#[test]
fn nothing_is_cut_on_a_telephone() {
    fits(&[(Verdict::Effects, true)], &[390]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn nothing_is_cut_on_any_screen() {
    let pages = [(Verdict::Effects, true), (Verdict::Unknown, true), (Verdict::Ambiguous, false)];
    fits(&pages, &[320, 390, 700, 920, 1280]);
}

/// Pages of these verdicts, with or without script, at these widths.
fn fits(pages: &[(Verdict, bool)], widths: &[u32]) {
    let Some(browser) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    for &(verdict, scripts) in pages {
        let mut html = page(verdict);
        if !scripts {
            // The pictures as they are before any script.
            html = html.replace("document.querySelectorAll(\"figure.chart\").forEach(build);", "");
        }
        let at = html.rfind("</body>").unwrap();
        std::fs::write(folder.path().join("frame.html"), format!("{}{MEASURE}</html>", &html[..at])).unwrap();
        for width in widths {
            // In a frame, for a window has a least width.
            let frame = format!(
                "<body style=\"margin:0\"><iframe src=\"frame.html\" style=\"border:0;width:{width}px;height:900px\"></iframe></body>"
            );
            std::fs::write(folder.path().join("outer.html"), frame).unwrap();
            let size = format!("--window-size={},1000", width + 100);
            let arguments = ["--dump-dom", "--allow-file-access-from-files", &size];
            let (dom, log) = browse(&browser, folder.path(), "outer.html", &arguments);
            let said = dom.split("MEASURED ").nth(1).and_then(|s| s.split(" END").next());
            assert_eq!(said, Some(format!("{width}: all fits").as_str()), "{verdict:?}: {log}");
        }
    }
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_browser_shows_it_with_and_without_script() {
    let Some(browser) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("report.html"), page(Verdict::Ambiguous)).unwrap();
    let (dom, log) = browse(&browser, folder.path(), "report.html", &["--dump-dom"]);
    let complaints: Vec<&str> = log.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:?}");
    // Every chart became one that can be zoomed; the surface stays a picture.
    assert_eq!((dom.matches("<canvas").count(), dom.matches("chart live").count()), (CHARTS, CHARTS));
    // With script forbidden nothing runs, the pictures stay.
    let forbidden = "<head><meta http-equiv=\"Content-Security-Policy\" content=\"script-src 'none'\">";
    let still = page(Verdict::Ambiguous).replacen("<head>", forbidden, 1);
    std::fs::write(folder.path().join("still.html"), still).unwrap();
    let (dom, _) = browse(&browser, folder.path(), "still.html", &["--dump-dom"]);
    assert_eq!((dom.matches("<canvas").count(), dom.matches("<svg ").count()), (0, CHARTS + 1));
    // What it looks like: on a desk, with script forbidden, on a telephone.
    for (width, file) in [(1100, "report.html"), (1000, "still.html"), (390, "still.html")] {
        let name = folder.path().join(format!("{width}.png"));
        let (shot, size) =
            (format!("--screenshot={}", name.display()), format!("--window-size={width},5200"));
        browse(&browser, folder.path(), file, &[&shot, &size, "--hide-scrollbars"]);
        let bytes = std::fs::metadata(&name).unwrap().len();
        assert!(bytes > 60_000, "{width}: {bytes} bytes of a picture");
        if let Some(keep) = std::env::var_os("TRUEUP_KEEP_PAGES") {
            let keep = PathBuf::from(keep);
            std::fs::copy(&name, keep.join(format!("diagnosis-{width}.png"))).unwrap();
            std::fs::copy(folder.path().join(file), keep.join(format!("diagnosis-{width}.html"))).unwrap();
        }
    }
}

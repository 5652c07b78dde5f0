//! Systems that a seed draws, compared with what was requested.

use std::fmt::Write as _;

use trueup_cosim::SeriesMemory;

use super::{FmiVersion, OUTPUTS, Offers, PLAIN, last, run, unpacked};

/// Numbers by SplitMix64. `TRUEUP_SEED` sets the seed, which is printed.
pub(super) struct Draw(u64);

impl Draw {
    pub(super) fn new(what: &str) -> Self {
        let seed = std::env::var("TRUEUP_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(20_260_729);
        println!("{what}: TRUEUP_SEED={seed}");
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(super) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub(super) fn coin(&mut self) -> bool {
        self.below(2) == 1
    }

    /// In 0 .. 1.
    pub(super) fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// One FMU of a drawn system.
#[derive(Debug)]
struct Drawn {
    offers: Offers,
    /// Whole internal steps, else a sample per call.
    whole: bool,
    internal: f64,
    gain: f64,
    every: usize,
    y: f64,
    /// Inputs as they were set last.
    set: [f64; 2],
}

/// A drawn system: FMUs in a circle, or alone; samples of `u` of the first one where it is alone, else of its `d`.
#[derive(Debug)]
struct Case {
    fmus: Vec<Drawn>,
    step: f64,
    steps: usize,
    /// Part of a step that the last one is.
    clipped: f64,
    file: Option<Vec<(f64, f64)>>,
}

impl Case {
    fn draw(draw: &mut Draw) -> Self {
        let step = [0.1, 0.05, 0.02, 0.01, 0.125][draw.below(5)];
        let clipped = if draw.below(3) == 0 { 0.1 + 0.8 * draw.part() } else { 1.0 };
        // Of FMUs with a rate of their own and equal steps the steps are a multiple.
        let steps = 10 * (1 + draw.below(4)) + if clipped < 1.0 { draw.below(10) } else { 0 };
        let fmus = (0..1 + draw.below(3))
            .map(|_| {
                let version = if draw.coin() { FmiVersion::V2 } else { FmiVersion::V3 };
                let any_step = clipped < 1.0 || draw.coin();
                // A default step alone, or states alone, declare nothing.
                let (states, named) = [(false, false), (true, false), (false, true)][draw.below(3)];
                let states = states && version == FmiVersion::V2;
                let default_step = named.then_some(0.1 * step);
                let every = [1, 1, 2, 5, 10][draw.below(5)];
                let internal = step * every as f64 / [1.0, 2.0, 5.0][draw.below(3)];
                let offers = Offers { version, any_step, states, default_step, ..PLAIN };
                let gain = 0.05 + 0.3 * draw.part();
                Drawn { offers, whole: draw.coin(), internal, gain, every, y: 0.0, set: [0.0; 2] }
            })
            .collect();
        let file = draw.coin().then(|| {
            let end = step * steps as f64;
            let mut times: Vec<f64> =
                (0..draw.below(30)).map(|_| end * (0.001 + 0.998 * draw.part())).collect();
            times.extend([0.0, end]);
            times.sort_by(f64::total_cmp);
            times.into_iter().map(|t| (t, (10.0 * draw.part()).round() / 10.0)).collect()
        });
        Self { fmus, step, steps, clipped, file }
    }

    fn time(&self, point: usize) -> f64 {
        let whole = self.step * point as f64;
        if point == self.steps { whole - (1.0 - self.clipped) * self.step } else { whole }
    }

    fn driven(&self) -> &'static str {
        if self.fmus.len() == 1 { "u" } else { "d" }
    }

    fn text(&self, folder: &std::path::Path) -> String {
        let n = self.fmus.len();
        let mut text = String::new();
        if let Some(rows) = &self.file {
            let mut csv = format!("time,c0.{}\n", self.driven());
            for (t, x) in rows {
                let _ = writeln!(csv, "{t:?},{x:?}");
            }
            std::fs::write(folder.join("in.csv"), csv).unwrap();
            text.push_str("inputs = \"in.csv\"\n");
        }
        text.push_str("connections = [");
        for i in (0..n).filter(|_| n > 1) {
            let (factor, offset) = if i == 0 { (-1.0, 1.0) } else { (1.0, 0.0) };
            let to = (i + 1) % n;
            let _ = write!(
                text,
                "{{ from = \"c{i}.y\", to = \"c{to}.u\", factor = {factor:?}, offset = {offset:?} }},"
            );
        }
        let _ = writeln!(text, "]\n[run]\nstop = {:?}\nstep = {:?}", self.time(self.steps), self.step);
        for (i, Drawn { whole, internal, gain, every, .. }) in self.fmus.iter().enumerate() {
            let (kind, own) = (u8::from(*whole), self.step * *every as f64);
            let _ = writeln!(text, "[components.c{i}]\nfmu = \"c{i}\"\nstep = {own:?}");
            let _ = writeln!(text, "start = {{ kind = {kind}, internal = {internal:?}, gain = {gain:?} }}");
        }
        text
    }

    /// The value of the file at a time.
    fn sample(&self, t: f64) -> f64 {
        let Some(rows) = &self.file else { return 0.0 };
        let after = rows.partition_point(|(at, _)| *at <= t).min(rows.len() - 1).max(1);
        let [(t0, x0), (t1, x1)] = [rows[after - 1], rows[after]];
        match self.driven() {
            "u" => x0 + (x1 - x0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0),
            _ if t >= t1 => x1,
            _ => x0,
        }
    }

    /// What samplers with held inputs make of it, by hand: values of y at the end of the run.
    fn by_hand(&mut self) -> Vec<f64> {
        let n = self.fmus.len();
        for point in 0..=self.steps {
            let t = self.time(point);
            let due = |f: &Drawn| point % f.every == 0 || point == self.steps;
            for f in self.fmus.iter_mut().filter(|f| point > 0 && due(f)) {
                let begin = (point - 1) / f.every * f.every;
                let h = t - self.step * begin as f64;
                let times = if f.whole { (h / f.internal + 1e-6).floor() as usize } else { 1 };
                (0..times).for_each(|_| f.y += f.gain * (f.set[0] + f.set[1] - f.y));
            }
            let outputs: Vec<f64> = self.fmus.iter().map(|f| f.y).collect();
            for i in 0..n {
                if !due(&self.fmus[i]) {
                    continue;
                }
                let from = outputs[(i + n - 1) % n];
                let u = if i == 1 { 1.0 - from } else { from };
                let x = if i == 0 { self.sample(t) } else { 0.0 };
                self.fmus[i].set = if n == 1 { [x, 0.0] } else { [u, x] };
            }
        }
        self.fmus.iter().map(|f| f.y).collect()
    }

    /// Number of calls and lengths of all but the last and of the last one.
    fn asked(&self, f: &Drawn) -> (usize, f64, f64) {
        let calls = self.steps.div_ceil(f.every);
        let own = self.step * f.every as f64;
        (calls, own, self.time(self.steps) - own * (calls - 1) as f64)
    }

    fn judge(&self, results: &SeriesMemory) {
        for (i, f) in self.fmus.iter().enumerate() {
            let (calls, own, end) = self.asked(f);
            let [_, count, shortest, longest, covered, _] =
                OUTPUTS.map(|name| last(results, &format!("c{i}.{name}")));
            let near = |x: f64, y: f64| (x - y).abs() <= 1e-9 * self.step;
            let expected = if calls > 1 { own } else { end };
            assert_eq!(count, calls as f64, "c{i} of {self:?}");
            assert!(
                near(shortest, end.min(expected)) && near(longest, expected.max(end)),
                "c{i} of {self:?}: {shortest} {longest}"
            );
            assert!(near(covered, self.time(self.steps)), "c{i} of {self:?}: {covered}");
        }
    }
}

/// FMUs that declare nothing are called as often and by as much as was requested, and hold what they are given.
#[test]
fn number_and_size_of_calls_are_as_asked_for() {
    let mut draw = Draw::new("steps as requested");
    let mut called = 0;
    for _ in 0..60 {
        let mut case = Case::draw(&mut draw);
        let folder = tempfile::tempdir().unwrap();
        for (i, f) in case.fmus.iter().enumerate() {
            if unpacked(folder.path(), &format!("c{i}"), f.offers).is_none() {
                return;
            }
        }
        let (results, log) =
            run(folder.path(), &case.text(folder.path())).unwrap_or_else(|e| panic!("{case:?}: {e}"));
        case.judge(&results);
        for (c, f) in log.calls.iter().zip(&case.fmus) {
            assert_eq!(c.calls.total(), case.asked(f).0 as u64, "{case:?}: {}", c.calls);
            called += c.calls.total();
        }
        for (i, y) in case.by_hand().into_iter().enumerate() {
            let found = last(&results, &format!("c{i}.y"));
            assert!((found - y).abs() < 1e-9, "c{i}.y of {case:?}: {found}, by hand {y}");
        }
    }
    println!("60 systems, {called} calls");
}

//! Location of state events on the dense output of one step.

/// Which domain changes of an indicator are events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// Both.
    #[default]
    Both,
    /// From `z <= 0` to `z > 0`.
    Up,
    /// From `z > 0` to `z <= 0`.
    Down,
}

impl Direction {
    /// Is the way from `a` to `b` an event?
    pub fn counts(self, a: f64, b: f64) -> bool {
        match self {
            Self::Both => (a > 0.0) != (b > 0.0),
            Self::Up => a <= 0.0 && b > 0.0,
            Self::Down => a > 0.0 && b <= 0.0,
        }
    }
}

/// A domain change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// A time on the far side, within a few units in the last place of the crossing, in s.
    pub t: f64,
    /// Which indicator.
    pub indicator: usize,
}

/// Where the indicators are sampled in a step, in addition to its start. The outer two give the slope at the ends.
const NODES: [f64; 6] = [1.0 / 64.0, 0.25, 0.5, 0.75, 63.0 / 64.0, 1.0];
/// The same where the states are parabolas in time.
const FEW: [f64; 2] = [0.5, 1.0];
/// Samples ahead of them in the step after a restart, from 4^-16 on, each at 4 times the one before: an
/// indicator that starts at 0 may be back there long before the first regular sample.
const EARLY: usize = 13;
/// An indicator starts at 0 if its value there is less than this share of that at the first regular sample.
const NEAR: f64 = 1e-3;
/// The start, the early ones and the regular ones.
const MOST: usize = 1 + EARLY + NODES.len();

/// Finds the first event of a step. Evaluates indicators only, never rates.
#[derive(Clone, Debug)]
pub struct Locator {
    t: [f64; MOST],
    z: [Vec<f64>; MOST],
    work: Vec<f64>,
    nodes: &'static [f64],
    restarted: bool,
}

/// Indicators as a function of time within the step.
pub type Indicators<'a> = &'a mut dyn FnMut(f64, &mut [f64]);

impl Locator {
    /// Work space for `count` indicators of states that are parabolas in time within a step, or of any.
    pub fn new(count: usize, parabolas: bool) -> Self {
        Self {
            t: [0.0; MOST],
            z: core::array::from_fn(|_| vec![0.0; count]),
            work: vec![0.0; count],
            nodes: if parabolas { &FEW } else { &NODES },
            restarted: true,
        }
    }

    /// Number of indicators.
    pub fn count(&self) -> usize {
        self.work.len()
    }

    /// Restart: the indicators at the start of the next step, to be written by the caller.
    pub fn start(&mut self) -> &mut [f64] {
        self.restarted = true;
        &mut self.z[0]
    }

    /// The step was accepted without an event: its end is the start of the next one.
    pub fn carry(&mut self) {
        self.z.swap(0, MOST - 1);
        self.restarted = false;
    }

    /// The first event in (t0, t1].
    ///
    /// # Errors
    /// The index of an indicator that is not a number.
    pub fn find(
        &mut self,
        t0: f64,
        t1: f64,
        direction: &dyn Fn(usize) -> Direction,
        indicators: Indicators,
    ) -> Result<Option<Crossing>, usize> {
        // The samples fill the arrays from their end: the last one is always the end of the step.
        let mut regular = self.sample(self.nodes, (t0, t1), indicators);
        let mut starts = self.z[0].iter().zip(&self.z[regular]);
        let early = self.restarted && starts.any(|(start, next)| start.abs() <= NEAR * next.abs());
        if early && self.nodes.len() < NODES.len() {
            regular = self.sample(&NODES, (t0, t1), indicators);
        }
        let begin = if early { 1 } else { regular };
        self.t[begin - 1] = t0;
        self.z.swap(0, begin - 1);
        for k in begin..regular {
            self.t[k] = t0 + 0.25f64.powi((regular - k) as i32 + 3) * (t1 - t0);
            indicators(self.t[k], &mut self.z[k]);
        }
        let bad = self.z[begin - 1..].iter().find_map(|z| z.iter().position(|z| z.is_nan()));
        let mut first: Option<Crossing> = None;
        for i in 0..self.work.len() {
            let limit = first.map_or(f64::INFINITY, |c| c.t);
            match self.first_of(begin - 1, i, direction(i), limit, indicators) {
                Some(t) if bad.is_none() && t < limit => first = Some(Crossing { t, indicator: i }),
                _ => {}
            }
        }
        // A step that is tried again starts where this one did.
        self.z.swap(0, begin - 1);
        bad.map_or(Ok(first), Err)
    }

    /// Regular samples at these shares of the step; gives the place of the first.
    fn sample(&mut self, nodes: &[f64], (t0, t1): (f64, f64), indicators: Indicators) -> usize {
        let first = MOST - nodes.len();
        for (k, node) in (first..).zip(nodes) {
            self.t[k] = if k == MOST - 1 { t1 } else { t0 + node * (t1 - t0) };
            indicators(self.t[k], &mut self.z[k]);
        }
        first
    }

    /// The first event of one indicator, as long as it may be before `limit`.
    fn first_of(
        &mut self,
        begin: usize,
        i: usize,
        way: Direction,
        limit: f64,
        indicators: Indicators,
    ) -> Option<f64> {
        let Self { t, z, work, nodes, .. } = self;
        let mut at = |work: &mut [f64], t: f64| {
            indicators(t, work);
            work[i]
        };
        let sample = |k: usize| (t[k], z[k][i]);
        for k in begin..MOST - 1 {
            let (a, m) = (sample(k), sample(k + 1));
            if a.0 >= limit {
                return None;
            }
            if way.counts(a.1, m.1) {
                return Some(cross(a, m, |t| at(work, t)));
            }
            if k + 2 < MOST {
                let b = sample(k + 2);
                let found = match near_an_end(a, m, b) {
                    Some(t) if nodes.len() < NODES.len() => {
                        let m = (t, at(work, t));
                        if (m.1 > 0.0) == (a.1 > 0.0) { dip(a, m, b, |t| at(work, t)) } else { Some(m) }
                    }
                    _ => dip(a, m, b, |t| at(work, t)),
                };
                if let Some(dip) = found {
                    let ends = if way.counts(a.1, dip.1) { (a, dip) } else { (dip, b) };
                    return Some(cross(ends.0, ends.1, |t| at(work, t)));
                }
            }
        }
        None
    }
}

type EventPoint = (f64, f64);

/// Between samples of one domain that are of a parabola: where |z| is least, if the middle one does not show it and it comes near 0.
fn near_an_end(a: EventPoint, m: EventPoint, b: EventPoint) -> Option<f64> {
    let (za, zm, zb) = (a.1.abs(), m.1.abs(), b.1.abs());
    if [m.1, b.1].iter().any(|z| (*z > 0.0) != (a.1 > 0.0)) || zm <= za.min(zb) {
        return None;
    }
    let p = Parabola::of(a, m, b);
    let (l, r) = (a.0 - m.0, b.0 - m.0);
    let inside = p.curvature > 0.0 && p.vertex > l && p.vertex < r;
    (inside && p.least < 0.25 * za.min(zb)).then_some(m.0 + p.vertex)
}

/// |z| through three samples: |z| = |z_m| + slope s + curvature s^2, s = t - t_m.
struct Parabola {
    curvature: f64,
    /// s where it is least.
    vertex: f64,
    /// Its value there.
    least: f64,
}

impl Parabola {
    fn of(a: EventPoint, m: EventPoint, b: EventPoint) -> Self {
        let (za, zm, zb) = (a.1.abs(), m.1.abs(), b.1.abs());
        let (l, r) = (a.0 - m.0, b.0 - m.0);
        let (dl, dr) = ((za - zm) / l, (zb - zm) / r);
        let curvature = (dr - dl) / (r - l);
        let slope = dl - curvature * l;
        let vertex = -0.5 * slope / curvature;
        Self { curvature, vertex, least: zm + 0.5 * slope * vertex }
    }
}

/// Between samples of one domain: a point of the other domain, where |z| has a minimum that may reach 0.
///
/// Parabolic and golden section in turn; given up as soon as |z| is larger than its variation within the
/// bracket and the parabola stays clear of 0 too: a smooth function then does so.
fn dip(
    mut a: EventPoint,
    mut m: EventPoint,
    mut b: EventPoint,
    mut z: impl FnMut(f64) -> f64,
) -> Option<EventPoint> {
    let up = a.1 > 0.0;
    if (m.1 > 0.0) != up || (b.1 > 0.0) != up {
        return None;
    }
    for round in 0..60 {
        let (za, zm, zb) = (a.1.abs(), m.1.abs(), b.1.abs());
        let variation = za.max(zb) - zm;
        if zm > za || zm > zb || variation <= 0.0 {
            return None;
        }
        let (l, r) = (a.0 - m.0, b.0 - m.0);
        let Parabola { vertex, least, .. } = Parabola::of(a, m, b);
        if zm > variation && least > 0.75 * zm {
            return None;
        }
        let far = if r > -l { r } else { l };
        let usable = vertex.abs() > 1e-3 * (r - l) && vertex > l && vertex < r;
        let t = m.0 + if usable && round % 3 < 2 { vertex } else { 0.381966 * far };
        if t <= a.0 || t >= b.0 || t == m.0 {
            return None;
        }
        let n = (t, z(t));
        if (n.1 > 0.0) != up {
            return Some(n);
        }
        // Keep the three points around the smaller of the inner two.
        match (n.1.abs() < zm, t > m.0) {
            (true, true) => (a, m) = (m, n),
            (true, false) => (b, m) = (m, n),
            (false, true) => b = n,
            (false, false) => a = n,
        }
    }
    None
}

/// The crossing between `a` and `b`, which are in different domains, to a few units in the last place of t;
/// returns the end of the bracket that is in b's domain. Illinois variant of regula falsi, kept from
/// stalling by bisection.
fn cross(a: EventPoint, b: EventPoint, mut z: impl FnMut(f64) -> f64) -> f64 {
    // On the way down to negative values 0 is passed too, for updates that require z < 0.
    let crossed = |z: f64| if b.1 < 0.0 { z < 0.0 } else { (z > 0.0) == (b.1 > 0.0) };
    let ((mut ta, mut za), (mut tb, mut zb)) = (a, b);
    let tol = 2.0 * f64::EPSILON * ta.abs().max(tb.abs()).max(tb - ta);
    let mut side = 0;
    for round in 1..200 {
        let width = tb - ta;
        if width <= tol {
            break;
        }
        let secant = ta - za * width / (zb - za);
        let inner = secant.clamp(ta + 0.5 * tol.min(width), tb - 0.5 * tol.min(width));
        let t = if round % 4 == 0 || !secant.is_finite() { ta + 0.5 * width } else { inner };
        if t <= ta || t >= tb {
            break;
        }
        let zt = z(t);
        if !crossed(zt) {
            (ta, za) = (t, zt);
            if side == -1 {
                zb *= 0.5;
            }
            side = -1;
        } else {
            (tb, zb) = (t, zt);
            if side == 1 {
                za *= 0.5;
            }
            side = 1;
        }
    }
    tb
}

//! Coupled problems with known solutions.

use nalgebra::{DMatrix, DVector};

use crate::block::{BlockFmu, Dynamics};

/// Blocks and what connects them. A block's name is that of its component.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotProblem {
    /// The blocks.
    pub blocks: Vec<BlockFmu>,
    /// Output to input, both as `block.variable`.
    pub connections: Vec<(String, String)>,
    /// End of the run in s; it begins at 0.
    pub stop: f64,
}

fn linear(a: &[&[f64]], b: &[&[f64]], c: &[&[f64]], d: &[&[f64]]) -> Dynamics {
    let own = |m: &[&[f64]]| m.iter().map(|r| r.to_vec()).collect();
    Dynamics::Linear { a: own(a), b: own(b), c: own(c), d: own(d) }
}

fn problem(blocks: Vec<BlockFmu>, connections: &[(&str, &str)], stop: f64) -> ShotProblem {
    let connections = connections.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect();
    ShotProblem { blocks, connections, stop }
}

/// Two masses of 1 kg: `k` N/m and `c` N.s/m are those of mass 1 to the wall, between them, and of mass 2 to the wall;
/// `x` where they are released. Block `left` is mass 1, moved by a force; block `right` is mass 2 with the spring
/// between, which answers with that force at once.
pub fn two_masses(k: [f64; 3], c: [f64; 3], x: [f64; 2], stop: f64) -> ShotProblem {
    let left = linear(
        &[&[0.0, 1.0], &[-k[0], -c[0]]],
        &[&[0.0], &[1.0]],
        &[&[1.0, 0.0], &[0.0, 1.0]],
        &[&[0.0], &[0.0]],
    );
    let right = linear(
        &[&[0.0, 1.0], &[-k[1] - k[2], -c[1] - c[2]]],
        &[&[0.0, 0.0], &[k[1], c[1]]],
        &[&[k[1], c[1]], &[1.0, 0.0], &[0.0, 1.0]],
        &[&[-k[1], -c[1]], &[0.0, 0.0], &[0.0, 0.0]],
    );
    let left = BlockFmu::new("left", &["F"], &["x1", "v1"], &[("x1Start", x[0]), ("v1Start", 0.0)], left);
    let starts = [("x2Start", x[1]), ("v2Start", 0.0)];
    let right = BlockFmu::new("right", &["x1", "v1"], &["F", "x2", "v2"], &starts, right);
    let connections = [("left.x1", "right.x1"), ("left.v1", "right.v1"), ("right.F", "left.F")];
    problem(vec![left, right], &connections, stop)
}

/// Problem 1: two masses, mild (OMSimulator's DualMassOscillator).
pub fn two_mass() -> ShotProblem {
    two_masses([10.0, 10.0, 20.0], [0.2, 0.5, 0.3], [0.0, 0.5], 10.0)
}

/// Problem 2: two masses, stiff (modes of 232 and 1434 rad/s, damped by 1 %).
pub fn stiff_two_mass() -> ShotProblem {
    two_masses([1e4, 1e6, 1e5], [2.0, 14.1421, 6.3246], [1.0, 2.0], 1.0)
}

/// Problem 3: quarter car on a road that steps by 0.1 m; block `chassis`, and block `wheel` with the suspension.
pub fn quarter_car() -> ShotProblem {
    let (mc, mw, kc, kw, dc) = (400.0, 40.0, 15e3, 150e3, 1e3);
    let chassis = linear(
        &[&[0.0, 1.0], &[0.0, 0.0]],
        &[&[0.0], &[1.0 / mc]],
        &[&[1.0, 0.0], &[0.0, 1.0]],
        &[&[0.0], &[0.0]],
    );
    let wheel = linear(
        &[&[0.0, 1.0, 0.0], &[-(kc + kw) / mw, -dc / mw, kw / mw], &[0.0, 0.0, 0.0]],
        &[&[0.0, 0.0], &[kc / mw, dc / mw], &[0.0, 0.0]],
        &[&[kc, dc, 0.0], &[1.0, 0.0, 0.0]],
        &[&[-kc, -dc], &[0.0, 0.0]],
    );
    let chassis = BlockFmu::new("chassis", &["F"], &["z", "v"], &[("zStart", 0.0), ("vStart", 0.0)], chassis);
    let starts = [("zStart", 0.0), ("vStart", 0.0), ("road", 0.1)];
    let wheel = BlockFmu::new("wheel", &["zChassis", "vChassis"], &["F", "z"], &starts, wheel);
    let connections =
        [("chassis.z", "wheel.zChassis"), ("chassis.v", "wheel.vChassis"), ("wheel.F", "chassis.F")];
    problem(vec![chassis, wheel], &connections, 1.0)
}

/// Problem 4: prey `x' = x (0.1 - 0.02 y)` and predator `y' = y (0.02 x - 0.4)`. Each half is exact for an input on a
/// line.
pub fn lotka_volterra() -> ShotProblem {
    let half = |a: f64, b: f64| Dynamics::Equations {
        flow: vec![format!("x(0) * exp(h * ({a:?} + {b:?} * (u(0) + slope(0) * h / 2)))")],
        outputs: vec!["x(0)".into()],
        feedthrough: vec![vec![None]],
    };
    let prey = BlockFmu::new("prey", &["y"], &["x"], &[("xStart", 10.0)], half(0.1, -0.02));
    let predator = BlockFmu::new("predator", &["x"], &["y"], &[("yStart", 10.0)], half(-0.4, 0.02));
    problem(vec![prey, predator], &[("prey.x", "predator.x"), ("predator.y", "prey.y")], 100.0)
}

/// Problem 5: a loop with direct feedthrough of gain `d2`; with -0.9 stable and stiff, with 1.1 unstable (PyFMI).
pub fn feedthrough_loop(d2: f64) -> ShotProblem {
    let one = |name: &str, a: f64, b: f64, c: f64, d: f64| {
        let dynamics = linear(&[&[a]], &[&[b]], &[&[c]], &[&[d]]);
        let mut block = BlockFmu::new(name, &["u"], &["y", "x"], &[("xStart", 1.0)], dynamics);
        if let Dynamics::Linear { c, d, .. } = &mut block.dynamics {
            c.push(vec![1.0]);
            d.push(vec![0.0]);
        }
        block
    };
    let blocks = vec![one("first", -0.9, 0.5, 3.0, 1.0), one("second", -1.0, 10.0, -31.0, d2)];
    problem(blocks, &[("first.y", "second.u"), ("second.y", "first.u")], 1.0)
}

/// Problem 6: `2 x1^2 + 5 x2 = 42`, `x1 - 6 x2 = 4`, solved at every point of time (OMSimulator's equationPair).
/// `lower` takes the other branch of the root.
pub fn equation_pair(lower: bool) -> ShotProblem {
    let sign = if lower { "-" } else { "" };
    let first = Dynamics::Equations {
        flow: vec![],
        outputs: vec![format!("{sign}sqrt((42 - 5 * u(0)) / 2)")],
        feedthrough: vec![vec![Some(format!("{sign}(-1.25) / sqrt((42 - 5 * u(0)) / 2)"))]],
    };
    let second = Dynamics::Equations {
        flow: vec![],
        outputs: vec!["(u(0) - 4) / 6".into()],
        feedthrough: vec![vec![Some("1.0 / 6".into())]],
    };
    let first = BlockFmu::new("first", &["x2"], &["x1"], &[], first);
    let second = BlockFmu::new("second", &["x1"], &["x2"], &[], second);
    problem(vec![first, second], &[("first.x1", "second.x1"), ("second.x2", "first.x2")], 1.0)
}

/// Problem 7: an oscillator in two halves that both integrate the velocity; the difference of their positions drifts
/// when the step changes while inputs are held.
pub fn drift() -> ShotProblem {
    let spring = linear(&[&[0.0]], &[&[1.0]], &[&[-1.0], &[1.0]], &[&[-1.0], &[0.0]]);
    let mass = linear(
        &[&[0.0, 1.0], &[0.0, 0.0]],
        &[&[0.0], &[1.0]],
        &[&[0.0, 1.0], &[1.0, 0.0]],
        &[&[0.0], &[0.0]],
    );
    let spring = BlockFmu::new("spring", &["v"], &["F", "x"], &[("xStart", 1.0)], spring);
    let mass = BlockFmu::new("mass", &["F"], &["v", "x"], &[("xStart", 1.0), ("vStart", 0.0)], mass);
    problem(vec![spring, mass], &[("spring.F", "mass.F"), ("mass.v", "spring.v")], 20.0)
}

/// Problem 8: `x1`, `x2` jump between 0 and 1; the controller switches by them and by x4; `x4' = 2 x3` (MasterSim's
/// Math003). The end values, of the exact solution: `x4(2) = x4(6) = x4(10) = 2.5`, `x4(4.5) = -2.5`.
pub fn jumps() -> ShotProblem {
    let source = Dynamics::Equations {
        flow: vec![],
        outputs: vec![
            "t < 1 - 1e-9 || (t >= 2 - 1e-9 && t < 5 - 1e-9) ? 0 : 1".into(),
            "t < 3 - 1e-9 || (t >= 4 - 1e-9 && t < 6 - 1e-9) ? 0 : 1".into(),
        ],
        feedthrough: vec![vec![], vec![]],
    };
    let control = Dynamics::Equations {
        flow: vec![],
        outputs: vec![
            "u(0) > 0.99 && u(1) < 0.01 && u(2) < 2.5 ? 3 : u(0) < 0.01 && u(1) > 0.99 && u(2) > -2.5 ? -3 : 0".into(),
        ],
        feedthrough: vec![vec![Some("0".into()); 3]],
    };
    let integrator = linear(&[&[0.0]], &[&[2.0]], &[&[1.0]], &[&[0.0]]);
    let blocks = vec![
        BlockFmu::new("source", &[], &["x1", "x2"], &[], source),
        BlockFmu::new("control", &["x1", "x2", "x4"], &["x3"], &[], control),
        BlockFmu::new("integrator", &["x3"], &["x4"], &[("x4Start", 0.0)], integrator),
    ];
    let connections = [
        ("source.x1", "control.x1"),
        ("source.x2", "control.x2"),
        ("control.x3", "integrator.x3"),
        ("integrator.x4", "control.x4"),
    ];
    problem(blocks, &connections, 10.0)
}

impl ShotProblem {
    /// Every block by another; as [`BlockFmu::plain`].
    #[must_use]
    pub fn map(self, change: impl FnMut(BlockFmu) -> BlockFmu) -> Self {
        Self { blocks: self.blocks.into_iter().map(change).collect(), ..self }
    }

    /// The whole system of linear blocks as one, `x' = M x`, solved by the matrix exponential: the named outputs
    /// (`block.output`) at time `t` in s. `None` if a block is not linear, a name is unknown or the loop is singular.
    pub fn exact(&self, t: f64, outputs: &[&str]) -> Option<Vec<f64>> {
        let counts = self
            .blocks
            .iter()
            .fold([0; 3], |[x, u, y], b| [x + b.states.len(), u + b.inputs.len(), y + b.outputs.len()]);
        let [nx, nu, ny] = counts;
        let mut m = [(nx, nx), (nx, nu), (ny, nx), (ny, nu)].map(|(r, c)| DMatrix::<f64>::zeros(r, c));
        let mut start = DVector::zeros(nx);
        let (mut input_names, mut output_names) = (Vec::new(), Vec::new());
        let [mut x0, mut u0, mut y0] = [0; 3];
        for block in &self.blocks {
            let Dynamics::Linear { a, b, c, d } = &block.dynamics else { return None };
            for (part, into, row0, column0) in
                [(a, 0, x0, x0), (b, 1, x0, u0), (c, 2, y0, x0), (d, 3, y0, u0)]
            {
                for (i, row) in part.iter().enumerate() {
                    for (j, x) in row.iter().enumerate() {
                        m[into][(row0 + i, column0 + j)] = *x;
                    }
                }
            }
            for (i, (_, x)) in block.states.iter().enumerate() {
                start[x0 + i] = *x;
            }
            input_names.extend(block.inputs.iter().map(|n| format!("{}.{n}", block.name)));
            output_names.extend(block.outputs.iter().map(|n| format!("{}.{n}", block.name)));
            [x0, u0, y0] = [x0 + block.states.len(), u0 + block.inputs.len(), y0 + block.outputs.len()];
        }
        let mut wiring = DMatrix::<f64>::zeros(nu, ny);
        for (from, to) in &self.connections {
            let from = output_names.iter().position(|n| n == from)?;
            wiring[(input_names.iter().position(|n| n == to)?, from)] = 1.0;
        }
        let [a, b, c, d] = m;
        // y = C x + D W y
        let y = (DMatrix::identity(ny, ny) - d * &wiring).try_inverse()? * c;
        let x = ((a + b * wiring * &y) * t).exp() * start;
        let y = y * x;
        outputs.iter().map(|n| output_names.iter().position(|o| o == n).map(|i| y[i])).collect()
    }
}

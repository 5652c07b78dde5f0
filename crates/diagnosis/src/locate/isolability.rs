//! What these sensors can distinguish at all, from the structure of the equations alone.
//!
//! Dulmage-Mendelsohn: a fault shows if its equation is in the over-determined part; it can be distinguished from another if it
//! still does without the other's equation (M. Krysander, J. Aslund, M. Nyberg, IEEE Trans. SMC A 38, 2008). What cannot
//! be distinguished so can be distinguished by the *form* of an effect only, as long as nothing else is missing.

use std::collections::BTreeSet;

/// Equations, the unknowns in each, and the component that is at fault where one does not hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EquationStructure {
    equations: Vec<Equation>,
    unknowns: Vec<String>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Equation {
    unknowns: BTreeSet<usize>,
    fault: Option<String>,
}

/// Components in classes that the sensors cannot distinguish.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Isolability {
    /// Equations more than unknowns in the over-determined part.
    pub redundancy: usize,
    /// Components whose faults leave no trace in any balance of measured quantities.
    pub hidden: Vec<String>,
    /// Components that show, each with those from which it cannot be distinguished.
    pub classes: Vec<Vec<String>>,
}

impl Isolability {
    /// Whether structure alone distinguishes this component from every other one.
    pub fn isolable(&self, component: &str) -> bool {
        self.classes.iter().any(|class| class.len() == 1 && class[0] == component)
    }
}

impl EquationStructure {
    /// An equation between these unknowns, and the component that answers for it.
    pub fn equation(&mut self, unknowns: &[&str], fault: Option<&str>) {
        let unknowns = unknowns.iter().map(|name| self.unknown(name)).collect();
        self.equations.push(Equation { unknowns, fault: fault.map(str::to_owned) });
    }

    fn unknown(&mut self, name: &str) -> usize {
        self.unknowns.iter().position(|n| n == name).unwrap_or_else(|| {
            self.unknowns.push(name.to_owned());
            self.unknowns.len() - 1
        })
    }

    /// A sensor or a known input: the fault `sensor:<channel>`; inputs without a standard deviation have none.
    fn measured(&mut self, unknown: &str, fault: Option<&str>) {
        self.equation(&[unknown], fault);
    }

    /// The structure of a joint with these measured channels (FMU variables; inputs too).
    pub fn joint(flexible: bool, channels: &[&str]) -> Self {
        let mut s = Self::default();
        s.equation(&["current", "drive"], Some("actuator"));
        s.equation(&["friction", "d motor"], Some("motor-friction"));
        s.equation(&["dd motor", "drive", "friction", "spring"], None);
        if flexible {
            s.equation(&["spring", "motor", "load", "d motor", "d load"], Some("transmission"));
        } else {
            s.equation(&["motor", "load"], Some("transmission"));
        }
        s.equation(&["dd load", "spring", "external"], Some("load"));
        for of in ["motor", "load"] {
            s.equation(&[&format!("d {of}"), of], None);
            s.equation(&[&format!("dd {of}"), &format!("d {of}")], None);
        }
        if channels.contains(&"positionReference") {
            s.equation(&["current", "reference", "motor", "load", "d motor"], None);
            s.measured("reference", None);
        }
        // The external force on the load is an input; not recorded, it is assumed to be 0.
        s.measured("external", None);
        for (channel, unknown) in [
            ("motorCurrent", "current"),
            ("motorAngle", "motor"),
            ("motorVelocity", "d motor"),
            ("motorAcceleration", "dd motor"),
            ("loadAngle", "load"),
            ("loadVelocity", "d load"),
            ("loadAcceleration", "dd load"),
            ("motorTorque", "drive"),
            ("transmissionTorque", "spring"),
            ("frictionTorque", "friction"),
        ] {
            if channels.contains(&channel) {
                s.measured(unknown, Some(&format!("sensor:{channel}")));
            }
        }
        s
    }

    /// The structure of a manipulator with these measured channels. Components of joint i are `actuator[i]`,
    /// `motor-friction[i]`, `transmission[i]`, `load[i]`; the external forces on base and tip are `base` and `tip`.
    pub fn arm(flexible: &[bool], channels: &[&str]) -> Self {
        let n = flexible.len();
        let mut s = Self::default();
        let has = |channel: &str| channels.contains(&channel);
        let pose = ["x", "y", "phi"];
        let motion = |d: &str| -> Vec<String> {
            pose.iter().map(|p| format!("{d}{p}")).chain((1..=n).map(|i| format!("{d}q{i}"))).collect()
        };
        // Every row of the links' dynamics has all accelerations, rates and angles in it.
        let all: Vec<String> = [motion("dd "), motion("d "), motion("")].concat();
        let mut row = |own: &[String], fault: &str| {
            let names: Vec<&str> = all.iter().chain(own).map(String::as_str).collect();
            s.equation(&names, Some(fault));
        };
        for axis in pose {
            row(&[format!("base {axis}"), format!("tip {axis}")], "base");
        }
        for i in 1..=n {
            let tip: Vec<String> = pose.iter().map(|axis| format!("tip {axis}")).collect();
            row(&[vec![format!("spring{i}")], tip].concat(), &format!("load[{i}]"));
        }
        for axis in pose {
            s.measured(&format!("base {axis}"), Some("base"));
            s.measured(&format!("tip {axis}"), Some("tip"));
        }
        for (i, flexible) in (1..=n).zip(flexible) {
            let name = |v: &str| format!("{v}{i}");
            s.equation(&[&name("command"), &name("drive")], Some(&format!("actuator[{i}]")));
            let reference = name("reference");
            if has(&format!("positionReference[{i}]")) {
                let read = [name("command"), reference.clone(), name("m"), name("q"), name("d m")];
                s.equation(&read.each_ref().map(String::as_str), None);
                s.measured(&reference, None);
            }
            s.equation(&[&name("friction"), &name("d m")], Some(&format!("motor-friction[{i}]")));
            // The rotor turns with what carries it.
            let mut rotor =
                vec![name("dd m"), name("drive"), name("friction"), name("spring"), "dd phi".into()];
            rotor.extend((1..i).map(|k| format!("dd q{k}")));
            s.equation(&rotor.iter().map(String::as_str).collect::<Vec<_>>(), None);
            let transmission = format!("transmission[{i}]");
            if *flexible {
                let own = [name("spring"), name("m"), name("q"), name("d m"), name("d q")];
                s.equation(&own.each_ref().map(String::as_str), Some(&transmission));
            } else {
                s.equation(&[&name("m"), &name("q")], Some(&transmission));
            }
        }
        let moving = motion("").into_iter().chain((1..=n).map(|i| format!("m{i}")));
        for v in moving {
            s.equation(&[&format!("d {v}"), &v], None);
            s.equation(&[&format!("dd {v}"), &format!("d {v}")], None);
        }
        let element = |base: &str, i: usize| format!("{base}[{i}]");
        let mut sensor = |channel: String, unknown: String| {
            if has(&channel) {
                s.measured(&unknown, Some(&format!("sensor:{channel}")));
            }
        };
        for (i, axis) in [(1, "x"), (2, "y")] {
            sensor(element("basePosition", i), axis.to_owned());
            sensor(element("baseVelocity", i), format!("d {axis}"));
        }
        sensor("baseAttitude".into(), "phi".into());
        sensor("baseRate".into(), "d phi".into());
        for i in 1..=n {
            sensor(element("jointTorque", i), format!("command{i}"));
            sensor(element("jointAngle", i), format!("q{i}"));
            sensor(element("jointVelocity", i), format!("d q{i}"));
            sensor(element("motorAngle", i), format!("m{i}"));
            sensor(element("motorVelocity", i), format!("d m{i}"));
        }
        for (channel, d) in [("tipPosition", ""), ("tipVelocity", "d ")] {
            for i in [1, 2] {
                let channel = element(channel, i);
                if has(&channel) {
                    let names: Vec<String> =
                        if d.is_empty() { motion("") } else { [motion("d "), motion("")].concat() };
                    let names: Vec<&str> = names.iter().map(String::as_str).collect();
                    s.equation(&names, Some(&format!("sensor:{channel}")));
                }
            }
        }
        if has("tipAttitude") {
            let names: Vec<String> = motion("").into_iter().skip(2).collect();
            s.equation(&names.iter().map(String::as_str).collect::<Vec<_>>(), Some("sensor:tipAttitude"));
        }
        s
    }

    /// Which components these equations distinguish.
    pub fn isolability(&self) -> Isolability {
        let all: Vec<usize> = (0..self.equations.len()).collect();
        let over = self.over_determined(&all);
        let unknowns: BTreeSet<usize> =
            over.iter().flat_map(|e| self.equations[*e].unknowns.iter().copied()).collect();
        let mut components: Vec<&str> = Vec::new();
        for fault in self.equations.iter().filter_map(|e| e.fault.as_deref()) {
            if !components.contains(&fault) {
                components.push(fault);
            }
        }
        let of = |e: &usize| self.equations[*e].fault.as_deref();
        let shows = |component: &str, over: &BTreeSet<usize>| over.iter().any(|e| of(e) == Some(component));
        // `told[i][j]`: something shows of i where all of j is left out.
        let without: Vec<BTreeSet<usize>> = components
            .iter()
            .map(|c| {
                let rest: Vec<usize> = all.iter().copied().filter(|e| of(e) != Some(c)).collect();
                self.over_determined(&rest)
            })
            .collect();
        let (shown, hidden): (Vec<usize>, Vec<usize>) =
            (0..components.len()).partition(|i| shows(components[*i], &over));
        let mut classes: Vec<Vec<usize>> = Vec::new();
        for &i in &shown {
            let apart = |j: usize| shows(components[i], &without[j]) && shows(components[j], &without[i]);
            match classes.iter_mut().find(|class| class.iter().any(|j| !apart(*j))) {
                Some(class) => class.push(i),
                None => classes.push(vec![i]),
            }
        }
        let name = |i: &usize| components[*i].to_owned();
        Isolability {
            redundancy: over.len().saturating_sub(unknowns.len()),
            hidden: hidden.iter().map(name).collect(),
            classes: classes.iter().map(|class| class.iter().map(name).collect()).collect(),
        }
    }

    /// How many minimal over-determined sets there are: each is a balance that can be checked by itself.
    pub fn minimal_sets(&self) -> usize {
        let all: Vec<usize> = (0..self.equations.len()).collect();
        let over: Vec<usize> = self.over_determined(&all).into_iter().collect();
        let mut found = BTreeSet::new();
        let mut seen = BTreeSet::new();
        self.minimal(over, &mut seen, &mut found);
        found.len()
    }

    /// Leaves equations out one by one until none is left over.
    fn minimal(&self, over: Vec<usize>, seen: &mut BTreeSet<Vec<usize>>, found: &mut BTreeSet<Vec<usize>>) {
        if over.is_empty() || !seen.insert(over.clone()) {
            return;
        }
        let unknowns: BTreeSet<usize> =
            over.iter().flat_map(|e| self.equations[*e].unknowns.iter().copied()).collect();
        if over.len() == unknowns.len() + 1 {
            found.insert(over);
            return;
        }
        for left_out in &over {
            let rest: Vec<usize> = over.iter().copied().filter(|e| e != left_out).collect();
            self.minimal(self.over_determined(&rest).into_iter().collect(), seen, found);
        }
    }

    /// The equations that alternating paths reach from those that a largest matching leaves free.
    fn over_determined(&self, equations: &[usize]) -> BTreeSet<usize> {
        let mut matched: Vec<Option<usize>> = vec![None; self.unknowns.len()];
        let mut free = Vec::new();
        for e in equations {
            if !self.augment(*e, &mut matched, &mut vec![false; self.unknowns.len()]) {
                free.push(*e);
            }
        }
        let mut reached: BTreeSet<usize> = free.iter().copied().collect();
        while let Some(e) = free.pop() {
            for matched in self.equations[e].unknowns.iter().filter_map(|u| matched[*u]) {
                if reached.insert(matched) {
                    free.push(matched);
                }
            }
        }
        reached
    }

    fn augment(&self, e: usize, matched: &mut [Option<usize>], tried: &mut [bool]) -> bool {
        for &u in &self.equations[e].unknowns {
            if std::mem::replace(&mut tried[u], true) {
                continue;
            }
            if matched[u].is_none_or(|other| self.augment(other, matched, tried)) {
                matched[u] = Some(e);
                return true;
            }
        }
        false
    }
}

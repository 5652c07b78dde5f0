//! Ports, checks and effects as text and as JSON.

use serde_json::{Value, json};
use trueup_fmi_import::UsedInterface;
use trueup_ports::check::PortCheck;
use trueup_ports::insert::EffectInsertion;
use trueup_ports::plant::{InsertionPoint, PlantOfPorts};
use trueup_ports::roles::{FmuPorts, PortVariable};
use trueup_ports::{FmuQuantities, quantity};

/// All that is reported of an FMU.
pub(super) struct PortsReport<'a> {
    pub(super) model: &'a str,
    pub(super) interface: UsedInterface,
    pub(super) ports: &'a FmuPorts,
    pub(super) all: &'a FmuQuantities,
    pub(super) checks: &'a [PortCheck],
    pub(super) effects: &'a [EffectInsertion],
    /// `None`: the experiments are not by Model Exchange.
    pub(super) plant: Option<&'a PlantOfPorts>,
    /// Text of the draft; `None`: the ports were given.
    pub(super) draft: Option<&'a str>,
}

impl PortsReport<'_> {
    fn interface(&self) -> &'static str {
        match self.interface {
            UsedInterface::ModelExchange => "Model Exchange",
            UsedInterface::CoSimulation => "Co-Simulation",
        }
    }

    fn unit(&self, v: &PortVariable) -> &str {
        let lists = [&self.all.inputs, &self.all.outputs, &self.all.parameters];
        lists.into_iter().flatten().find(|q| q.name == v.variable).map_or("", |q| &q.unit)
    }

    pub(super) fn text(&self) -> String {
        let drafted = if self.draft.is_some() { "guessed" } else { "as given" };
        let mut out = format!("{}: ports, {drafted}; experiments by {}\n", self.model, self.interface());
        let mut place = None;
        for v in &self.ports.variables {
            if place != Some(&v.place) {
                out += &format!("\n{}\n", v.place.title());
                place = Some(&v.place);
            }
            let line = format!("  {:<20}{:<28}{:<10}{}", v.role.key(), v.variable, self.unit(v), v.reason);
            out += &format!("{}\n", line.trim_end());
        }
        for f in &self.ports.figures {
            let line = format!("  {:<20}{:<28}{:<10}{}", f.key, f.value, f.place.title(), f.reason);
            out += &format!("{}\n", line.trim_end());
        }
        out += &format!("\n{} readings under [sensors]\n", self.ports.sensors.len());
        if !self.ports.open.is_empty() {
            out += "\nOpen\n";
            self.ports.open.iter().for_each(|o| out += &format!("  {o}\n"));
        }
        out += "\nChecks\n";
        for c in self.checks {
            let place = c.place.as_ref().map_or_else(|| "FMU".to_owned(), |p| p.title());
            out += &format!("  {:<13}{:<10}{}\n", c.outcome.word(), place, c.text);
        }
        out + &self.points_text() + &self.effects_text()
    }

    /// Insertion points, one kind a line, then places that are no coordinates.
    fn points_text(&self) -> String {
        let Some(found) = self.plant else { return String::new() };
        let mut lists: Vec<(&str, Vec<String>)> = Vec::new();
        for point in found.points() {
            match lists.iter_mut().find(|(acts, _)| *acts == point.acts.title()) {
                Some((_, names)) => names.push(point.name),
                None => lists.push((point.acts.title(), vec![point.name])),
            }
        }
        let mut out = String::from("\nInsertion points\n");
        for (acts, names) in lists {
            let shown = match names.len() {
                0..=6 => names.join(", "),
                n => format!("{}, ... ({n})", names[..3].join(", ")),
            };
            out += &format!("  {acts:<24}{shown}\n");
        }
        found.unreached.iter().for_each(|why| out += &format!("  no force on {why}\n"));
        out
    }

    /// Ids that can act with their ports, then the others with the reason; ports with one reason are one line.
    fn effects_text(&self) -> String {
        let mut out = String::from("\nEffects that can be inserted\n");
        let mut refused: Vec<(&str, &str, Vec<&str>)> = Vec::new();
        let mut accepted: Vec<(&str, &str, Vec<&str>)> = Vec::new();
        for e in self.effects {
            let (list, why) = match &e.obstacle {
                None => (&mut accepted, e.how),
                Some(why) => (&mut refused, why.as_str()),
            };
            match list.iter_mut().find(|(id, other, _)| *id == e.id && *other == why) {
                Some((.., ports)) => ports.push(&e.port),
                None => list.push((&e.id, why, vec![&e.port])),
            }
        }
        if accepted.is_empty() {
            out += "  none\n";
        }
        for (id, how, ports) in &accepted {
            let shown = match ports.len() {
                0..=6 => ports.join(", "),
                n => format!("{}, ... ({n})", ports[..3].join(", ")),
            };
            out += &format!("  {id:<28}{how:<24}{shown}\n");
        }
        out += "\nEffects that cannot\n";
        for (id, why, ports) in &refused {
            out += &format!("  {id:<28}{}: {why}\n", ports.join(", "));
        }
        out
    }

    pub(super) fn json(&self) -> Value {
        let variables = self.ports.variables.iter().map(|v| {
            json!({
                "place": v.place.table(), "role": v.role.key(), "variable": v.variable, "unit": self.unit(v),
                "causality": quantity::causality(v.role.causality()).rsplit(' ').next(),
                "guess": (!v.reason.is_empty()).then_some(&v.reason),
            })
        });
        let variables: Vec<Value> = variables.collect();
        let figures: Vec<Value> = (self.ports.figures.iter())
            .map(|f| json!({"place": f.place.table(), "key": f.key, "value": f.value, "guess": (!f.reason.is_empty()).then_some(&f.reason)}))
            .collect();
        let sensors: serde_json::Map<String, Value> =
            self.ports.sensors.iter().map(|s| (s.variable.clone(), json!({"kind": s.kind}))).collect();
        let checks: Vec<Value> = (self.checks.iter())
            .map(|c| {
                let place = c.place.as_ref().map(|p| p.table());
                json!({"place": place, "check": c.check, "outcome": c.outcome.word(), "figure": c.figure, "text": c.text})
            })
            .collect();
        let effects: Vec<Value> = (self.effects.iter())
            .map(|e| json!({"id": e.id, "port": e.port, "how": e.how, "possible": e.obstacle.is_none(), "why_not": e.obstacle}))
            .collect();
        let points = self.plant.map(|found| {
            let point = |p: &InsertionPoint| json!({"acts": p.acts.title(), "name": p.name, "unit": p.unit});
            found.points().iter().map(point).collect::<Vec<Value>>()
        });
        let unreached = self.plant.map(|found| &found.unreached);
        json!({
            "insertion_points": points, "unreached": unreached,
            "model": self.model, "fmu": self.ports.fmu, "interface": self.interface(), "variables": variables, "figures": figures,
            "sensors": sensors, "open": self.ports.open, "checks": checks, "effects": effects, "toml": self.draft,
        })
    }
}

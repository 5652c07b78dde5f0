//! Puts a variable table together: storage indices count up in the order in which variables are named.

use trueup_fmi::table::{
    BoundaryType, Causality, Depends, ModelTable, Storage, TableExperiment, TableVariable, Terminal,
    Variability,
};
use trueup_models::effect::{EffectChoice, EffectSet, ParameterSpec, PlantKind, Scope, SignalSpec};
use trueup_models::joint;

/// A state and its rate: name, unit, unit of the rate, dimensions, nominal value, what the rate depends on, text.
pub(crate) type TableState<'a> = (&'a str, &'static str, &'static str, &'a [usize], f64, Depends, &'a str);

/// A table in the making.
pub(crate) struct PlantTableBuilder {
    table: ModelTable,
    next: [usize; 4],
}

pub(crate) const PARAMETER: usize = 0;
pub(crate) const INPUT: usize = 1;
pub(crate) const OUTPUT: usize = 2;
pub(crate) const STATE: usize = 3;
/// What effects bring.
const EFFECT_PARTS: [usize; 4] = [PARAMETER, INPUT, OUTPUT, STATE];

impl PlantTableBuilder {
    pub(crate) fn new(name: &str, description: &str, experiment: TableExperiment) -> Self {
        let time = TableVariable::new(
            "time",
            Causality::Independent,
            Variability::Continuous,
            Storage::Time,
            "s",
            "Time",
        );
        let table = ModelTable {
            name: name.to_owned(),
            title: None,
            description: description.to_owned(),
            variables: vec![time],
            enumerations: Vec::new(),
            terminals: Vec::new(),
            indicators: 0,
            experiment,
        };
        Self { table, next: [0; 4] }
    }
    fn take(&mut self, class: usize, dimensions: &[usize]) -> usize {
        let first = self.next[class];
        self.next[class] += dimensions.iter().product::<usize>();
        first
    }
    /// An enumeration type, which is there once; returns its index.
    pub(crate) fn enumeration(&mut self, e: trueup_fmi::table::Enumeration) -> BoundaryType {
        let known = self.table.enumerations.iter().position(|k| *k == e);
        BoundaryType::Enumeration(known.unwrap_or_else(|| {
            self.table.enumerations.push(e);
            self.table.enumerations.len() - 1
        }))
    }
    /// A parameter that may be changed between steps; one start value per element.
    pub(crate) fn tunable(
        &mut self,
        name: &str,
        unit: &'static str,
        dims: &[usize],
        start: &[f64],
        text: &str,
    ) -> &mut TableVariable {
        self.parameter(name, Variability::Tunable, unit, dims, start, text)
    }
    /// A parameter that is fixed once the run has begun.
    pub(crate) fn fixed(
        &mut self,
        name: &str,
        unit: &'static str,
        dims: &[usize],
        start: &[f64],
        text: &str,
    ) -> &mut TableVariable {
        self.parameter(name, Variability::Fixed, unit, dims, start, text)
    }
    fn parameter(
        &mut self,
        name: &str,
        v: Variability,
        unit: &'static str,
        dims: &[usize],
        start: &[f64],
        text: &str,
    ) -> &mut TableVariable {
        let at = Storage::Parameter(self.take(PARAMETER, dims));
        self.push(TableVariable::new(name, Causality::Parameter, v, at, unit, text).array(dims).start(start))
    }
    /// An input, 0 unless set.
    pub(crate) fn input(
        &mut self,
        name: &str,
        unit: &'static str,
        dims: &[usize],
        text: &str,
    ) -> &mut TableVariable {
        let at = Storage::Input(self.take(INPUT, dims));
        let zeros = vec![0.0; dims.iter().product()];
        self.push(
            TableVariable::new(name, Causality::Input, Variability::Continuous, at, unit, text)
                .array(dims)
                .start(&zeros),
        )
    }
    /// An output.
    pub(crate) fn output(
        &mut self,
        name: &str,
        unit: &'static str,
        dims: &[usize],
        depends: Depends,
        text: &str,
    ) -> &mut TableVariable {
        let at = Storage::Output(self.take(OUTPUT, dims));
        let v = self.push(
            TableVariable::new(name, Causality::Output, Variability::Continuous, at, unit, text).array(dims),
        );
        v.depends = depends;
        v
    }
    /// A Boolean output that changes at events.
    pub(crate) fn flag(&mut self, name: &str, dims: &[usize], text: &str) {
        self.item(name, BoundaryType::Boolean, dims, text);
    }
    /// An output of that kind that changes at events.
    pub(crate) fn item(&mut self, name: &str, kind: BoundaryType, dims: &[usize], text: &str) {
        let at = Storage::Output(self.take(OUTPUT, dims));
        self.push(
            TableVariable::new(name, Causality::Output, Variability::Discrete, at, "", text)
                .array(dims)
                .kind(kind),
        );
    }
    /// Something that is fixed when packed.
    pub(crate) fn constant(
        &mut self,
        name: &str,
        kind: BoundaryType,
        dims: &[usize],
        value: &[f64],
        text: &str,
    ) {
        self.push(
            TableVariable::new(name, Causality::Local, Variability::Constant, Storage::Constant, "", text)
                .array(dims)
                .kind(kind)
                .start(value),
        );
    }
    /// States and their rates.
    pub(crate) fn states(&mut self, list: &[TableState]) {
        for (name, unit, _, dims, nominal, _, text) in list {
            let at = Storage::State(self.take(STATE, dims));
            let name = format!("state.{name}");
            self.push(
                TableVariable::new(&name, Causality::Local, Variability::Continuous, at, unit, text)
                    .array(dims)
                    .nominal(*nominal),
            );
        }
        let mut at = self.next[STATE] - list.iter().map(|s| s.3.iter().product::<usize>()).sum::<usize>();
        for (name, _, unit, dims, _, depends, text) in list {
            let (state, text) = (format!("state.{name}"), format!("Rate: {text}"));
            let v = TableVariable::new(
                &format!("der({state})"),
                Causality::Local,
                Variability::Continuous,
                Storage::Rate(at),
                unit,
                &text,
            );
            self.push(v.array(dims).derivative_of(&state)).depends = depends.clone();
            at += dims.iter().product::<usize>();
        }
    }
    /// Parameters, inputs, states and outputs of the effects.
    pub(crate) fn effects(&mut self, effects: &EffectSet, plant: PlantKind) {
        self.effect_parts(effects, plant, &EFFECT_PARTS);
    }
    /// Some of them: others' variables may be between.
    pub(crate) fn effect_parts(&mut self, effects: &EffectSet, plant: PlantKind, parts: &[usize]) {
        let has = |part: usize| parts.contains(&part);
        for e in effects.iter() {
            let (sites, choice) = (e.sites, e.choice);
            let dims = e.dimensions(plant);
            for p in choice.parameters().iter().filter(|_| has(PARAMETER)) {
                let start = if plant == PlantKind::Joint { p.joint_start } else { p.arm_start };
                let (name, unit) = (choice.variable(p.name), choice.unit(p.unit));
                let v = self.tunable(&name, unit, &dims, &vec![start; sites], p.description);
                bounds(v, p);
            }
            let (inputs, motor_current) =
                (e.spec().inputs, joint::input::NAMES[joint::input::MOTOR_CURRENT].0);
            for u in inputs.iter().filter(|_| has(INPUT)) {
                self.input(u.name_in(plant), u.unit, &dims, u.description);
            }
            // What depends on the inputs of a drive depends on those of what drives it.
            for v in self.table.variables.iter_mut().filter(|_| has(OUTPUT)) {
                if let Depends::StatesAnd(names) = &mut v.depends
                    && names.iter().any(|n| n == motor_current)
                {
                    names.extend(inputs.iter().map(|u| u.name_in(plant).to_owned()));
                }
            }
            let states = if has(STATE) { e.spec().states } else { &[] };
            let names: Vec<_> = states.iter().map(|s| choice.variable(s.name_in(plant))).collect();
            let states: Vec<_> =
                names.iter().zip(states).map(|(name, s)| state(name, s, choice, &dims)).collect();
            self.states(&states);
            for y in e.spec().outputs.iter().filter(|_| has(OUTPUT)) {
                let name = y.name_in(plant);
                if y.boolean {
                    self.flag(name, &dims, y.description);
                } else {
                    self.output(name, y.unit, &dims, Depends::copy(&format!("state.{name}")), y.description);
                }
            }
            // A sensor shows something else than the states alone.
            if has(OUTPUT)
                && choice.scope() == Scope::Channel
                && let Some(channel) = choice.place()
            {
                let shown = self.table.variables.iter_mut().find(|v| v.name == channel.name);
                if let Some(v) = shown
                    && matches!(v.depends, Depends::On(_) | Depends::Linear(_))
                {
                    v.depends = Depends::StatesAnd(Vec::new());
                }
            }
        }
    }
    /// Another text for a variable that is there.
    pub(crate) fn retell(&mut self, name: &str, text: &str) {
        if let Some(v) = self.table.variables.iter_mut().find(|v| v.name == name) {
            v.description = text.to_owned();
        }
    }
    /// A plug whose members are called as their variables.
    pub(crate) fn terminal(&mut self, name: &str, text: &str, members: &[&str]) {
        let members: Vec<(&str, &str)> = members.iter().map(|m| (*m, *m)).collect();
        self.plug(name, text, &members);
    }
    /// A plug: pairs of member and variable.
    pub(crate) fn plug(&mut self, name: &str, text: &str, members: &[(&str, &str)]) {
        let members = members.iter().map(|(m, v)| ((*m).to_owned(), (*v).to_owned())).collect();
        self.table.terminals.push(Terminal { name: name.to_owned(), description: text.to_owned(), members });
    }
    fn push(&mut self, v: TableVariable) -> &mut TableVariable {
        self.table.variables.push(v);
        let last = self.table.variables.len() - 1;
        &mut self.table.variables[last]
    }
    /// The finished table, with value references.
    pub(crate) fn finish(mut self, indicators: usize) -> ModelTable {
        self.table.indicators = indicators;
        self.table.number();
        self.table
    }
}

fn bounds(v: &mut TableVariable, p: &ParameterSpec) {
    v.min = p.min.is_finite().then_some(p.min);
    v.max = p.max.is_finite().then_some(p.max);
    v.exclusive = p.above_min;
}

fn state<'a>(name: &'a str, s: &'a SignalSpec, choice: EffectChoice, dims: &'a [usize]) -> TableState<'a> {
    (name, choice.unit(s.unit), choice.unit(s.rate_unit), dims, s.nominal, Depends::All, s.description)
}

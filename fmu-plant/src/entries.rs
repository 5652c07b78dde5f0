//! Lists of a model's variables ([`trueup_models::layout`]) as a table.

use crate::builder::PlantTableBuilder;
use crate::structure::{RequestedStructure, choices};
use trueup_fmi::table::{BoundaryType, Depends, Enumeration, LinearFactor};
use trueup_models::layout::{
    AllowedValues, InputStart, Items, LayoutEntry, LayoutState, Parameter, Shows, TermFactor,
};

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

fn depends(shows: Shows) -> Depends {
    match shows {
        Shows::State(name) => Depends::copy(&format!("state.{name}")),
        Shows::States => Depends::StatesAnd(Vec::new()),
        Shows::StatesAnd(inputs) => Depends::StatesAnd(owned(inputs)),
        Shows::On(names) => Depends::On(owned(names)),
        Shows::Linear(terms) => {
            let factor = |f| match f {
                TermFactor::Constant => LinearFactor::Constant,
                TermFactor::Fixed => LinearFactor::Fixed,
                TermFactor::Tunable => LinearFactor::Tunable,
            };
            Depends::Linear(terms.iter().map(|(name, f)| ((*name).to_owned(), factor(*f))).collect())
        }
        Shows::All | Shows::Flag | Shows::Item(_) => Depends::All,
    }
}

impl PlantTableBuilder {
    /// An enumeration type, which is there once.
    pub(crate) fn items(&mut self, items: &Items) -> BoundaryType {
        let own = Enumeration { name: items.name, description: items.text, items: items.items.to_vec() };
        self.enumeration(own)
    }
    /// What is chosen of the model's structure, by the numbers of its choices.
    pub(crate) fn structure(&mut self, model: &str, values: &[usize]) {
        for (choice, value) in choices(model).iter().zip(values) {
            let kind = match choice.wanted {
                RequestedStructure::Count(_) => BoundaryType::Integer,
                RequestedStructure::Item(items) => self.items(items),
            };
            let text = format!("{} (fixed when packed)", choice.text);
            self.constant(choice.name, kind, &[], &[*value as f64], &text);
        }
    }
    /// Parameters with those start values, in order.
    pub(crate) fn parameters(&mut self, entries: &[LayoutEntry<Parameter>], start: &[f64]) {
        let mut rest = start;
        for e in entries {
            let (own, behind) = rest.split_at(e.len().min(rest.len()));
            rest = behind;
            let kind = match e.kind.allowed {
                AllowedValues::Item(items) => Some(self.items(items)),
                _ => None,
            };
            let v = if e.kind.tunable {
                self.tunable(e.name, e.unit, &e.dimensions, own, e.text)
            } else {
                self.fixed(e.name, e.unit, &e.dimensions, own, e.text)
            };
            match e.kind.allowed {
                AllowedValues::Any | AllowedValues::Item(_) => {}
                AllowedValues::Positive => {
                    v.bounded_above(0.0);
                }
                AllowedValues::NotNegative => {
                    v.bounded(0.0);
                }
                AllowedValues::OneUp => {
                    v.bounded(1.0);
                }
            }
            if let Some(kind) = kind {
                v.kind = kind;
            }
            v.follows = e.kind.follows.map(str::to_owned);
        }
    }
    /// Inputs with their start values.
    pub(crate) fn inputs(&mut self, entries: &[LayoutEntry<InputStart>]) {
        for e in entries {
            let start = if e.kind.is_empty() { vec![0.0; e.len()] } else { e.kind.to_vec() };
            self.input(e.name, e.unit, &e.dimensions, e.text).start = start;
        }
    }
    /// Outputs.
    pub(crate) fn outputs(&mut self, entries: &[LayoutEntry<Shows>]) {
        for e in entries {
            match e.kind {
                Shows::Flag => self.flag(e.name, &e.dimensions, e.text),
                Shows::Item(items) => {
                    let kind = self.items(items);
                    self.item(e.name, kind, &e.dimensions, e.text);
                }
                shows => {
                    self.output(e.name, e.unit, &e.dimensions, depends(shows), e.text);
                }
            }
        }
    }
    /// States and their rates.
    pub(crate) fn moved(&mut self, entries: &[LayoutEntry<LayoutState>]) {
        let rate = |shows| if shows == Shows::Flag { Depends::On(Vec::new()) } else { depends(shows) };
        let states: Vec<crate::builder::TableState<'_>> = entries
            .iter()
            .map(|e| {
                (e.name, e.unit, e.kind.rate, &e.dimensions[..], e.kind.nominal, rate(e.kind.depends), e.text)
            })
            .collect();
        self.states(&states);
    }
}

//! XML elements with their line, and typed attributes.

use std::str::FromStr;

use super::error::ReadError;
use crate::FmiVersion;
use crate::description::{
    Attributes, BaseUnit, ClockAttributes, DescriptionCausality, DescriptionUnit, DescriptionVariability,
    DisplayUnit, Initial, Item, StartValues, VariableType,
};

/// Where each line starts, so that a place costs a search and not a walk through the text.
pub(super) struct LineStarts<'t> {
    text: &'t str,
    starts: Vec<usize>,
}

impl<'t> LineStarts<'t> {
    pub(super) fn of(text: &'t str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at + 1);
        Self { text, starts: std::iter::once(0).chain(breaks).collect() }
    }
    fn place(&self, at: usize) -> (u32, u32) {
        let line = self.starts.partition_point(|start| *start <= at);
        let start = self.starts.get(line.saturating_sub(1)).copied().unwrap_or(0);
        let column = self.text.get(start..at).map_or(0, |s| s.chars().count()) + 1;
        (line as u32, column as u32)
    }
}

/// An element.
#[derive(Clone, Copy)]
pub(super) struct DescriptionNode<'d, 'l> {
    node: roxmltree::Node<'d, 'd>,
    lines: &'l LineStarts<'l>,
}

impl<'d, 'l> DescriptionNode<'d, 'l> {
    pub(super) fn new(node: roxmltree::Node<'d, 'd>, lines: &'l LineStarts<'l>) -> Self {
        Self { node, lines }
    }
    pub(super) fn name(&self) -> &'d str {
        self.node.tag_name().name()
    }
    pub(super) fn line(&self) -> u32 {
        self.lines.place(self.node.range().start).0
    }
    pub(super) fn error(&self, message: String) -> ReadError {
        self.error_at(self.node.range().start, message)
    }
    fn error_at(&self, at: usize, message: String) -> ReadError {
        let (line, column) = self.lines.place(at);
        ReadError { line, column, message }
    }
    pub(super) fn children(&self) -> impl Iterator<Item = Self> + use<'d, 'l> {
        let lines = self.lines;
        self.node.children().filter(roxmltree::Node::is_element).map(move |node| Self { node, lines })
    }
    pub(super) fn child(&self, name: &str) -> Option<Self> {
        self.children().find(|n| n.name() == name)
    }
    /// The children of the child of that name; none if it is not there.
    pub(super) fn children_of(&self, name: &str) -> impl Iterator<Item = Self> + use<'d, 'l> {
        self.child(name).into_iter().flat_map(|n| n.children())
    }
    pub(super) fn attribute(&self, name: &str) -> Option<&'d str> {
        self.node.attribute(name)
    }
    /// The attribute, empty where it is not there.
    pub(super) fn text(&self, name: &str) -> String {
        self.attribute(name).unwrap_or_default().to_owned()
    }
    pub(super) fn required(&self, name: &str) -> Result<String, ReadError> {
        let missing = || self.error(format!("`{}`{} has no `{name}`", self.name(), self.called()));
        self.attribute(name).map(str::to_owned).ok_or_else(missing)
    }
    pub(super) fn value<T: FromStr>(&self, name: &str) -> Result<Option<T>, ReadError> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        text.trim().parse().map(Some).map_err(|_| self.misread(name, text))
    }
    pub(super) fn required_value<T: FromStr>(&self, name: &str) -> Result<T, ReadError> {
        let text = self.required(name)?;
        text.trim().parse().map_err(|_| self.misread(name, &text))
    }
    /// A Boolean attribute, false where it is not there.
    pub(super) fn flag(&self, name: &str) -> Result<bool, ReadError> {
        self.flag_or(name, false)
    }
    pub(super) fn flag_or(&self, name: &str, default: bool) -> Result<bool, ReadError> {
        self.attribute(name).map_or(Ok(default), |text| boolean(text).ok_or_else(|| self.misread(name, text)))
    }
    /// Values separated by blanks; an empty text is an empty list, an absent attribute is none.
    pub(super) fn list<T: FromStr>(&self, name: &str) -> Result<Option<Vec<T>>, ReadError> {
        self.list_with(name, |word| word.parse().ok())
    }
    fn list_with<T>(
        &self,
        name: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<Vec<T>>, ReadError> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        text.split_whitespace()
            .map(|w| parse(w).ok_or_else(|| self.misread(name, w)))
            .collect::<Result<_, _>>()
            .map(Some)
    }
    /// One of these words.
    pub(super) fn choice<T: Copy>(&self, name: &str, words: &[(&str, T)]) -> Result<Option<T>, ReadError> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        words
            .iter()
            .find(|(word, _)| *word == text.trim())
            .map(|(_, t)| Some(*t))
            .ok_or_else(|| self.misread(name, text))
    }
    /// Start values in the attribute `start`.
    pub(super) fn start(&self, kind: VariableType) -> Result<Option<StartValues>, ReadError> {
        let name = "start";
        Ok(match kind {
            VariableType::Float32 | VariableType::Float64 => self.list(name)?.map(StartValues::Real),
            VariableType::Int8
            | VariableType::Int16
            | VariableType::Int32
            | VariableType::Int64
            | VariableType::Enumeration => self.list(name)?.map(StartValues::Signed),
            VariableType::UInt8 | VariableType::UInt16 | VariableType::UInt32 | VariableType::UInt64 => {
                self.list(name)?.map(StartValues::Unsigned)
            }
            VariableType::Boolean => self.list_with(name, boolean)?.map(StartValues::Boolean),
            VariableType::String => self.attribute(name).map(|s| StartValues::Text(vec![s.to_owned()])),
            VariableType::Binary | VariableType::Clock => None,
        })
    }
    /// What variables and type definitions have in common.
    pub(super) fn attributes(&self, kind: VariableType) -> Result<Attributes, ReadError> {
        let text = |name| self.attribute(name).map(str::to_owned);
        let clock = || -> Result<ClockAttributes, ReadError> {
            Ok(ClockAttributes {
                can_be_deactivated: self.flag("canBeDeactivated")?,
                priority: self.value("priority")?,
                interval_variability: self.text("intervalVariability"),
                interval_decimal: self.value("intervalDecimal")?,
                shift_decimal: self.value("shiftDecimal")?.unwrap_or(0.0),
                supports_fraction: self.flag("supportsFraction")?,
                resolution: self.value("resolution")?,
                interval_counter: self.value("intervalCounter")?,
                shift_counter: self.value("shiftCounter")?.unwrap_or(0),
            })
        };
        Ok(Attributes {
            quantity: text("quantity"),
            unit: text("unit"),
            display_unit: text("displayUnit"),
            relative_quantity: self.flag("relativeQuantity")?,
            unbounded: self.flag("unbounded")?,
            min: self.value("min")?,
            max: self.value("max")?,
            nominal: self.value("nominal")?,
            mime_type: text("mimeType"),
            max_size: self.value("maxSize")?,
            clock: if kind == VariableType::Clock { Some(clock()?) } else { None },
        })
    }
    pub(super) fn causality(&self, version: FmiVersion) -> Result<DescriptionCausality, ReadError> {
        use DescriptionCausality as C;
        let words = [
            ("parameter", C::Parameter),
            ("calculatedParameter", C::CalculatedParameter),
            ("input", C::Input),
            ("output", C::Output),
            ("local", C::Local),
            ("independent", C::Independent),
            ("structuralParameter", C::StructuralParameter),
        ];
        let known = if version == FmiVersion::V2 { &words[..6] } else { &words[..] };
        Ok(self.choice("causality", known)?.unwrap_or(C::Local))
    }
    pub(super) fn variability(&self) -> Result<Option<DescriptionVariability>, ReadError> {
        use DescriptionVariability as V;
        let words = [
            ("constant", V::Constant),
            ("fixed", V::Fixed),
            ("tunable", V::Tunable),
            ("discrete", V::Discrete),
            ("continuous", V::Continuous),
        ];
        self.choice("variability", &words)
    }
    pub(super) fn initial(&self) -> Result<Option<Initial>, ReadError> {
        self.choice(
            "initial",
            &[("exact", Initial::Exact), ("approx", Initial::Approx), ("calculated", Initial::Calculated)],
        )
    }
    pub(super) fn items(&self) -> Result<Vec<Item>, ReadError> {
        let items = self.children().filter(|n| n.name() == "Item");
        items
            .map(|n| {
                Ok(Item {
                    name: n.required("name")?,
                    value: n.required_value("value")?,
                    description: n.text("description"),
                })
            })
            .collect()
    }
    pub(super) fn misread(&self, name: &str, text: &str) -> ReadError {
        let at = self.node.attribute_node(name).map_or(self.node.range().start, |a| a.range().start);
        self.error_at(
            at,
            format!("{name}=\"{text}\" of `{}`{} is not understood", self.name(), self.called()),
        )
    }
    fn called(&self) -> String {
        let own =
            self.attribute("name").or_else(|| self.node.parent_element().and_then(|p| p.attribute("name")));
        own.map_or_else(String::new, |n| format!(" ({n})"))
    }
}

fn boolean(text: &str) -> Option<bool> {
    match text.trim() {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}

/// Unit definitions, alike in both versions.
pub(super) fn units(root: &DescriptionNode) -> Result<Vec<DescriptionUnit>, ReadError> {
    let unit = |n: DescriptionNode| {
        let base = n.child("BaseUnit").map(|b| -> Result<BaseUnit, ReadError> {
            let mut exponents = [0; 8];
            for (slot, name) in exponents.iter_mut().zip(["kg", "m", "s", "A", "K", "mol", "cd", "rad"]) {
                *slot = b.value(name)?.unwrap_or(0);
            }
            let (factor, offset) = (b.value("factor")?.unwrap_or(1.0), b.value("offset")?.unwrap_or(0.0));
            Ok(BaseUnit { exponents, factor, offset })
        });
        let display = n.children().filter(|d| d.name() == "DisplayUnit").map(|d| {
            Ok(DisplayUnit {
                name: d.required("name")?,
                factor: d.value("factor")?.unwrap_or(1.0),
                offset: d.value("offset")?.unwrap_or(0.0),
                inverse: d.flag("inverse")?,
            })
        });
        Ok(DescriptionUnit {
            name: n.required("name")?,
            base: base.transpose()?,
            display: display.collect::<Result<_, _>>()?,
            line: n.line(),
        })
    };
    root.children_of("UnitDefinitions").filter(|n| n.name() == "Unit").map(unit).collect()
}

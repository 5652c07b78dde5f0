//! XML elements with their place.

use std::path::Path;
use std::str::FromStr;

use crate::mistake::InputMistake;
use crate::system::SourceSpan;

/// A file's text with the start of each line.
pub(super) struct SspText<'a> {
    pub(super) file: &'a Path,
    lines: Vec<usize>,
}

impl<'a> SspText<'a> {
    pub(super) fn new(file: &'a Path, text: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at + 1);
        Self { file, lines: std::iter::once(0).chain(breaks).collect() }
    }
    pub(super) fn place(&self, at: usize) -> SourceSpan {
        let line = self.lines.partition_point(|start| *start <= at) as u32;
        SourceSpan { file: self.file.into(), line }
    }
}

/// An element. Prefixes do not matter, whatever namespace they denote: the names of SSP are unique by themselves.
#[derive(Clone, Copy)]
pub(super) struct SspNode<'d> {
    pub(super) node: roxmltree::Node<'d, 'd>,
    pub(super) source: &'d SspText<'d>,
}

impl<'d> SspNode<'d> {
    pub(super) fn name(self) -> &'d str {
        self.node.tag_name().name()
    }
    pub(super) fn place(self) -> SourceSpan {
        self.source.place(self.node.range().start)
    }
    pub(super) fn wrong(self, message: impl Into<String>) -> InputMistake {
        InputMistake { place: self.place(), message: message.into() }
    }
    pub(super) fn children(self) -> impl Iterator<Item = SspNode<'d>> {
        let source = self.source;
        self.node.children().filter(roxmltree::Node::is_element).map(move |node| SspNode { node, source })
    }
    pub(super) fn child(self, name: &str) -> Option<SspNode<'d>> {
        self.children().find(|n| n.name() == name)
    }
    /// The children of the child of that name.
    pub(super) fn list(self, name: &str) -> impl Iterator<Item = SspNode<'d>> {
        self.child(name).into_iter().flat_map(SspNode::children)
    }
    pub(super) fn attribute(self, name: &str) -> Option<&'d str> {
        self.node.attribute(name)
    }
    pub(super) fn required(self, name: &str) -> Result<&'d str, InputMistake> {
        self.attribute(name).ok_or_else(|| self.wrong(format!("`{}` has no attribute `{name}`", self.name())))
    }
    pub(super) fn value<T: FromStr>(self, name: &str) -> Result<Option<T>, InputMistake> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let wrong = || self.wrong(format!("{name}=\"{text}\" of `{}` is not understood", self.name()));
        text.trim().parse().map(Some).map_err(|_| wrong())
    }
    /// A finite number.
    pub(super) fn number(self, name: &str) -> Result<Option<f64>, InputMistake> {
        match self.value::<f64>(name)? {
            Some(x) if !x.is_finite() => {
                Err(self.wrong(format!("{name} of `{}` is not finite", self.name())))
            }
            x => Ok(x),
        }
    }
    pub(super) fn flag(self, name: &str) -> Result<bool, InputMistake> {
        match self.attribute(name).map(str::trim) {
            None | Some("false" | "0") => Ok(false),
            Some("true" | "1") => Ok(true),
            Some(text) => {
                Err(self.wrong(format!("{name}=\"{text}\" of `{}` is neither true nor false", self.name())))
            }
        }
    }
}

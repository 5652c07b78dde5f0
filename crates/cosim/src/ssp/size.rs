//! How many elements a description comes to, nested ones counted as often as they are used: known before any is built.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use roxmltree::Document;

use super::files::{SspReader, described, system_by_id};
use super::xml::SspNode;
use crate::mistake::InputMistake;

/// Descriptions inside descriptions.
pub(super) const MAX_DEPTH: usize = 32;
/// Elements of a system, nested ones counted as often as they are used.
pub(super) const MAX_ELEMENTS: usize = 200_000;

#[derive(Default)]
pub(super) struct ArraySizes {
    /// Per file and place of a system its elements; `None`: it is being counted.
    systems: HashMap<(PathBuf, usize), Option<usize>>,
    /// There are too many, or a system contains itself.
    refused: bool,
}

impl SspReader {
    /// Whether what this system comes to can be built; if not, the reason is among the mistakes.
    pub(super) fn is_buildable<'d>(
        &mut self,
        system: SspNode<'d>,
        document: &'d Document<'d>,
        file: &Path,
    ) -> bool {
        let mut sizes = ArraySizes::default();
        match self.size(system, document, file, 0, &mut sizes) {
            Err(mistake) => {
                self.mistakes.push(mistake);
                false
            }
            Ok(_) => !sizes.refused,
        }
    }

    fn size<'d>(
        &mut self,
        system: SspNode<'d>,
        document: &'d Document<'d>,
        file: &Path,
        depth: usize,
        sizes: &mut ArraySizes,
    ) -> Result<usize, InputMistake> {
        let key = (file.to_owned(), system.node.range().start);
        match sizes.systems.get(&key) {
            Some(Some(known)) => return Ok(*known),
            None if depth <= MAX_DEPTH => {}
            _ => {
                sizes.refused = true;
                return Err(too_deep(system));
            }
        }
        sizes.systems.insert(key.clone(), None);
        let mut all = 0_usize;
        for child in system.list("Elements") {
            let inside = match child.name() {
                "System" => self.size(child, document, file, depth + 1, sizes)?,
                "Component" => self.component_size(child, document, file, depth + 1, sizes)?,
                _ => 0,
            };
            all = all.saturating_add(inside).saturating_add(1);
            if all > MAX_ELEMENTS {
                sizes.refused = true;
                return Err(too_many(child));
            }
        }
        sizes.systems.insert(key, Some(all));
        Ok(all)
    }

    /// Of the system that a component refers to; what cannot be read counts nothing here and is reported by the reader.
    fn component_size<'d>(
        &mut self,
        component: SspNode<'d>,
        document: &'d Document<'d>,
        file: &Path,
        depth: usize,
        sizes: &mut ArraySizes,
    ) -> Result<usize, InputMistake> {
        let Some((path, fragment)) =
            component.attribute("source").map(|s| s.split_once('#').unwrap_or((s, "")))
        else {
            return Ok(0);
        };
        if path.is_empty() {
            let inside =
                system_by_id(document, fragment).map(|node| SspNode { node, source: component.source });
            return inside.map_or(Ok(0), |system| self.size(system, document, file, depth, sizes));
        }
        let Ok(found) = self.locate(path, file) else { return Ok(0) };
        let Ok(Some(description)) = described(component, &found, fragment) else { return Ok(0) };
        let counted = self.with(&description, &component.place(), |reader, root, document| {
            root.child("System").map_or(Ok(0), |s| reader.size(s, document, &description, depth, sizes))
        });
        Ok(counted.unwrap_or(0))
    }
}

pub(super) fn too_deep(node: SspNode) -> InputMistake {
    node.wrong(format!("systems are nested more than {MAX_DEPTH} deep; does one contain itself?"))
}

fn too_many(node: SspNode) -> InputMistake {
    node.wrong(format!(
        "there are more than {MAX_ELEMENTS} elements, nested ones counted as often as they are used; use fewer references"
    ))
}

//! Classes of defaults: what an element has unless it gives it itself.

use std::collections::HashMap;

use roxmltree::Node;

use crate::robot::attributes::line;
use crate::robot::tree::FileFault;

/// Per class, with what it inherits: values by element and attribute.
pub(super) struct DefaultClasses {
    classes: HashMap<String, HashMap<(String, String), String>>,
}

/// The class of what names none.
const MAIN: &str = "main";

impl DefaultClasses {
    /// Of a model.
    pub(super) fn read(model: Node<'_, '_>) -> Result<Self, FileFault> {
        let mut all = Self { classes: HashMap::from([(MAIN.to_owned(), HashMap::new())]) };
        for section in model.children().filter(|c| c.has_tag_name("default")) {
            all.class(section, MAIN, section.attribute("class").unwrap_or(MAIN))?;
        }
        Ok(all)
    }

    fn class(&mut self, node: Node<'_, '_>, parent: &str, name: &str) -> Result<(), FileFault> {
        let mut own =
            self.classes.get(name).or_else(|| self.classes.get(parent)).cloned().unwrap_or_default();
        for element in node.children().filter(|c| c.is_element() && !c.has_tag_name("default")) {
            for attribute in element.attributes() {
                let key = (element.tag_name().name().to_owned(), attribute.name().to_owned());
                own.insert(key, attribute.value().to_owned());
            }
        }
        self.classes.insert(name.to_owned(), own);
        for inner in node.children().filter(|c| c.has_tag_name("default")) {
            let Some(inner_name) = inner.attribute("class") else {
                return Err((line(inner), "a <default> within another one has no class; give it one".into()));
            };
            self.class(inner, name, inner_name)?;
        }
        Ok(())
    }

    /// An attribute of an element, its own or by its class, else by that of the body which it is in.
    pub(super) fn of<'a>(
        &'a self,
        node: Node<'a, '_>,
        attribute: &str,
        class: Option<&str>,
    ) -> Option<&'a str> {
        if let Some(own) = node.attribute(attribute) {
            return Some(own);
        }
        let class = self.classes.get(node.attribute("class").or(class).unwrap_or(MAIN))?;
        class.get(&(node.tag_name().name().to_owned(), attribute.to_owned())).map(String::as_str)
    }
}

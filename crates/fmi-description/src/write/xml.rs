//! Elements with attributes, indented.

use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};
use quick_xml::writer::Writer;

use super::error::WriteError;

/// An XML text in the making.
pub(super) struct DescriptionXml {
    writer: Writer<Vec<u8>>,
    open: Vec<String>,
}

impl DescriptionXml {
    pub(super) fn new() -> Result<Self, WriteError> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        Ok(Self { writer, open: Vec::new() })
    }
    /// An element with content, until [`Self::close`].
    pub(super) fn open<V: AsRef<str>>(
        &mut self,
        name: &str,
        attributes: &[(&str, V)],
    ) -> Result<(), WriteError> {
        self.writer.write_event(Event::Start(start(name, attributes)))?;
        self.open.push(name.to_owned());
        Ok(())
    }
    /// An element with content and without attributes, until [`Self::close`].
    pub(super) fn group(&mut self, name: &str) -> Result<(), WriteError> {
        self.open::<&str>(name, &[])
    }
    /// Ends the innermost open element.
    pub(super) fn close(&mut self) -> Result<(), WriteError> {
        if let Some(name) = self.open.pop() {
            self.writer.write_event(Event::End(BytesEnd::new(name)))?;
        }
        Ok(())
    }
    /// An element without content.
    pub(super) fn element<V: AsRef<str>>(
        &mut self,
        name: &str,
        attributes: &[(&str, V)],
    ) -> Result<(), WriteError> {
        self.writer.write_event(Event::Empty(start(name, attributes)))?;
        Ok(())
    }
    /// The text; ends what is open.
    pub(super) fn finish(mut self) -> Result<String, WriteError> {
        while !self.open.is_empty() {
            self.close()?;
        }
        let mut bytes = self.writer.into_inner();
        bytes.push(b'\n');
        String::from_utf8(bytes).map_err(|e| WriteError::Io(std::io::Error::other(e)))
    }
}

fn start<'a, V: AsRef<str>>(name: &'a str, attributes: &'a [(&str, V)]) -> BytesStart<'a> {
    let mut element = BytesStart::new(name);
    for (key, value) in attributes {
        element.push_attribute((*key, value.as_ref()));
    }
    element
}

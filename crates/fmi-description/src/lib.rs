//! modelDescription.xml: writer, reader, checks, archives.

//! The library that becomes part of an FMU when the packer writes a configuration into its block.

use trueup_fmi::configuration::{self, BLOCK_SIZE, Configuration, ConfigurationError, MARKER, STAMP_SIZE};

use crate::macho;
use crate::platform::Platform;

/// A library that was not packed.
#[derive(Clone, Debug)]
pub struct Template {
    /// For which it is made.
    pub platform: Platform,
    /// The file.
    pub bytes: Vec<u8>,
}

/// A template that cannot become an FMU.
#[derive(Debug, thiserror::Error)]
pub enum TemplateError {
    /// The configuration does not fit into its block.
    #[error(transparent)]
    Configuration(#[from] ConfigurationError),
    /// Not exactly one configuration block.
    #[error("the template library for {0} has {1} configuration blocks instead of one: {MEND}")]
    Blocks(Platform, usize),
    /// Its tables may be others than those of the description.
    #[error("the template library for {platform} is of {library}, this program of {program}: {MEND}")]
    Stamp {
        /// For which it is made.
        platform: Platform,
        /// Its stamp.
        library: String,
        /// The program's.
        program: String,
    },
    /// Two of one platform.
    #[error("there are two template libraries for {0}: leave one")]
    Twice(Platform),
    /// A Mac would not load it.
    #[error("the template library for {0} cannot be signed again: {1}")]
    Signature(Platform, String),
}

const MEND: &str =
    "build it again, for this machine with `cargo build --release`, for others with `tools/release`";

impl Template {
    /// Whether it can become an FMU: it has one empty block, with this stamp.
    ///
    /// # Errors
    /// [`TemplateError`]
    pub fn check(&self, stamp: &str) -> Result<(), TemplateError> {
        self.block(stamp).map(|_| ())
    }

    /// With the configuration in its block, and signed again where a loader looks at signatures.
    ///
    /// # Errors
    /// [`TemplateError`]
    pub fn configured(&self, configuration: &Configuration, stamp: &str) -> Result<Vec<u8>, TemplateError> {
        let start = self.block(stamp)?;
        let mut bytes = self.bytes.clone();
        if let Some(block) = bytes[start..].first_chunk_mut::<BLOCK_SIZE>() {
            configuration.write(block)?;
        }
        if matches!(self.platform, Platform::ArmDarwin | Platform::X86Darwin) {
            macho::sign_again(&mut bytes).map_err(|why| TemplateError::Signature(self.platform, why))?;
        }
        Ok(bytes)
    }

    /// Where its block begins.
    fn block(&self, stamp: &str) -> Result<usize, TemplateError> {
        // The marker alone is also a constant of the program; a block goes on with zeros.
        let blocks: Vec<(usize, &[u8; BLOCK_SIZE])> = memchr::memmem::find_iter(&self.bytes, MARKER)
            .filter_map(|at| Some((at, self.bytes[at..].first_chunk()?)))
            .filter(is_empty)
            .collect();
        let [(start, block)] = blocks[..] else {
            return Err(TemplateError::Blocks(self.platform, blocks.len()));
        };
        let library = configuration::stamp(block);
        if library != stamp {
            let program = stamp.to_owned();
            return Err(TemplateError::Stamp { platform: self.platform, library, program });
        }
        Ok(start)
    }
}

/// Whether there is nothing between marker and stamp.
fn is_empty((_, block): &(usize, &[u8; BLOCK_SIZE])) -> bool {
    block[MARKER.len()..BLOCK_SIZE - STAMP_SIZE].iter().all(|b| *b == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn template() -> Template {
        let mut bytes = b"\x7fELF head ".to_vec();
        bytes.extend_from_slice(MARKER);
        bytes.extend_from_slice(b"a constant that happens to be there");
        bytes.extend_from_slice(&configuration::template("", "1.0-abc"));
        bytes.extend_from_slice(b" tail");
        Template { platform: Platform::X86Linux, bytes }
    }

    #[test]
    fn the_configuration_goes_into_the_one_block_and_nowhere_else() {
        let template = template();
        let c = Configuration { token: "t".to_owned(), ..Configuration::of("TwoMassJoint") };
        let packed = template.configured(&c, "1.0-abc").unwrap();
        assert_eq!(packed.len(), template.bytes.len());
        let start = packed.len() - 5 - BLOCK_SIZE;
        let end = start + BLOCK_SIZE - STAMP_SIZE;
        assert_eq!(packed[..start], template.bytes[..start]);
        assert_eq!(packed[end..], template.bytes[end..]);
        assert_eq!(Configuration::from_block(&packed[start..start + BLOCK_SIZE]), Ok(c));
    }

    #[test]
    fn a_library_without_block_or_already_packed_is_refused() {
        let c = Configuration::of("TwoMassJoint");
        let none = Template { bytes: b"no block here".to_vec(), ..template() };
        assert!(matches!(none.configured(&c, "1.0-abc"), Err(TemplateError::Blocks(_, 0))));
        let packed = Template { bytes: template().configured(&c, "1.0-abc").unwrap(), ..template() };
        assert!(matches!(packed.configured(&c, "1.0-abc"), Err(TemplateError::Blocks(_, 0))));
    }

    #[test]
    fn a_template_of_other_sources_is_refused_by_name() {
        let error = template().configured(&Configuration::of("TwoMassJoint"), "1.1-def").unwrap_err();
        let said = error.to_string();
        assert!(said.starts_with(
            "the template library for x86_64-linux is of 1.0-abc, this program of 1.1-def: build"
        ));
    }
}

//! What an FMU may change of the process that it is in: the working directory, so that names of files mean others, and
//! limits of resources, so that what comes after it fails.

use std::path::PathBuf;

/// Working directory and limits of the process as they shall stay.
#[derive(Clone, Debug)]
pub struct ProcessSurroundings {
    directory: Option<PathBuf>,
    #[cfg(target_os = "linux")]
    limits: Vec<(linux::LimitedResource, rustix::process::Rlimit)>,
}

impl ProcessSurroundings {
    /// As they are now.
    pub fn now() -> Self {
        Self {
            directory: std::env::current_dir().ok(),
            #[cfg(target_os = "linux")]
            limits: linux::limits(),
        }
    }

    /// What the FMU changed, such as "changed the working directory to /"; it is as before now, where the system
    /// permits that. `None`: nothing.
    pub fn restored(&self) -> Option<String> {
        #[cfg(target_os = "linux")]
        if let Some(name) = linux::lowered(&self.limits) {
            return Some(format!("lowered the limit of the process on {name}"));
        }
        let here = self.directory.as_ref()?;
        let there = std::env::current_dir().unwrap_or_default();
        if there == *here {
            return None;
        }
        // If it cannot go back, it is reported all the same that it left.
        let _ = std::env::set_current_dir(here);
        Some(format!("changed the working directory to {}", there.display()))
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    /// A resource and its name.
    pub(super) type LimitedResource = (Resource, &'static str);

    /// Without these a run that goes well cannot write its results. An FMU may raise them, as a virtual machine does.
    const RESOURCES: [LimitedResource; 4] = [
        (Resource::As, "memory"),
        (Resource::Data, "memory of data"),
        (Resource::Fsize, "the size of files"),
        (Resource::Nofile, "open files"),
    ];

    pub(super) fn limits() -> Vec<(LimitedResource, Rlimit)> {
        RESOURCES.into_iter().map(|r| (r, getrlimit(r.0))).collect()
    }

    /// Sets limits that are lower than these back; the first one's name.
    pub(super) fn lowered(before: &[(LimitedResource, Rlimit)]) -> Option<&'static str> {
        let value = |limit: Option<u64>| limit.unwrap_or(u64::MAX);
        let low = |r: &&(LimitedResource, Rlimit)| value(getrlimit(r.0.0).current) < value(r.1.current);
        // All are set back before anything is allocated.
        let mut first = None;
        for &((resource, name), limit) in before.iter().filter(low) {
            let highest = getrlimit(resource).maximum;
            // Only root can raise the upper limit again; others get what is left.
            if setrlimit(resource, limit).is_err() {
                let _ = setrlimit(resource, Rlimit { current: highest, maximum: highest });
            }
            first = first.or(Some(name));
        }
        first
    }
}

//! The processes below a process.

use std::fs;

use rustix::process::Pid;

/// The children of a process.
pub(crate) fn children(of: Pid) -> Vec<Pid> {
    let all = fs::read_dir("/proc").into_iter().flatten().flatten();
    let child = |entry: fs::DirEntry| {
        let id = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        // Behind the name, which may contain anything: state and parent.
        let parent = stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()?;
        (Pid::from_raw(parent) == Some(of)).then(|| Pid::from_raw(id)).flatten()
    };
    all.filter_map(child).collect()
}

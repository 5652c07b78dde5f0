//! HDF5: MAT files of level 7.3, which have a user block before it and the variables as datasets of the root group, and files of
//! other programs (h5py, PyTables), whose datasets may be in groups.

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, H5Type, Hdf5File, OpenOptions};

use super::array::{Array, Contents};

/// No compression that is read here makes more of a byte (deflate: 1032).
const EXPANDS: usize = 1032;
/// More than that no recording takes.
const LARGEST: usize = 1 << 31;

/// Groups within groups that are looked into.
const DEPTH: usize = 8;

/// All variables of a MAT file.
///
/// # Errors
/// Why it cannot be read.
pub(super) fn read(bytes: Vec<u8>) -> Result<Contents, Error> {
    let (root, mut left) = root(bytes)?;
    let mut contents = Contents::default();
    // MATLAB keeps what its own variables refer to in groups of such names.
    let (groups, _) = root.member_names()?;
    groups.iter().filter(|name| !name.starts_with('#')).for_each(|name| contents.skip(&format!("`{name}`")));
    datasets(&root, "", &mut left, &mut contents)?;
    Ok(contents)
}

/// All datasets of a file of another program, by their paths (`joints/position`).
///
/// # Errors
/// Why it cannot be read.
pub(super) fn read_paths(bytes: Vec<u8>) -> Result<Contents, Error> {
    let (root, mut left) = root(bytes)?;
    let mut contents = Contents::default();
    let mut open = vec![(root, String::new(), 0)];
    while let Some((group, path, depth)) = open.pop() {
        datasets(&group, &path, &mut left, &mut contents)?;
        for name in group.member_names()?.0 {
            // A group may be a member of itself.
            match depth < DEPTH {
                true => open.push((group.group(&name)?, format!("{path}{name}/"), depth + 1)),
                false => {
                    contents.skipped.push(format!("the group `{path}{name}` is too deep and is left out"))
                }
            }
        }
    }
    Ok(contents)
}

/// The root group, and how many bytes may be made of the file.
fn root(bytes: Vec<u8>) -> Result<(Group, usize), Error> {
    // What is made of a damaged file stays in proportion to it.
    let left = bytes.len().saturating_mul(EXPANDS).min(LARGEST);
    let options = OpenOptions { max_read_bytes: left, max_chunk_bytes: left, ..OpenOptions::default() };
    Ok((Hdf5File::from_vec_with_options(bytes, options)?.root_group()?, left))
}

/// The datasets of a group, `path` before their names.
fn datasets(group: &Group, path: &str, left: &mut usize, contents: &mut Contents) -> Result<(), Error> {
    for name in group.member_names()?.1 {
        match one(group, &name, left)? {
            Some(array) => contents.arrays.push(Array { name: format!("{path}{name}"), ..array }),
            None => contents.skip(&format!("`{path}{name}`")),
        }
    }
    Ok(())
}

/// A variable; `None` if it is no array of numbers.
fn one(root: &Group, name: &str, left: &mut usize) -> Result<Option<Array>, Error> {
    let dataset = root.dataset(name)?;
    let class = dataset.attribute("MATLAB_class").and_then(|a| a.read_string()).ok();
    let class = class.as_deref().map(|c| c.trim_end_matches('\0'));
    let empty = dataset.attribute("MATLAB_empty").is_ok();
    if empty || matches!(class, Some("char" | "cell" | "struct" | "function_handle")) {
        return Ok(None);
    }
    let bytes = dataset.num_elements()?.saturating_mul(8);
    *left = usize::try_from(bytes).ok().and_then(|bytes| left.checked_sub(bytes)).ok_or_else(|| {
        Error::ResourceLimit(format!("its variables up to `{name}` take more than there can be in the file"))
    })?;
    let Some(values) = numbers(&dataset)? else { return Ok(None) };
    let shape: Vec<usize> = dataset.shape().iter().filter_map(|n| usize::try_from(*n).ok()).collect();
    // MATLAB's columns are rows to HDF5; other programs write rows as rows.
    let (size, values) = match (class, &shape[..]) {
        (_, []) => (vec![1, 1], values),
        (_, [n]) => (vec![*n, 1], values),
        (Some(_), _) => (shape.iter().rev().copied().collect(), values),
        (None, [rows, columns]) => {
            let column = |k: usize| values.iter().skip(k).step_by((*columns).max(1));
            (vec![*rows, *columns], (0..*columns).flat_map(column).copied().collect())
        }
        (None, _) => (shape, values),
    };
    Ok(Some(Array { name: name.to_owned(), size, values }))
}

/// Numbers of any type; `None` if it has others.
fn numbers(dataset: &Dataset) -> Result<Option<Vec<f64>>, Error> {
    fn read<T: H5Type>(dataset: &Dataset, number: impl Fn(T) -> f64) -> Result<Option<Vec<f64>>, Error> {
        Ok(Some(dataset.read_array::<T>()?.into_iter().map(number).collect()))
    }
    // h5py's Booleans.
    let kind = match dataset.dtype() {
        Datatype::Enum { base, members } if members.len() == 2 => base.as_ref(),
        other => other,
    };
    match kind {
        Datatype::FloatingPoint { size: 8, .. } => read::<f64>(dataset, |x| x),
        Datatype::FloatingPoint { size: 4, .. } => read::<f32>(dataset, f64::from),
        Datatype::FixedPoint { size: 1, signed: true, .. } => read::<i8>(dataset, f64::from),
        Datatype::FixedPoint { size: 1, .. } => read::<u8>(dataset, f64::from),
        Datatype::FixedPoint { size: 2, signed: true, .. } => read::<i16>(dataset, f64::from),
        Datatype::FixedPoint { size: 2, .. } => read::<u16>(dataset, f64::from),
        Datatype::FixedPoint { size: 4, signed: true, .. } => read::<i32>(dataset, f64::from),
        Datatype::FixedPoint { size: 4, .. } => read::<u32>(dataset, f64::from),
        Datatype::FixedPoint { size: 8, signed: true, .. } => read::<i64>(dataset, |x| x as f64),
        Datatype::FixedPoint { size: 8, .. } => read::<u64>(dataset, |x| x as f64),
        _ => Ok(None),
    }
}

//! A model's equations are compiled in `models` alone: the symbols of the built libraries show what the sources may hide, such as
//! an object that is made of a generic model elsewhere, which compiles all of its methods there.

use super::{Complaints, found, none};
use object::read::archive::ArchiveFile;
use object::{Object, ObjectSymbol, SymbolKind};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Functions of models that a library may have at most. What the compiler inlines changes with its version, so this is a bound and
/// not a list. Of rustc 1.95 diagnosis has 3 (constructors for the strings of a case), flexibility 8 (constructors; the
/// control law with one derivative, compiled in models since), all others 0. An object that is made of a generic model has 28 methods and what they call; with two of them
/// diagnosis had 118, with a mass matrix at two scalars of its own flexibility had 117.
const AT_MOST: usize = 12;

/// Whether a mangled name is that of a function of models, except what frees, copies, prints or converts a value.
fn computes(name: &str) -> bool {
    let of_models = name.contains("13trueup_models") || name.contains("_$LT$trueup_models..");
    // Products of vectors of three are no equations; of a crate that is not optimized they are not inlined.
    let other =
        ["drop_in_place", "$u20$as$u20$core..", "$u20$as$u20$alloc..", "13trueup_models5space6vector"];
    of_models && !other.iter().any(|o| name.contains(o))
}

/// Functions that are defined in the objects of a library.
fn functions(library: &[u8]) -> Result<Vec<String>, object::Error> {
    let mut names = Vec::new();
    for member in ArchiveFile::parse(library)?.members() {
        // Metadata is a member, too, and no code.
        let Ok(object) = object::File::parse(member?.data(library)?) else { continue };
        let texts = object.symbols().filter(|s| s.is_definition() && s.kind() == SymbolKind::Text);
        names.extend(texts.filter_map(|s| s.name().ok().map(str::to_owned)));
    }
    Ok(names)
}

/// When a file was written.
fn written(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|m| m.modified()).ok()
}

/// The newest library of each crate of ours next to this test, by the crate's name; none: this is not a release build.
fn libraries() -> BTreeMap<String, PathBuf> {
    let mut all: BTreeMap<String, PathBuf> = BTreeMap::new();
    if cfg!(debug_assertions) {
        return all;
    }
    let test = std::env::current_exe().expect("the test's path");
    let folder = test.parent().expect("its folder");
    for path in fs::read_dir(folder).expect("a readable folder").map(|e| e.expect("an entry").path()) {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let own = file.strip_prefix("libtrueup_").and_then(|f| f.strip_suffix(".rlib"));
        let Some((name, _)) = own.and_then(|f| f.rsplit_once('-')) else { continue };
        if all.get(name).is_none_or(|kept| written(kept) < written(&path)) {
            all.insert(name.to_owned(), path);
        }
    }
    all
}

fn again(library: &str, names: &[String]) -> Complaints {
    let own: Vec<&String> = names.iter().filter(|n| computes(n)).collect();
    if own.len() <= AT_MOST {
        return Vec::new();
    }
    let some: Vec<&str> = own.iter().take(5).map(|n| n.as_str()).collect();
    vec![format!(
        "trueup-{library}: compiles {} functions of models again, at most {AT_MOST} are allowed, among them {}; take `&dyn Plant` \
         from a function of models that is neither generic nor inlined (`Compiled::plant`, `ArmScalar`, `RobotScalar`)",
        own.len(),
        some.join(", ")
    )]
}

#[test]
fn no_library_has_equations_of_a_model_but_models() {
    let mut libraries = libraries();
    let Some(models) = libraries.remove("models") else {
        eprintln!("skipped: no release build of the libraries is next to this test");
        return;
    };
    // Others are compiled from this on, perhaps before the library is written.
    let declared = written(&models.with_extension("rmeta"));
    let mut complaints = Vec::new();
    for (name, path) in &libraries {
        let bytes = fs::read(path).expect("a readable library");
        let own = again(name, &functions(&bytes).expect("an archive of objects"));
        if !own.is_empty() && written(path) < declared {
            eprintln!("skipped: trueup-{name} is older than models; build the workspace");
        } else {
            complaints.extend(own);
        }
    }
    none(complaints);
}

/// The names that are looked for are those of this compiler: models has them.
#[test]
fn functions_of_models_are_found_in_models() {
    let Some(path) = libraries().remove("models") else {
        eprintln!("skipped: no release build of models is next to this test");
        return;
    };
    let names = functions(&fs::read(path).expect("a readable library")).expect("an archive of objects");
    let of = |what: &str| names.iter().filter(|n| computes(n) && n.contains(what)).count();
    for what in ["PlanarManipulator", "TwoMassJoint", "rates_lanes", "mass_matrix"] {
        assert!(
            of(what) > 0,
            "no function of models has {what} in its name: are names mangled in another way?"
        );
    }
    let mut some: Vec<String> = names.into_iter().filter(|n| computes(n)).take(AT_MOST + 1).collect();
    found(&again("some", &some), &["trueup-some", "Compiled::plant", &some[0]]);
    some[0] = "_ZN4core3ptr49drop_in_place$LT$trueup_models..joint..TwoMassJoint$GT$".into();
    assert!(again("some", &some).is_empty());
}

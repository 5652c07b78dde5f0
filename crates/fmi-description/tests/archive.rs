//! Packed and opened again; archives that would do harm are refused.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;
use std::io::Write;
use std::path::Path;

use trueup_fmi::configuration::{BLOCK_SIZE, Configuration, MARKER};
use trueup_fmi_description::Version;
use trueup_fmi_description::archive::{Archive, ArchiveError};
use trueup_fmi_description::pack::{Parts, Reference, archive, write_file};
use zip::write::{SimpleFileOptions, ZipWriter};

fn packed(version: Version) -> Vec<u8> {
    let mut library = MARKER.to_vec();
    library.resize(BLOCK_SIZE, 0);
    archive(&Parts {
        table: &common::table(),
        configuration: &Configuration::of("Sample"),
        version,
        library: &library,
        equations: "<p>x</p>",
        picture: "<?xml version=\"1.0\"?><svg/>",
        modelica: Some("within;"),
        icon_svg: "<svg/>",
        icon_png: b"png",
        licences: &[("LICENSE-MIT.txt", "text")],
        reference: Some(Reference { inputs: "time,u\n0,1\n", outputs: "time,y\n0,1\n" }),
    })
    .unwrap()
}

#[test]
fn an_fmu_has_its_files_and_its_token() {
    let dir = tempfile::tempdir().unwrap();
    for version in Version::ALL {
        let path = dir.path().join("Sample.fmu");
        write_file(&path, &packed(version)).unwrap();
        let mut fmu = Archive::open(&path).unwrap();
        let library = format!("binaries/{}/Sample{}", version.platform(), std::env::consts::DLL_SUFFIX);
        let icon =
            if version == Version::V2 { "model.png" } else { "terminalsAndIcons/terminalsAndIcons.xml" };
        for name in [
            "modelDescription.xml",
            &library,
            icon,
            "documentation/index.html",
            "documentation/Trueup.mo",
            "documentation/Sample_ref.csv",
            "documentation/licenses/license.txt",
            "documentation/licenses/LICENSE-MIT.txt",
            "resources/configuration.txt",
        ] {
            assert!(fmu.has(name), "{name}");
        }
        let description = trueup_fmi_description::read::read(&fmu.description().unwrap()).unwrap();
        let block = fmu.read(&library, 1 << 20).unwrap();
        assert_eq!(Configuration::from_block(&block).unwrap().token, description.token);
        let page = String::from_utf8(fmu.read("documentation/index.html", 1 << 20).unwrap()).unwrap();
        assert!(page.contains("Two masses &amp; a &lt;spring&gt;") && !page.contains("<?xml"));
        fmu.extract(&dir.path().join("out")).unwrap();
        assert!(dir.path().join("out").join(&library).is_file());
        // The unpacked folder is as good as the file.
        assert!(Archive::open(&dir.path().join("out")).unwrap().has(&library));
    }
}

#[test]
fn packing_twice_gives_the_same_bytes() {
    for version in Version::ALL {
        assert!(packed(version) == packed(version));
    }
}

fn zip(path: &Path, entries: &[(&str, &[u8])]) {
    let mut zip = ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

#[test]
fn entries_that_leave_the_folder_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.fmu");
    for name in [
        "../out",
        "a/../../out",
        "/etc/out",
        "..\\out",
        "a\\..\\..\\out",
        "C:\\out",
        "C:/out",
        "\\\\host\\out",
    ] {
        zip(&path, &[(name, b"x")]);
        let error = Archive::open(&path).unwrap_err();
        assert!(matches!(&error, ArchiveError::Entry { .. }), "{name}: {error}");
    }
    let mut link = ZipWriter::new(std::fs::File::create(&path).unwrap());
    link.add_symlink("resources", "/etc", SimpleFileOptions::default()).unwrap();
    link.finish().unwrap();
    assert!(matches!(Archive::open(&path), Err(ArchiveError::Entry { .. })));
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn limits_hold_where_the_directory_lies() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bomb.fmu");
    zip(&path, &[("modelDescription.xml", &vec![b' '; 1 << 20])]);
    let mut fmu = Archive::open(&path).unwrap();
    assert!(matches!(fmu.read("modelDescription.xml", 1 << 10), Err(ArchiveError::Limit { .. })));
    assert!(matches!(fmu.read("nothing", 1), Err(ArchiveError::Missing { .. })));
}

#[test]
fn what_is_no_archive_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("text.fmu");
    std::fs::write(&path, "text").unwrap();
    assert!(matches!(Archive::open(&path), Err(ArchiveError::Zip { .. })));
    assert!(matches!(Archive::open(&dir.path().join("none.fmu")), Err(ArchiveError::Nothing { .. })));
    // Cut off anywhere, or with one byte turned: an error or a reading, never a panic.
    let whole = packed(Version::V3);
    for cut in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..cut]).unwrap();
        assert!(Archive::open(&path).is_err());
        let mut turned = whole.clone();
        turned[cut] ^= 0x55;
        std::fs::write(&path, &turned).unwrap();
        if let Ok(mut fmu) = Archive::open(&path) {
            let _ = trueup_fmi_description::check::archive(&mut fmu);
            let _ = fmu.extract(&dir.path().join("out"));
        }
    }
}

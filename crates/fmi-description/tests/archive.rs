//! Packed and opened again; archives that would do harm are refused.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;
use std::io::Write;
use std::path::Path;

use trueup_fmi::configuration::{self, Configuration};
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::archive::{Archive, ArchiveError};
use trueup_fmi_description::pack::{FmuParts, PackError, ReferenceResults, archive, write_file};
use trueup_fmi_description::platform::Platform;
use trueup_fmi_description::template::{Template, TemplateError};
use zip::write::{SimpleFileOptions, ZipWriter};

fn packed(version: FmiVersion, platforms: &[Platform]) -> Result<Vec<u8>, PackError> {
    let template = |platform: &Platform| Template {
        platform: *platform,
        bytes: configuration::template("", "s").to_vec(),
    };
    archive(&FmuParts {
        table: &common::table(),
        configuration: &Configuration::of("Sample"),
        version,
        templates: &platforms.iter().map(template).collect::<Vec<_>>(),
        stamp: "s",
        equations: "<p>x</p>",
        picture: "<?xml version=\"1.0\"?><svg/>",
        modelica: Some("within;"),
        icon_svg: "<svg/>",
        icon_png: b"png",
        licences: &[("LICENSE-MIT.txt", "text")],
        reference: Some(ReferenceResults { inputs: "time,u\n0,1\n", outputs: "time,y\n0,1\n" }),
    })
}

#[test]
fn an_fmu_has_its_files_and_its_token() {
    let dir = tempfile::tempdir().unwrap();
    for version in FmiVersion::ALL {
        let path = dir.path().join("Sample.fmu");
        let platforms = [Platform::X86Windows, Platform::X86Linux];
        write_file(&path, &packed(version, &platforms).unwrap()).unwrap();
        let mut fmu = Archive::open(&path).unwrap();
        let library = format!("binaries/{}/Sample.so", Platform::X86Linux.folder(version));
        let windows = format!("binaries/{}/Sample.dll", Platform::X86Windows.folder(version));
        let icon =
            if version == FmiVersion::V2 { "model.png" } else { "terminalsAndIcons/terminalsAndIcons.xml" };
        for name in [
            "modelDescription.xml",
            &library,
            &windows,
            icon,
            "documentation/index.html",
            "documentation/Trueup.mo",
            "documentation/Sample_ref.csv",
            "documentation/Sample_in.csv",
            "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml",
            "extra/org.fmi-standard.fmi-ls-ref/default.exp",
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
    for version in FmiVersion::ALL {
        let once = || packed(version, &[Platform::X86Linux]).unwrap();
        assert!(once() == once());
    }
}

#[test]
fn two_templates_of_one_platform_are_refused() {
    let error =
        packed(FmiVersion::V3, &[Platform::ArmLinux, Platform::X86Linux, Platform::ArmLinux]).unwrap_err();
    assert!(matches!(error, PackError::Template(TemplateError::Twice(Platform::ArmLinux))), "{error}");
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
    let whole = packed(FmiVersion::V3, &[Platform::X86Linux]).unwrap();
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

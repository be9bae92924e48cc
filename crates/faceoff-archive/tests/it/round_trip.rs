use super::*;
use faceoff_archive::{ArchiveError, check, unpack};
use std::{fs, process::Command};

#[test]
fn what_is_packed_is_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, manifest) = honest(folder.path());
    assert_eq!(check(&archive).unwrap(), manifest);
    let into = folder.path().join("into");
    fs::create_dir(&into).unwrap();
    assert_eq!(unpack(&archive, &into).unwrap(), manifest);
    for (path, content) in contents() {
        assert_eq!(fs::read(into.join(path)).unwrap(), content, "{path}");
    }
    let again = unpack(&archive, &into).unwrap_err();
    assert!(
        matches!(again, ArchiveError::Io(_)),
        "nothing is overwritten: {again}"
    );
}

#[test]
fn tar_reads_it_too() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, manifest) = honest(folder.path());
    // Not every host has zstd for its tar: the frame is taken off here, the rest is tar's.
    let plain = folder.path().join("season.tar");
    fs::write(
        &plain,
        zstd::decode_all(fs::File::open(&archive).unwrap()).unwrap(),
    )
    .unwrap();
    let listed = Command::new("tar").arg("-tf").arg(&plain).output().unwrap();
    assert!(listed.status.success(), "{listed:?}");
    let listed = String::from_utf8(listed.stdout).unwrap();
    let named = manifest.files.iter().map(|file| file.path.as_str());
    let expected: Vec<&str> = std::iter::once("manifest.json").chain(named).collect();
    assert_eq!(listed.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn a_file_that_changes_under_the_pen_spoils_the_archive() {
    for content in [&b"shorter"[..], b"another content", b"the content and more"] {
        let manifest = manifest(vec![entry("a", b"the content")]);
        let mut writer = Writer::begin(Vec::new(), &manifest).unwrap();
        let error = writer.next(|_| Ok(content)).unwrap_err();
        assert!(
            error.to_string().contains("a is not what it was"),
            "{error}"
        );
    }
}

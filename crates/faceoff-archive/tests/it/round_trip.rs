//! Writing and reading of valid archives.

use super::*;
use faceoff_archive::{ArchiveError, check, unpack};
use std::{fs, process::Command};

#[test]
fn archive_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, manifest) = valid_archive(folder.path());
    assert_eq!(check(&archive).unwrap(), manifest);
    let target = folder.path().join("unpacked");
    fs::create_dir(&target).unwrap();
    assert_eq!(unpack(&archive, &target).unwrap(), manifest);
    for (path, content) in contents() {
        assert_eq!(fs::read(target.join(path)).unwrap(), content, "{path}");
    }
    let error = unpack(&archive, &target).unwrap_err();
    assert!(
        matches!(error, ArchiveError::Io(_)),
        "nothing is overwritten: {error}"
    );
}

#[test]
fn tar_command_lists_archive() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, manifest) = valid_archive(folder.path());
    // Decompressed here, since not all hosts have zstd for tar.
    let plain = folder.path().join("season.tar");
    fs::write(
        &plain,
        zstd::decode_all(fs::File::open(&archive).unwrap()).unwrap(),
    )
    .unwrap();
    let listed = Command::new("tar").arg("-tf").arg(&plain).output().unwrap();
    assert!(listed.status.success(), "{listed:?}");
    let listed = String::from_utf8(listed.stdout).unwrap();
    let paths = manifest.files.iter().map(|file| file.path.as_str());
    let expected: Vec<&str> = std::iter::once("manifest.json").chain(paths).collect();
    assert_eq!(listed.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn changed_file_fails_writer() {
    for content in [&b"shorter"[..], b"another content", b"the content and more"] {
        let manifest = manifest(vec![entry("a", b"the content")]);
        let mut writer = Writer::begin(Vec::new(), &manifest).unwrap();
        let error = writer.next(|_| Ok(content)).unwrap_err();
        assert!(
            error.to_string().contains("a differs from the manifest"),
            "{error}"
        );
    }
}

//! Refusal of hostile and damaged archives.

use super::*;
use faceoff_archive::{ArchiveError, check, unpack};
use std::{fs, io::Write};
use tar::{EntryType, Header};

/// A tar entry without validation of its path.
struct RawEntry {
    kind: EntryType,
    path: &'static str,
    link: &'static str,
    content: Vec<u8>,
}

/// The entry of a regular file.
fn file(path: &'static str, content: &[u8]) -> RawEntry {
    RawEntry {
        kind: EntryType::Regular,
        path,
        link: "",
        content: content.to_vec(),
    }
}

/// A compressed archive of a manifest and these entries, which need not match it.
fn pack(manifest: &[u8], entries: &[RawEntry]) -> Vec<u8> {
    let mut tar = tar::Builder::new(Vec::new());
    let mut add = |raw: &RawEntry| {
        let mut header = Header::new_ustar();
        header.as_old_mut().name[..raw.path.len()].copy_from_slice(raw.path.as_bytes());
        header.as_old_mut().linkname[..raw.link.len()].copy_from_slice(raw.link.as_bytes());
        header.set_entry_type(raw.kind);
        header.set_size(raw.content.len() as u64);
        header.set_mode(0o644);
        header.set_cksum();
        tar.append(&header, raw.content.as_slice()).unwrap();
    };
    add(&file("manifest.json", manifest));
    entries.iter().for_each(add);
    zstd::encode_all(tar.into_inner().unwrap().as_slice(), 3).unwrap()
}

/// Words that every error message contains.
const ANY_REASON: &str = "";

fn json(manifest: &Manifest) -> Vec<u8> {
    serde_json::to_vec(manifest).unwrap()
}

/// Asserts that `check` and `unpack` refuse the archive with these words and write nothing outside of the folder.
#[track_caller]
fn assert_refused(archive: &[u8], words: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hostile.tar.zst");
    fs::write(&file, archive).unwrap();
    let target = folder.path().join("a/b");
    fs::create_dir_all(&target).unwrap();
    for error in [
        check(&file).unwrap_err(),
        unpack(&file, &target).unwrap_err(),
    ] {
        assert!(!matches!(error, ArchiveError::Io(_)), "{error}");
        let message = error.to_string();
        assert!(message.contains(words), "{words:?} is not in {message:?}");
    }
    // The archive and `a`.
    let items: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(items.len(), 2, "{items:?}");
    assert_eq!(fs::read_dir(folder.path().join("a")).unwrap().count(), 1);
}

#[test]
fn paths_that_are_not_plain_or_lead_outside_are_refused() {
    for path in ["../out", "/tmp/out", "a/../../out", "results/./x", "a//b"] {
        let manifest_json = json(&manifest(vec![entry(path, b"x")]));
        assert_refused(&pack(&manifest_json, &[file(path, b"x")]), "names the file");
    }
    // The manifest is valid, the archive is not.
    let valid = json(&manifest(vec![entry("out", b"x")]));
    assert_refused(&pack(&valid, &[file("../out", b"x")]), "does not name");
}

#[test]
fn entries_other_than_files_are_refused() {
    let manifest_json = json(&manifest(vec![entry("a", b""), entry("a/b", b"x")]));
    for (kind, words) in [
        (EntryType::Symlink, "is a link"),
        (EntryType::Link, "is a link"),
        (EntryType::Directory, "is a folder"),
        (EntryType::Char, "is a device"),
        (EntryType::Fifo, "is a named pipe"),
        (EntryType::GNUSparse, "is a sparse file"),
        (EntryType::GNULongName, "is of an unknown kind"),
        (EntryType::XHeader, "is of an unknown kind"),
    ] {
        let raw = RawEntry {
            kind,
            path: "a",
            link: "/etc",
            content: Vec::new(),
        };
        assert_refused(&pack(&manifest_json, &[raw, file("a/b", b"x")]), words);
    }
}

#[test]
fn difference_from_manifest_is_refused() {
    let manifest_json = json(&manifest(vec![entry("a", b"one"), entry("b", b"two")]));
    let (file_a, file_b) = (|| file("a", b"one"), || file("b", b"two"));
    assert_refused(
        &pack(&manifest_json, &[file_a(), file("b", b"owt")]),
        "has the hash",
    );
    assert_refused(
        &pack(&manifest_json, &[file_a(), file("b", b"more")]),
        "has 4 bytes",
    );
    assert_refused(
        &pack(&manifest_json, &[file_a()]),
        "ends before 1 of its files, \"b\"",
    );
    assert_refused(
        &pack(&manifest_json, &[file_a(), file_b(), file("c", b"")]),
        "does not name",
    );
    assert_refused(
        &pack(&manifest_json, &[file_a(), file_a(), file_b()]),
        "or contains it twice",
    );

    let twice = json(&manifest(vec![entry("a", b"one"), entry("a", b"one")]));
    assert_refused(&pack(&twice, &[file_a()]), "twice");
    let mut unhashed = manifest(vec![entry("a", b"one")]);
    unhashed.files[0].blake3 = "00".into();
    assert_refused(
        &pack(&json(&unhashed), &[file_a()]),
        "64 hexadecimal digits",
    );
    assert_refused(&pack(b"{}", &[]), "missing field `format`");
    assert_refused(&pack(b"no JSON", &[]), "not the manifest");
}

#[test]
fn later_format_is_reported() {
    let later = br#"{"format":2,"program":"faceoff 9.0.0","layout":"unheard of"}"#;
    assert_refused(&pack(later, &[]), "format 2 (made by \"faceoff 9.0.0\")");
}

#[test]
fn truncated_or_damaged_archive_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, _) = valid_archive(folder.path());
    let whole = fs::read(&archive).unwrap();
    for length in [8, 100, whole.len() / 2, whole.len() - 5, whole.len() - 1] {
        assert_refused(&whole[..length], ANY_REASON);
    }
    assert_refused(&[], "expected a .tar.zst");
    assert_refused(b"PK\x03\x04 a zip", "expected a .tar.zst");
    let mut damaged = whole.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x10;
    assert_refused(&damaged, ANY_REASON);
}

#[test]
fn archive_bomb_is_not_unpacked() {
    // The manifest of the first archive states a length that is impossible for the packed length.
    let zeros = vec![0; 1 << 20];
    let mut large = entry("zeros", &zeros);
    large.bytes = 1 << 40;
    let manifest_json = json(&manifest(vec![large]));
    assert_refused(
        &pack(&manifest_json, &[file("zeros", &zeros)]),
        "too many for an archive",
    );

    // The second archive continues with 512 MiB of zeros after the files of its manifest.
    let manifest_json = json(&manifest(vec![entry("a", b"x")]));
    let mut tar = zstd::decode_all(pack(&manifest_json, &[file("a", b"x")]).as_slice()).unwrap();
    tar.resize(tar.len() + (512 << 20), 0);
    let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
    encoder.write_all(&tar).unwrap();
    assert_refused(&encoder.finish().unwrap(), "longer than its manifest says");

    // The manifest is one byte too long.
    let long = vec![b' '; (64 << 20) + 1];
    assert_refused(&pack(&long, &[]), "at most 67108864 are allowed");
}

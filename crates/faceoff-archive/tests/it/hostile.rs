//! What somebody could send in place of an archive.

use super::*;
use faceoff_archive::{ArchiveError, check, unpack};
use std::{fs, io::Write};
use tar::{EntryType, Header};

/// One entry as it comes: its name is not looked at by the library.
struct Raw {
    kind: EntryType,
    path: &'static str,
    link: &'static str,
    content: Vec<u8>,
}

fn file(path: &'static str, content: &[u8]) -> Raw {
    Raw {
        kind: EntryType::Regular,
        path,
        link: "",
        content: content.to_vec(),
    }
}

fn packed(manifest: &[u8], entries: &[Raw]) -> Vec<u8> {
    let mut tar = tar::Builder::new(Vec::new());
    let mut add = |raw: &Raw| {
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

fn json(manifest: &Manifest) -> Vec<u8> {
    serde_json::to_vec(manifest).unwrap()
}

/// Both ways of reading refuse it, with these words, and nothing lies outside of the folder afterwards.
#[track_caller]
fn refused(archive: &[u8], words: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hostile.tar.zst");
    fs::write(&file, archive).unwrap();
    let into = folder.path().join("a/b");
    fs::create_dir_all(&into).unwrap();
    for error in [check(&file).unwrap_err(), unpack(&file, &into).unwrap_err()] {
        assert!(!matches!(error, ArchiveError::Io(_)), "{error}");
        let told = error.to_string();
        assert!(told.contains(words), "{words:?} is not in {told:?}");
    }
    let beside: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(beside.len(), 2, "{beside:?}");
    assert_eq!(fs::read_dir(folder.path().join("a")).unwrap().count(), 1);
}

#[test]
fn paths_that_lead_elsewhere_are_refused() {
    for path in ["../out", "/tmp/out", "a/../../out", "results/./x", "a//b"] {
        let named = json(&manifest(vec![entry(path, b"x")]));
        refused(&packed(&named, &[file(path, b"x")]), "names the file");
    }
    // The manifest is clean, the archive is not.
    let clean = json(&manifest(vec![entry("out", b"x")]));
    refused(&packed(&clean, &[file("../out", b"x")]), "does not name");
}

#[test]
fn only_files_are_taken() {
    let named = json(&manifest(vec![entry("a", b""), entry("a/b", b"x")]));
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
        let raw = Raw {
            kind,
            path: "a",
            link: "/etc",
            content: Vec::new(),
        };
        refused(&packed(&named, &[raw, file("a/b", b"x")]), words);
    }
}

#[test]
fn what_is_not_as_the_manifest_says_is_refused() {
    let named = json(&manifest(vec![entry("a", b"one"), entry("b", b"two")]));
    let (a, b) = (|| file("a", b"one"), || file("b", b"two"));
    refused(&packed(&named, &[a(), file("b", b"owt")]), "has the hash");
    refused(&packed(&named, &[a(), file("b", b"more")]), "has 4 bytes");
    refused(&packed(&named, &[a()]), "ends before 1 of its files, \"b\"");
    refused(
        &packed(&named, &[a(), b(), file("c", b"")]),
        "does not name",
    );
    refused(&packed(&named, &[a(), a(), b()]), "or a second time");

    let twice = json(&manifest(vec![entry("a", b"one"), entry("a", b"one")]));
    refused(&packed(&twice, &[a()]), "twice");
    let mut unhashed = manifest(vec![entry("a", b"one")]);
    unhashed.files[0].blake3 = "00".into();
    refused(&packed(&json(&unhashed), &[a()]), "64 hexadecimal digits");
    refused(&packed(b"{}", &[]), "missing field `format`");
    refused(&packed(b"no JSON", &[]), "not the manifest");
}

#[test]
fn a_later_format_is_named() {
    let later = br#"{"format":2,"program":"faceoff 9.0.0","layout":"unheard of"}"#;
    refused(&packed(later, &[]), "format 2 (made by \"faceoff 9.0.0\")");
}

#[test]
fn an_archive_that_was_cut_off_is_refused_wherever_that_is() {
    let folder = tempfile::tempdir().unwrap();
    let (archive, _) = honest(folder.path());
    let whole = fs::read(&archive).unwrap();
    for kept in [8, 100, whole.len() / 2, whole.len() - 5, whole.len() - 1] {
        refused(&whole[..kept], "");
    }
    refused(&[], "expected a .tar.zst");
    refused(b"PK\x03\x04 a zip", "expected a .tar.zst");
    let mut turned = whole.clone();
    let middle = turned.len() / 2;
    turned[middle] ^= 0x10;
    refused(&turned, "");
}

#[test]
fn a_bomb_is_not_unpacked() {
    // It says how large it is: what it is made of does not explain that.
    let zeros = vec![0; 1 << 20];
    let mut large = entry("zeros", &zeros);
    large.bytes = 1 << 40;
    let named = json(&manifest(vec![large]));
    refused(
        &packed(&named, &[file("zeros", &zeros)]),
        "does not explain",
    );

    // It does not: it is read no further than it says.
    let named = json(&manifest(vec![entry("a", b"x")]));
    let mut behind = zstd::decode_all(packed(&named, &[file("a", b"x")]).as_slice()).unwrap();
    behind.resize(behind.len() + (512 << 20), 0);
    let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
    encoder.write_all(&behind).unwrap();
    refused(&encoder.finish().unwrap(), "longer than its manifest tells");

    // A manifest without end.
    let long = vec![b' '; (64 << 20) + 1];
    refused(&packed(&long, &[]), "at most 67108864 are allowed");
}

//! Fuzz test of bundles: each archive is unpacked inside of its folder, or refused as invalid.

use super::{assert_outcomes, fuzz, mutation::mutate, rng::Rng};
use crate::archives::{MANIFEST, Tar, write};
use faceoff_runner::bundle::{BundleError, BundleLimits, unpack};
use flate2::{Compression, write::GzEncoder};
use std::{
    fs,
    io::{Cursor, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};
use tar::EntryType;
use zip::{ZipWriter, write::SimpleFileOptions};

/// Limits that mutations exceed often.
const LIMITS: BundleLimits = BundleLimits {
    packed_bytes: 4000,
    unpacked_bytes: 20_000,
    files: 12,
    unpack_s: 600,
};

/// Names of entries, valid and malicious.
const NAMES: [&str; 22] = [
    "agent.toml",
    "agent.py",
    "./agent.py",
    "top/agent.toml",
    "top/agent.py",
    "weights/w.bin",
    "weights",
    "weights/",
    "",
    ".",
    "/etc/passwd",
    "../x",
    "a/../../x",
    "a//b",
    "agent.toml/x",
    "link",
    "link/x",
    "deep/up",
    "\u{202e}x",
    "x\\y",
    "a/b/c/d/e/f/g/h/i/j/k/l/m/n",
    "\u{1b}[2J",
];

/// Targets of links, inside and outside of the bundle.
const TARGETS: [&str; 12] = [
    "agent.py",
    "..",
    "../..",
    "/etc/passwd",
    "link",
    "deep/up/../x",
    "weights",
    ".",
    "missing",
    "top/..",
    "",
    "agent.toml",
];

/// Modes of entries, some with set-id bits.
const MODES: [u32; 6] = [0o644, 0o755, 0o600, 0o000, 0o4755, 0o2644];

struct Entry {
    kind: EntryType,
    name: String,
    mode: u32,
    target: String,
    content: Vec<u8>,
}

/// Entries of a valid bundle, with mutations.
fn entries(rng: &mut Rng) -> Vec<Entry> {
    let file = |name: &str, content: &[u8]| Entry {
        kind: EntryType::Regular,
        name: name.to_owned(),
        mode: 0o644,
        target: String::new(),
        content: content.to_vec(),
    };
    let top = *rng.pick(&["", "top/"]);
    let mut entries = vec![
        file(&format!("{top}agent.toml"), MANIFEST.as_bytes()),
        file(&format!("{top}agent.py"), b"print()"),
        file(&format!("{top}weights/w.bin"), &[7; 600]),
    ];
    for _ in 0..rng.below(4) {
        let position = rng.below(entries.len() + 1);
        let mut entry = file(rng.pick::<&str>(&NAMES), b"x");
        entry.kind = *rng.pick(&[
            EntryType::Regular,
            EntryType::Directory,
            EntryType::Symlink,
            EntryType::Symlink,
            EntryType::Link,
            EntryType::Char,
            EntryType::Fifo,
            EntryType::XHeader,
            EntryType::GNULongName,
            EntryType::GNUSparse,
        ]);
        entry.mode = *rng.pick(&MODES);
        entry.target = rng.pick(&TARGETS).to_string();
        match rng.below(12) {
            0 => entry.name = "n".repeat(rng.below(1200)),
            1 => entry.content = vec![0; rng.below(30_000)],
            2 => entry.content = b"20 path=../escape\n20 linkpath=/etc/x\n".to_vec(),
            3 => entry.name = format!("{top}agent.toml"),
            4 => mutate(&mut entry.content, &["name = 3"], rng),
            _ => {}
        }
        entries.insert(position, entry);
    }
    if rng.once_in(10) {
        entries[0].kind = *rng.pick(&[EntryType::Directory, EntryType::Symlink]);
        entries[0].target = rng.pick(&TARGETS).to_string();
    }
    if rng.once_in(12) {
        entries.extend((0..14).map(|i| file(&format!("many/{i}"), b"")));
    }
    if rng.once_in(12) {
        entries.extend((0..14).map(|i| Entry {
            kind: EntryType::Directory,
            ..file(&format!("folders/{i}"), b"")
        }));
    }
    if rng.once_in(8) {
        entries.remove(rng.below(entries.len()));
    }
    entries
}

fn tar_of(entries: &[Entry]) -> Vec<u8> {
    let tar = entries.iter().fold(Tar::new(), |tar, entry| {
        let Entry {
            kind,
            name,
            mode,
            target,
            content,
        } = entry;
        // The name must fit into a plain header; longer names need an extension header, as in `content`.
        let name: String = name.chars().take(80).filter(|c| c.is_ascii()).collect();
        match kind {
            EntryType::GNULongName => {
                let long = entry.name.as_bytes();
                tar.entry(*kind, "././@LongLink", 0o644, "", long).entry(
                    EntryType::Regular,
                    &name,
                    *mode,
                    "",
                    content,
                )
            }
            _ => tar.entry(*kind, &name, *mode, target, content),
        }
    });
    tar.bytes()
}

fn zip_of(entries: &[Entry], rng: &mut Rng) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for entry in entries {
        let options = SimpleFileOptions::default().unix_permissions(entry.mode);
        // The zip library refuses to write some malicious entries; they are left out.
        let _ = match entry.kind {
            EntryType::Directory => zip.add_directory(&*entry.name, options),
            EntryType::Symlink => zip.add_symlink(&*entry.name, &*entry.target, options),
            _ => zip
                .start_file(&*entry.name, options)
                .and_then(|()| Ok(zip.write_all(&entry.content)?)),
        };
    }
    let mut bytes = zip.finish().unwrap().into_inner();
    if rng.once_in(3) {
        mutate(&mut bytes, &["PK\u{1}\u{2}", "../", "/"], rng);
    }
    bytes
}

/// A tar or zip archive, with mutations.
fn archive(rng: &mut Rng) -> Vec<u8> {
    let entries = entries(rng);
    let mut bytes = match rng.below(3) {
        0 => return zip_of(&entries, rng),
        kind => {
            let mut tar = tar_of(&entries);
            if rng.once_in(6) {
                mutate(&mut tar, &["ustar", "0000644"], rng);
            }
            if kind == 1 {
                let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
                encoder.write_all(&tar).unwrap();
                encoder.finish().unwrap()
            } else {
                zstd::encode_all(Cursor::new(tar), 1).unwrap()
            }
        }
    };
    if rng.once_in(6) {
        mutate(&mut bytes, &["\u{1f}"], rng);
    }
    bytes
}

/// Checks that all unpacked files are inside and have harmless modes; adds up their bytes.
fn check_tree(root: &Path, folder: &Path, bytes: &mut u64) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, metadata) = (entry.path(), entry.metadata().unwrap());
        let mode = metadata.permissions().mode();
        if metadata.is_symlink() {
            if let Ok(target) = path.canonicalize() {
                assert!(target.starts_with(root), "{} leads out", path.display());
            }
        } else {
            assert_eq!(mode & 0o7000, 0, "{}", path.display());
        }
        if metadata.is_dir() {
            check_tree(root, &path, bytes);
        } else if metadata.is_file() {
            *bytes += metadata.len();
        } else {
            assert!(metadata.is_symlink(), "{}", path.display());
        }
    }
}

#[test]
fn archive_is_unpacked_inside_or_refused_as_invalid() {
    let scratch = tempfile::tempdir().unwrap();
    let root = scratch.path().canonicalize().unwrap();
    let outcomes = fuzz("archives", 4000, |rng| {
        let bytes = archive(rng);
        let packed = write(&root, "upload", &bytes);
        let into = root.join("out");
        let outcome = unpack(&packed, &into, &LIMITS, &|| false);
        let label = match outcome {
            Ok(bundle) => {
                assert!(bundle.dir.starts_with(&into));
                let mut unpacked = 0;
                check_tree(&into, &into, &mut unpacked);
                assert!(unpacked <= LIMITS.unpacked_bytes);
                "accepted".to_owned()
            }
            Err(BundleError::Invalid(message)) => {
                // The label does not contain the entry's name.
                let message = match message.split_once("\" ") {
                    Some((entry, problem)) if entry.starts_with("entry") => problem.to_owned(),
                    _ => message,
                };
                let mut label: Vec<char> = message.chars().collect();
                label.dedup_by(|a, b| a.is_ascii_digit() && b.is_ascii_digit());
                let shown = |c: char| if c.is_ascii_digit() { '#' } else { c };
                label.into_iter().map(shown).take(24).collect()
            }
            Err(error @ (BundleError::Io(_) | BundleError::Cancelled)) => {
                panic!("platform fault: {error}")
            }
        };
        if into.exists() {
            fs::remove_dir_all(&into).unwrap();
        }
        label
    });
    assert_outcomes(
        &outcomes,
        &[
            "accepted",
            "has an absolute path",
            "has '..' in its path",
            "has too long a path",
            "has a set-user-id",
            "is in the archive twice",
            "the archive has more tha",
            "the archive unpacks to m",
            "needs ",
            "goes through the link",
            "is a link that leaves th",
            "is a link that leads in ",
            "is a link to no possible",
            "is a hard link to",
            "is a device; a bundle ho",
            "is a named pipe; a bundl",
            "there is no agent.toml",
            "the archive is damaged",
            "the bundle is no archive",
            "the archive has # bytes",
            "agent.toml is a folder",
            "agent.toml is a link",
            "agent.toml: ",
        ],
    );
}

//! Unpacking of bundles (archives with an agent and its `agent.toml`): accepted formats, and attacks that must fail.

use crate::{
    archives::{MANIFEST, MODIFIED_S, Tar, write, zip},
    unpacking::{DEFAULT_TIME_S, assert_refused, assert_refused_with_limits, time_of, try_unpack},
};
use faceoff_runner::bundle::{Bundle, BundleError, BundleLimits, open, unpack};
use std::{
    fs,
    os::unix::fs::{MetadataExt, PermissionsExt},
    path::Path,
};
use tar::EntryType;
use tempfile::TempDir;

/// Unpacks a valid bundle.
#[track_caller]
fn unpack_valid(bytes: &[u8]) -> (TempDir, Bundle) {
    let (dir, result) = try_unpack(bytes, BundleLimits::default());
    (dir, result.unwrap())
}

/// Asserts a refusal before anything was written.
#[track_caller]
fn assert_refused_unwritten(bytes: &[u8], limits: BundleLimits, needle: &str) {
    let dir = assert_refused_with_limits(bytes, limits, needle);
    let written: Vec<_> = fs::read_dir(dir.path().join("out")).unwrap().collect();
    assert!(written.is_empty(), "{needle:?} after {written:?}");
}

fn mode(path: &Path) -> u32 {
    path.metadata().unwrap().permissions().mode() & 0o7777
}

#[test]
fn archive_formats_are_detected_by_their_bytes() {
    let tar = || {
        Tar::with_manifest()
            .folder("weights/")
            .file("./agent.py", 0o755, b"print()")
            .file("weights/w.bin", 0o600, &[7; 100_000])
    };
    let zip = zip(&[
        ("agent.toml", 0o644, MANIFEST.as_bytes()),
        ("weights/", 0o755, b""),
        ("agent.py", 0o755, b"print()"),
        ("weights/w.bin", 0o600, &[7; 100_000]),
    ]);
    for (bytes, file_time) in [
        (tar().gz(), MODIFIED_S),
        (tar().zst(), MODIFIED_S),
        (zip, DEFAULT_TIME_S),
    ] {
        let (_dir, bundle) = unpack_valid(&bytes);
        assert_eq!(bundle.manifest.name, "test");
        assert_eq!(
            fs::read(bundle.dir.join("weights/w.bin")).unwrap(),
            [7; 100_000]
        );
        assert_eq!(mode(&bundle.dir.join("agent.py")), 0o755);
        assert_eq!(mode(&bundle.dir.join("weights/w.bin")), 0o644);
        assert_eq!(mode(&bundle.dir.join("weights")), 0o755);
        for (path, time) in [
            ("", DEFAULT_TIME_S),
            ("weights", DEFAULT_TIME_S),
            ("agent.py", file_time),
            ("weights/w.bin", file_time),
        ] {
            assert_eq!(time_of(&bundle.dir.join(path)), time, "{path}");
        }
    }
    assert_refused(b"", "expected .tar.gz, .tar.zst or .zip");
    assert_refused(b"#!/bin/sh\n", "expected .tar.gz, .tar.zst or .zip");
}

#[test]
fn single_top_folder_is_the_bundle() {
    let (_dir, bundle) = unpack_valid(
        &Tar::new()
            .file("striker-1.2/agent.toml", 0o644, MANIFEST.as_bytes())
            .gz(),
    );
    assert!(bundle.dir.ends_with("striker-1.2"));
    let two = Tar::new()
        .file("a/agent.toml", 0o644, MANIFEST.as_bytes())
        .file("b/x", 0o644, b"");
    assert_refused(&two.gz(), "there is no agent.toml");
    assert_refused(
        &Tar::new().file("agent.py", 0o644, b"").gz(),
        "there is no agent.toml",
    );
    assert_refused(
        &Tar::new().file("a/b/agent.toml", 0o644, b"").gz(),
        "there is no agent.toml",
    );
    assert_refused(&Tar::new().gz(), "there is no agent.toml");
}

#[test]
fn invalid_manifest_refusal_says_why() {
    let tar = |text: &str| Tar::new().file("agent.toml", 0o644, text.as_bytes()).gz();
    assert_refused(&tar("name = 3"), "agent.toml:");
    assert_refused(
        &tar(&MANIFEST.replace("[\"python3\", \"agent.py\"]", "[]")),
        "command must name",
    );
    assert_refused(&tar(&"#".repeat(100_000)), "longer than 65536 bytes");
    let not_utf8 = Tar::new()
        .file("agent.toml", 0o644, b"name = \"\xff\"")
        .gz();
    assert_refused(&not_utf8, "agent.toml: not UTF-8");
}

#[test]
fn files_added_by_operating_systems_are_left_out() {
    // The first bytes of an AppleDouble file, in which macOS keeps metadata of another file.
    let metadata = b"\0\x05\x16\x07";
    // A zip of macOS's Finder, of a folder in which a Windows computer has left settings, too.
    let finder = zip(&[
        (".DS_Store", 0o644, b"Bud1"),
        ("my-agent/agent.toml", 0o644, MANIFEST.as_bytes()),
        ("my-agent/lib/.DS_Store", 0o644, b"Bud1"),
        ("my-agent/lib/desktop.ini", 0o644, b"[.ShellClassInfo]"),
        ("my-agent/lib/Thumbs.db", 0o644, b""),
        ("my-agent/lib/a.py", 0o644, b"pass"),
        ("__MACOSX/my-agent/._agent.toml", 0o644, metadata),
        ("__MACOSX/my-agent/lib/._a.py", 0o644, metadata),
    ]);
    // The tar of macOS, in a folder that a group shares.
    let tar = Tar::new()
        .file("._my-agent", 0o644, metadata)
        .entry(EntryType::Directory, "my-agent/", 0o2775, "", b"")
        .file("my-agent/._agent.toml", 0o644, metadata)
        .file("my-agent/agent.toml", 0o644, MANIFEST.as_bytes())
        .file("my-agent/lib/._a.py", 0o644, metadata)
        .file("my-agent/lib/a.py", 0o644, b"pass")
        .gz();
    for archive in [finder, tar] {
        let (_dir, bundle) = unpack_valid(&archive);
        assert!(bundle.dir.ends_with("my-agent"), "{bundle:?}");
        let names = |folder: &Path| {
            let mut names: Vec<_> = fs::read_dir(folder)
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .collect();
            names.sort();
            names
        };
        assert_eq!(names(&bundle.dir), ["agent.toml", "lib"]);
        assert_eq!(names(&bundle.dir.join("lib")), ["a.py"]);
        assert_eq!(mode(&bundle.dir), 0o755);
    }
}

#[test]
fn own_files_named_like_metadata_are_unpacked() {
    // Named like AppleDouble files of macOS, but without their first bytes (00 05 16 07).
    let files: [(&str, u32, &[u8]); 3] = [
        ("agent.toml", 0o644, MANIFEST.as_bytes()),
        ("._weights", 0o644, b"\0\x05\x16\x08 and more"),
        ("._short", 0o644, b"a"),
    ];
    let tar = files.iter().fold(Tar::new(), |tar, (name, mode, content)| {
        tar.file(name, *mode, content)
    });
    for archive in [zip(&files), tar.gz()] {
        let (_dir, bundle) = unpack_valid(&archive);
        for (name, _, content) in files {
            assert_eq!(fs::read(bundle.dir.join(name)).unwrap(), content);
        }
    }
}

#[test]
fn metadata_of_links_is_left_out() {
    let metadata = "\0\x05\x16\x07 and \0 bytes";
    for name in ["__MACOSX/._l", "__MACOSX/l", "._l"] {
        let (_dir, bundle) = unpack_valid(&ZipWithLink::named(name, metadata).bytes());
        assert!(!bundle.dir.join(name).exists());
        assert!(bundle.dir.join("agent.toml").is_file());
    }
    let tar = Tar::with_manifest().symlink("__MACOSX/l", "..");
    unpack_valid(&tar.gz());
}

#[test]
fn manifest_may_begin_with_a_byte_order_mark() {
    let text = format!("\u{feff}{}", MANIFEST.replace('\n', "\r\n"));
    let tar = Tar::new().file("agent.toml", 0o644, text.as_bytes());
    let (_dir, bundle) = unpack_valid(&tar.gz());
    assert_eq!(bundle.manifest.command[0], "python3");
}

#[test]
fn paths_outside_the_bundle_are_refused() {
    for (name, reason) in [
        ("/etc/cron.d/x", "absolute path"),
        ("../x", "'..'"),
        ("a/../../x", "'..'"),
        ("a/..", "'..'"),
    ] {
        let dir = assert_refused(&Tar::with_manifest().file(name, 0o644, b"x").gz(), reason);
        assert!(!dir.path().join("x").exists());
        assert_refused(&Tar::with_manifest().file(name, 0o644, b"x").gz(), name);
        assert_refused(
            &zip(&[
                ("agent.toml", 0o644, MANIFEST.as_bytes()),
                (name, 0o644, b"x"),
            ]),
            reason,
        );
    }
    assert_refused(&zip(&[("a\\..\\b", 0o644, b"")]), "Compress-Archive");
    assert_refused(
        &Tar::with_manifest()
            .file(&format!("{}/x", "n".repeat(90)), 0o644, b"")
            .file("", 0o644, b"")
            .gz(),
        "has no name",
    );
}

#[test]
fn links_outside_the_bundle_are_refused() {
    let links_inside = Tar::with_manifest()
        .file("lib/real.so.1", 0o644, b"library")
        .symlink("lib/real.so", "real.so.1")
        .symlink("main.so", "lib/real.so")
        .entry(EntryType::Link, "copy", 0o644, "lib/real.so.1", b"");
    let (_dir, bundle) = unpack_valid(&links_inside.gz());
    assert_eq!(fs::read(bundle.dir.join("main.so")).unwrap(), b"library");
    let copy = bundle.dir.join("copy").metadata().unwrap();
    assert_eq!(
        copy.ino(),
        bundle.dir.join("lib/real.so.1").metadata().unwrap().ino()
    );

    let leaves = "is a link that leaves the bundle";
    for target in ["/etc/passwd", "..", "../x", "lib/../.."] {
        assert_refused(&Tar::with_manifest().symlink("l", target).gz(), leaves);
        let mut as_zip = ZipWithLink::new(target);
        assert_refused(&as_zip.bytes(), leaves);
    }
    // If the bundle is in a top-level folder, the archive's root is outside of it.
    let top = Tar::new()
        .file("top/agent.toml", 0o644, MANIFEST.as_bytes())
        .symlink("top/l", "..");
    assert_refused(&top.gz(), leaves);
    // A chain of links that leaves the bundle only when it is followed.
    let chain = Tar::with_manifest()
        .symlink("deep/up", "..")
        .symlink("escape", "deep/up/../x");
    assert_refused(&chain.gz(), "escape");
    assert_refused(
        &Tar::with_manifest()
            .symlink("a", "b")
            .symlink("b", "a")
            .gz(),
        "circle",
    );
    assert_refused(
        &Tar::with_manifest()
            .entry(EntryType::Link, "passwd", 0o644, "/etc/passwd", b"")
            .gz(),
        "absolute path",
    );
    assert_refused(
        &Tar::with_manifest()
            .entry(EntryType::Link, "l", 0o644, "missing", b"")
            .gz(),
        "no earlier file",
    );
}

/// A zip with a symbolic link, which the library writes as a file with the mode of a link.
struct ZipWithLink(zip::ZipWriter<std::io::Cursor<Vec<u8>>>);

impl ZipWithLink {
    fn new(target: &str) -> Self {
        Self::named("l", target)
    }

    fn named(name: &str, target: &str) -> Self {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default();
        zip.add_symlink(name, target, options).unwrap();
        zip.start_file("agent.toml", options).unwrap();
        std::io::Write::write_all(&mut zip, MANIFEST.as_bytes()).unwrap();
        Self(zip)
    }

    fn bytes(&mut self) -> Vec<u8> {
        std::mem::replace(
            &mut self.0,
            zip::ZipWriter::new(std::io::Cursor::new(Vec::new())),
        )
        .finish()
        .unwrap()
        .into_inner()
    }
}

#[test]
fn files_are_never_written_through_links() {
    let outside = tempfile::tempdir().unwrap();
    let target = outside.path().to_str().unwrap();
    let tar = Tar::with_manifest()
        .symlink("l", target)
        .file("l/x", 0o644, b"owned");
    assert_refused(&tar.gz(), "goes through the link");
    let tar = Tar::with_manifest()
        .symlink("l", target)
        .file("l", 0o644, b"owned");
    assert_refused(&tar.gz(), "twice");
    assert_eq!(fs::read_dir(outside.path()).unwrap().count(), 0);
}

#[test]
fn duplicate_names_are_refused() {
    let twice = |name: &str| {
        Tar::with_manifest()
            .file("a", 0o644, b"1")
            .file(name, 0o644, b"2")
            .gz()
    };
    assert_refused(&twice("a"), "\"a\" is in the archive twice");
    assert_refused(&twice("./a"), "\"./a\" is in the archive twice");
    assert_refused(
        &twice("a/b"),
        "needs \"a\" to be a folder, but it is a file",
    );
    assert_refused(&Tar::with_manifest().folder("d/").folder("d").gz(), "twice");
    assert_refused(
        &Tar::with_manifest().folder("d/").file("d", 0o644, b"").gz(),
        "twice",
    );
    // The library refuses to write two entries with the same name, so one is renamed in the bytes.
    let mut bytes = zip(&[
        ("agent.toml", 0o644, MANIFEST.as_bytes()),
        ("a1", 0o644, b"x"),
        ("a2", 0o644, b"y"),
    ]);
    for start in 0..bytes.len() - 2 {
        if &bytes[start..start + 2] == b"a2" {
            bytes[start + 1] = b'1';
        }
    }
    assert_refused(&bytes, "\"a1\" is in the archive twice");
}

#[test]
fn devices_pipes_and_set_id_bits_are_refused() {
    for (kind, what) in [
        (EntryType::Char, "a device"),
        (EntryType::Block, "a device"),
        (EntryType::Fifo, "a named pipe"),
        (EntryType::GNUSparse, "a sparse file"),
        (EntryType::new(b'Z'), "of an unknown kind"),
    ] {
        assert_refused(
            &Tar::with_manifest().entry(kind, "dev", 0o644, "", b"").gz(),
            what,
        );
    }
    assert_refused(
        &Tar::with_manifest().file("su", 0o4755, b"").gz(),
        "set-user-id",
    );
    for (mode, what) in [
        (0o104_755_u16, "set-user-id"),
        (0o020_644, "a device, pipe or socket"),
    ] {
        let bytes = change_last_entry(
            zip(&[("x", 0o644, b"")]),
            zip_field::UNIX_MODE,
            &mode.to_le_bytes(),
        );
        assert_refused(&bytes, what);
    }
}

#[test]
fn long_names_of_gnu_and_pax_are_read() {
    let name = format!("{}/{}.py", "d".repeat(120), "n".repeat(120));
    let gnu = Tar::with_manifest()
        .entry(
            EntryType::GNULongName,
            "././@LongLink",
            0o644,
            "",
            format!("{name}\0").as_bytes(),
        )
        .file("short", 0o644, b"gnu");
    let (_dir, bundle) = unpack_valid(&gnu.gz());
    assert_eq!(fs::read(bundle.dir.join(&name)).unwrap(), b"gnu");

    // A record begins with its own length, here of three digits.
    let record = format!(" path={name}\n");
    let record = format!("{}{record}", record.len() + 3);
    let pax = Tar::with_manifest()
        .entry(
            EntryType::XGlobalHeader,
            "pax_global_header",
            0o644,
            "",
            b"15 comment=abc\n",
        )
        .entry(
            EntryType::XHeader,
            "PaxHeaders/x",
            0o644,
            "",
            record.as_bytes(),
        )
        .file("short", 0o644, b"pax");
    let (_dir, bundle) = unpack_valid(&pax.gz());
    assert_eq!(fs::read(bundle.dir.join(&name)).unwrap(), b"pax");

    let escape = Tar::with_manifest()
        .entry(
            EntryType::GNULongName,
            "././@LongLink",
            0o644,
            "",
            b"../../evil\0",
        )
        .file("fine", 0o644, b"");
    assert_refused(&escape.gz(), "'..'");
    let size = Tar::with_manifest()
        .entry(
            EntryType::XHeader,
            "PaxHeaders/x",
            0o644,
            "",
            b"10 size=1\n",
        )
        .file("x", 0o644, b"12345");
    assert_refused(&size.gz(), "states a size outside of its header");
}

/// Offsets in an entry of a zip's central directory.
mod zip_field {
    pub const FLAGS: usize = 8;
    pub const COMPRESSION_METHOD: usize = 10;
    pub const UNPACKED_BYTES: usize = 24;
    /// The upper half of the external attributes.
    pub const UNIX_MODE: usize = 40;
    pub const NAME: usize = 46;
}

/// Changes the field at this [`zip_field`] of the last entry in the central directory of a zip, to values that the library
/// does not write.
fn change_last_entry(mut zip: Vec<u8>, field: usize, value: &[u8]) -> Vec<u8> {
    let entry = zip
        .windows(4)
        .rposition(|magic| magic == b"PK\x01\x02")
        .unwrap();
    zip[entry + field..][..value.len()].copy_from_slice(value);
    zip
}

/// A zip with one file whose headers both state a size of ten bytes.
fn understated_zip(name: &str, content: &[u8]) -> Vec<u8> {
    let size = 10_u32.to_le_bytes();
    let packed = zip(&[(name, 0o644, content)]);
    let mut bytes = change_last_entry(packed, zip_field::UNPACKED_BYTES, &size);
    // The same field of the first local header.
    bytes[22..26].copy_from_slice(&size);
    bytes
}

#[test]
fn bombs_are_stopped_while_streaming() {
    let limits = BundleLimits {
        packed_bytes: 1 << 20,
        unpacked_bytes: 1 << 20,
        files: 100,
        ..BundleLimits::default()
    };
    let bomb = vec![0; 40 << 20];
    let too_much = "unpacks to more than 1048576 bytes (stopped at entry \"bomb\")";
    for (bytes, needle) in [
        (
            Tar::with_manifest().file("bomb", 0o644, &bomb).gz(),
            too_much,
        ),
        (
            Tar::with_manifest().file("bomb", 0o644, &bomb).zst(),
            too_much,
        ),
        (understated_zip("bomb", &bomb), "damaged at \"bomb\""),
    ] {
        assert!(
            bytes.len() < 1 << 20,
            "the bomb is small before it is unpacked"
        );
        let dir = assert_refused_with_limits(&bytes, limits, needle);
        let written = dir.path().join("out/bomb").metadata().unwrap().len();
        assert!(written <= 1 << 20, "{written} bytes were written");
    }
    assert_refused_unwritten(&zip(&[("bomb", 0o644, &bomb)]), limits, too_much);
    // A header that describes the next entry cannot bypass the limit.
    let header = Tar::with_manifest().entry(EntryType::GNULongName, "l", 0o644, "", &bomb);
    assert_refused_with_limits(&header.gz(), limits, "has a header of 41943040 bytes");
    assert_refused_with_limits(
        &vec![b'x'; 2 << 20],
        limits,
        "has 2097152 bytes; at most 1048576",
    );
}

#[test]
fn files_and_folders_are_counted() {
    let limits = BundleLimits {
        files: 5,
        ..BundleLimits::default()
    };
    let files = |count: usize| {
        (0..count)
            .fold(Tar::with_manifest(), |tar, i| {
                tar.file(&format!("f{i}"), 0o644, b"")
            })
            .gz()
    };
    assert!(try_unpack(&files(4), limits).1.is_ok());
    assert_refused_with_limits(&files(5), limits, "more than 5 files");
    let folders = Tar::with_manifest().folder("1/2/3/4/5/6");
    assert_refused_with_limits(&folders.gz(), limits, "more than 5 folders");
    let names: Vec<String> = (0..6).map(|i| format!("f{i}")).collect();
    let entries: Vec<(&str, u32, &[u8])> = names
        .iter()
        .map(|name| (name.as_str(), 0o644, &b""[..]))
        .collect();
    assert_refused_with_limits(&zip(&entries), limits, "more than 5 files");
}

#[test]
fn default_limit_is_fifty_thousand_files() {
    let names: Vec<String> = (0..50_000).map(|i| format!("f{i}")).collect();
    let tar = names
        .iter()
        .fold(Tar::with_manifest(), |tar, name| tar.file(name, 0o644, b""));
    assert_refused(&tar.gz(), "more than 50000 files");
}

#[test]
fn folders_beyond_the_limit_are_not_created() {
    let names: Vec<String> = (0..50_001).map(|i| format!("d{i}/")).collect();
    let tar = || names.iter().fold(Tar::new(), |tar, name| tar.folder(name));
    let entries: Vec<(&str, u32, &[u8])> = names
        .iter()
        .map(|name| (name.as_str(), 0o755, &b""[..]))
        .collect();
    for bytes in [tar().gz(), tar().zst(), zip(&entries)] {
        assert_refused_unwritten(
            &bytes,
            BundleLimits::default(),
            "the archive has more than 50000 folders",
        );
    }
}

#[test]
fn zip_with_an_unusable_last_entry_writes_nothing() {
    let ending = |name: &str| {
        zip(&[
            ("agent.toml", 0o644, MANIFEST.as_bytes()),
            ("empty/", 0o755, b""),
            ("a", 0o644, b"1"),
            (name, 0o644, b"2"),
        ])
    };
    let changed = |field: usize, value: &[u8]| change_last_entry(ending("b"), field, value);
    for (bytes, needle) in [
        (changed(zip_field::FLAGS, &[1, 0]), "\"b\" is encrypted"),
        (
            changed(zip_field::COMPRESSION_METHOD, &[12, 0]),
            "by another method than deflate",
        ),
        (
            changed(zip_field::UNPACKED_BYTES, &0x9000_0000_u32.to_le_bytes()),
            "unpacks to more than 2147483648 bytes (stopped at entry \"b\")",
        ),
        (
            changed(zip_field::UNIX_MODE, &0o020_644_u16.to_le_bytes()),
            "\"b\" is a device, pipe or socket",
        ),
        (
            changed(zip_field::UNIX_MODE, &0o104_755_u16.to_le_bytes()),
            "\"b\" has a set-user-id or set-group-id bit",
        ),
        (
            changed(zip_field::NAME, b"a"),
            "\"a\" is in the archive twice",
        ),
        (
            changed(zip_field::NAME, b"\xff"),
            "has a name that is not UTF-8",
        ),
        (changed(zip_field::NAME, b"\\"), "named with a backslash"),
        (changed(zip_field::NAME, b"/"), "\"/\" has an absolute path"),
        (ending("../b"), "\"../b\" has '..' in its path"),
        (
            ending("a/b"),
            "needs \"a\" to be a folder, but it is a file",
        ),
        (ending(&"n".repeat(256)), "has too long a path"),
    ] {
        assert_refused_unwritten(&bytes, BundleLimits::default(), needle);
    }
    let few = BundleLimits {
        files: 2,
        ..BundleLimits::default()
    };
    assert_refused_unwritten(&ending("b"), few, "more than 2 files");
    assert_refused_unwritten(&ending("1/2/b"), few, "more than 2 folders");
    unpack_valid(&ending("b"));
}

#[test]
fn empty_folders_are_created_with_their_modes() {
    let tar = || {
        Tar::with_manifest()
            .folder("empty/")
            .entry(EntryType::Directory, "closed", 0o700, "", b"")
            .folder("a/b/c/")
            .file("a/x", 0o600, b"x")
            .file("late/y", 0o644, b"y")
            .folder("late/")
    };
    let zipped = zip(&[
        ("agent.toml", 0o644, MANIFEST.as_bytes()),
        ("empty/", 0o755, b""),
        ("closed/", 0o700, b""),
        ("a/b/c/", 0o755, b""),
        ("a/x", 0o600, b"x"),
        ("late/y", 0o644, b"y"),
        ("late/", 0o755, b""),
    ]);
    for bytes in [tar().gz(), tar().zst(), zipped] {
        let (_dir, bundle) = unpack_valid(&bytes);
        for folder in ["empty", "closed", "a", "a/b", "a/b/c", "late"] {
            let path = bundle.dir.join(folder);
            assert!(path.symlink_metadata().unwrap().is_dir(), "{folder}");
            assert_eq!(mode(&path), 0o755, "{folder}");
        }
        assert_eq!(fs::read(bundle.dir.join("a/x")).unwrap(), b"x");
        assert_eq!(fs::read(bundle.dir.join("late/y")).unwrap(), b"y");
        assert_eq!(fs::read_dir(bundle.dir.join("empty")).unwrap().count(), 0);
    }
}

#[test]
fn folder_with_only_a_link_is_created() {
    let tar = Tar::with_manifest()
        .symlink("only/a/link", "../../agent.toml")
        .symlink("to", "only/a")
        .entry(EntryType::Link, "other/name", 0o644, "agent.toml", b"");
    let (_dir, bundle) = unpack_valid(&tar.gz());
    for path in ["only/a/link", "to/link", "other/name"] {
        let text = fs::read_to_string(bundle.dir.join(path)).unwrap();
        assert_eq!(text, MANIFEST, "{path}");
    }
    assert_eq!(mode(&bundle.dir.join("only/a")), 0o755);
}

#[test]
fn damaged_archives_are_refused_as_invalid() {
    let tar = || Tar::with_manifest().file("agent.py", 0o644, &[1; 50_000]);
    let gz = tar().gz();
    assert_refused(&gz[..gz.len() / 2], "the archive is damaged");
    let zst = tar().zst();
    assert_refused(&zst[..zst.len() / 2], "the archive is damaged");
    let zipped = zip(&[
        ("agent.toml", 0o644, MANIFEST.as_bytes()),
        ("x", 0o644, &[1; 5000]),
    ]);
    assert_refused(&zipped[..zipped.len() / 2], "the archive is damaged");
    let mut flipped = zip(&[("agent.toml", 0o644, MANIFEST.as_bytes())]);
    // A byte of the file's compressed content.
    flipped[50] ^= 0xff;
    let (_dir, result) = try_unpack(&flipped, BundleLimits::default());
    assert!(matches!(result, Err(BundleError::Invalid(_))), "{result:?}");
    assert_refused(b"PK\x03\x04 and nothing more", "the archive is damaged");
}

#[test]
fn failed_disk_access_is_a_platform_fault() {
    let dir = tempfile::tempdir().unwrap();
    let archive = write(dir.path(), "upload", &Tar::with_manifest().gz());
    fs::create_dir(dir.path().join("full")).unwrap();
    fs::write(dir.path().join("full/file"), "").unwrap();
    for into in [dir.path().join("full"), archive.clone()] {
        let result = unpack(&archive, &into, &BundleLimits::default(), &|| false);
        assert!(matches!(result, Err(BundleError::Io { .. })), "{result:?}");
    }
    let missing = unpack(
        &dir.path().join("nothing"),
        &dir.path().join("out"),
        &BundleLimits::default(),
        &|| false,
    );
    assert!(
        matches!(missing, Err(BundleError::Io { .. })),
        "{missing:?}"
    );
}

#[test]
fn folder_is_opened_in_place() {
    let dir = tempfile::tempdir().unwrap();
    let scratch = tempfile::tempdir().unwrap();
    let limits = BundleLimits::default();
    let empty = open(dir.path(), scratch.path(), &limits).unwrap_err();
    assert!(
        empty.to_string().contains("there is no agent.toml"),
        "{empty}"
    );
    write(dir.path(), "agent.toml", MANIFEST.as_bytes());
    let bundle = open(dir.path(), scratch.path(), &limits).unwrap();
    assert_eq!(bundle.dir, dir.path().canonicalize().unwrap());
    assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 0);

    let archive = write(
        dir.path(),
        "a.zip",
        &zip(&[("agent.toml", 0o644, MANIFEST.as_bytes())]),
    );
    let bundle = open(&archive, scratch.path(), &limits).unwrap();
    assert!(
        bundle
            .dir
            .starts_with(scratch.path().canonicalize().unwrap())
    );
    let missing = open(&dir.path().join("nope"), scratch.path(), &limits).unwrap_err();
    assert!(matches!(missing, BundleError::Invalid(_)), "{missing}");
}

#[test]
fn manifest_that_is_no_file_is_refused() {
    let manifest = MANIFEST.as_bytes();
    let folder = Tar::new()
        .folder("agent.toml/")
        .file("agent.py", 0o644, b"");
    assert_refused(&folder.gz(), "agent.toml is a folder: expected a file");
    let full = Tar::new().file("agent.toml/agent.toml", 0o644, manifest);
    assert_refused(&full.zst(), "agent.toml is a folder");
    let below = Tar::new().folder("top/agent.toml/");
    assert_refused(&below.gz(), "agent.toml is a folder");
    assert_refused(
        &zip(&[("agent.toml/", 0o755, b"")]),
        "agent.toml is a folder",
    );
    for target in ["real.toml", "missing", "."] {
        let link = Tar::new()
            .file("real.toml", 0o644, manifest)
            .symlink("agent.toml", target);
        assert_refused(&link.gz(), "agent.toml is a link: expected a file");
    }
    let circle = Tar::new().symlink("agent.toml", "agent.toml");
    assert_refused(&circle.gz(), "leads in a circle");
    for kind in [EntryType::Fifo, EntryType::Char, EntryType::Block] {
        let device = Tar::new().entry(kind, "agent.toml", 0o644, "", b"");
        assert_refused(&device.gz(), "a bundle holds files, folders and links");
    }

    // A developer's folder, opened in place.
    let own = tempfile::tempdir().unwrap();
    let refusal = |make: &dyn Fn(&Path)| {
        let dir = tempfile::tempdir_in(own.path()).unwrap();
        make(&dir.path().join("agent.toml"));
        let opened = open(dir.path(), own.path(), &BundleLimits::default());
        match opened {
            Err(BundleError::Invalid(message)) => message,
            other => panic!("{other:?}"),
        }
    };
    assert!(refusal(&|path| fs::create_dir(path).unwrap()).contains("is a folder"));
    let pipe = |path: &Path| {
        rustix::fs::mknodat(
            rustix::fs::CWD,
            path,
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR,
            0,
        )
        .unwrap();
    };
    assert!(refusal(&pipe).contains("is a device, pipe or socket"));
    let link = |path: &Path| std::os::unix::fs::symlink("/dev/null", path).unwrap();
    assert!(refusal(&link).contains("is a link"));
}

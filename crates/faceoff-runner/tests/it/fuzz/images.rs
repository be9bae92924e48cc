//! Fuzz test of container images: each is unpacked inside of its root, or refused as invalid.

use super::{assert_outcomes, fuzz, mutation::mutate, rng::Rng};
use crate::{
    archives::{Tar, write},
    image_archives::{Packing, TestImage, agent_layer, host_folder},
};
use faceoff_runner::bundle::{BundleError, BundleLimits, unpack};
use std::{fs, os::unix::fs::PermissionsExt, path::Path};
use tar::EntryType;

/// Limits that mutations exceed often.
const LIMITS: BundleLimits = BundleLimits {
    packed_bytes: 200_000,
    unpacked_bytes: 60_000,
    files: 25,
    unpack_s: 600,
};

/// Names of entries; few, so that entries of different layers collide.
const NAMES: [&str; 32] = [
    "a",
    "a/",
    "a/b",
    "a/b/",
    "a/b/c",
    "a/b/c/d",
    "b",
    "b/c",
    "b/a/c",
    "agent",
    "agent/",
    "agent/agent.toml",
    "agent/a",
    "etc",
    "etc/passwd",
    "etc/hosts/",
    "tmp/x",
    "dev",
    ".wh.a",
    ".wh.b",
    ".wh.etc",
    "a/.wh.b",
    "a/.wh..wh..opq",
    "a/b/.wh.c",
    "b/.wh..wh..opq",
    ".wh..wh..opq",
    ".wh.",
    ".wh...",
    "./",
    "../secret",
    "/a",
    "",
];

/// Targets of links. `HOST` is replaced by a folder of the host.
const TARGETS: [&str; 16] = [
    "a",
    "b",
    "b/c",
    "a/b",
    "a/b/c",
    "..",
    "../..",
    "/",
    "/a",
    "/etc",
    "HOST",
    "HOST/secret",
    ".",
    "missing",
    "agent",
    "",
];

/// A layer of random entries.
fn layer(rng: &mut Rng, host: &str) -> Tar {
    (0..rng.below(10)).fold(Tar::new(), |tar, _| {
        let name = *rng.pick::<&str>(&NAMES);
        let target = rng.pick::<&str>(&TARGETS).replace("HOST", host);
        let kind = *rng.pick(&[
            EntryType::Regular,
            EntryType::Regular,
            EntryType::Directory,
            EntryType::Symlink,
            EntryType::Symlink,
            EntryType::Link,
            EntryType::Block,
            EntryType::Char,
        ]);
        // Makes whiteouts more frequent, and devices, which are refused, less frequent.
        let kind = match kind {
            _ if name.contains(".wh.") && !rng.once_in(8) => EntryType::Regular,
            EntryType::Char if !rng.once_in(8) => EntryType::Fifo,
            kind => kind,
        };
        let size = match () {
            () if rng.once_in(20) => 30_000,
            // More than the limit.
            () if rng.once_in(60) => 70_000,
            () => rng.below(20),
        };
        let content = match kind {
            EntryType::Regular => vec![b'x'; size],
            _ => Vec::new(),
        };
        tar.entry(
            kind,
            name,
            *rng.pick(&[0o644, 0o755, 0, 0o6755]),
            &target,
            &content,
        )
    })
}

/// An image with an agent's layer at a random position, with mutations.
fn archive(rng: &mut Rng, host: &str) -> Vec<u8> {
    let mut layers: Vec<Tar> = (0..rng.below(5)).map(|_| layer(rng, host)).collect();
    let position = rng.below(layers.len() + 1);
    layers.insert(position, agent_layer());
    let image =
        TestImage::new(layers).packed(*rng.pick(&[Packing::Plain, Packing::Gzip, Packing::Zstd]));
    let tar = if rng.once_in(2) {
        image.docker()
    } else {
        image.layout()
    };
    let mut bytes = tar.bytes();
    if rng.once_in(3) {
        let words = [
            "sha256:", "layer0", "[]", "null", "manifest", "../", "linux", "0000644",
        ];
        mutate(&mut bytes, &words, rng);
    }
    bytes
}

/// Checks that there are no devices and no set-id bits; adds up the bytes. Links are not followed.
fn check_tree(folder: &Path, bytes: &mut u64) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let metadata = path.symlink_metadata().unwrap();
        let mode = metadata.permissions().mode() & 0o7777;
        if metadata.is_dir() {
            assert_eq!(mode, 0o755, "{}", path.display());
            check_tree(&path, bytes);
        } else if metadata.is_file() {
            assert!(matches!(mode, 0o644 | 0o755), "{}", path.display());
            *bytes += metadata.len();
        } else {
            assert!(metadata.is_symlink(), "{}", path.display());
        }
    }
}

#[test]
fn image_is_unpacked_inside_or_refused_as_invalid() {
    let scratch = host_folder();
    let root = scratch.path().canonicalize().unwrap();
    let host = root.join("h");
    fs::create_dir(&host).unwrap();
    fs::write(host.join("secret"), "secret").unwrap();
    let host_path = host.to_str().unwrap();
    let outcomes = fuzz("images", 3000, |rng| {
        let packed = write(&root, "upload", &archive(rng, host_path));
        let into = root.join("out");
        let label = match unpack(&packed, &into, &LIMITS, &|| false) {
            Ok(bundle) => {
                let image = bundle.image.unwrap();
                assert_eq!(fs::read_dir(&into).unwrap().count(), 1);
                let mut unpacked = 0;
                check_tree(&image.root, &mut unpacked);
                assert!(unpacked <= 2 * LIMITS.unpacked_bytes);
                for folder in ["agent", "dev", "etc", "proc", "sys", "tmp"] {
                    let metadata = image.root.join(folder).symlink_metadata();
                    assert!(metadata.unwrap().is_dir(), "{folder}");
                }
                "accepted".to_owned()
            }
            Err(BundleError::Invalid(message)) => {
                let message = message.split_once(": ").map_or(&*message, |(start, rest)| {
                    if start.starts_with("layer ") {
                        rest
                    } else {
                        &message
                    }
                });
                let message = match message.split_once("\" ") {
                    Some((entry, problem)) if entry.starts_with("entry") => problem,
                    _ => message,
                };
                message.chars().take(24).collect()
            }
            Err(error @ (BundleError::Io(_) | BundleError::Cancelled)) => {
                panic!("platform fault: {error}")
            }
        };
        if into.exists() {
            fs::remove_dir_all(&into).unwrap();
        }
        assert_eq!(fs::read_dir(&host).unwrap().count(), 1);
        let secret = fs::read_to_string(host.join("secret")).unwrap();
        assert_eq!(secret, "secret");
        label
    });
    assert_outcomes(
        &outcomes,
        &[
            "accepted",
            "has '..' in its path",
            "is a whiteout of no poss",
            "is a hard link to \"",
            "is a hard link to what i",
            "the image's layers conta",
            "goes through more than 4",
            "the container image has ",
            "needs \"",
        ],
    );
}

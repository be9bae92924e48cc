use super::{assert_met, draws::Draws, fuzz, mutation::mutate};
use crate::{
    archives::{Tar, write},
    image_archives::{Packing, TestImage, agent_layer, host_folder},
};
use faceoff_runner::bundle::{BundleError, BundleLimits, unpack};
use std::{fs, os::unix::fs::PermissionsExt, path::Path};
use tar::EntryType;

const LIMITS: BundleLimits = BundleLimits {
    packed_bytes: 200_000,
    unpacked_bytes: 60_000,
    files: 25,
    unpack_s: 600,
};

/// Few, so that entries and layers meet.
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

/// `HOST` becomes a folder of the host's.
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

fn layer(draws: &mut Draws, host: &str) -> Tar {
    (0..draws.below(10)).fold(Tar::new(), |tar, _| {
        let name = *draws.pick::<&str>(&NAMES);
        let target = draws.pick::<&str>(&TARGETS).replace("HOST", host);
        let kind = *draws.pick(&[
            EntryType::Regular,
            EntryType::Regular,
            EntryType::Directory,
            EntryType::Symlink,
            EntryType::Symlink,
            EntryType::Link,
            EntryType::Block,
            EntryType::Char,
        ]);
        // Whiteouts would be rare otherwise; devices refuse the layer.
        let kind = match kind {
            _ if name.contains(".wh.") && !draws.once_in(8) => EntryType::Regular,
            EntryType::Char if !draws.once_in(8) => EntryType::Fifo,
            kind => kind,
        };
        let size = match () {
            () if draws.once_in(20) => 30_000,
            // More than is allowed, wherever it goes.
            () if draws.once_in(60) => 70_000,
            () => draws.below(20),
        };
        let content = match kind {
            EntryType::Regular => vec![b'x'; size],
            _ => Vec::new(),
        };
        tar.entry(
            kind,
            name,
            *draws.pick(&[0o644, 0o755, 0, 0o6755]),
            &target,
            &content,
        )
    })
}

fn archive(draws: &mut Draws, host: &str) -> Vec<u8> {
    let mut layers: Vec<Tar> = (0..draws.below(5)).map(|_| layer(draws, host)).collect();
    let at = draws.below(layers.len() + 1);
    layers.insert(at, agent_layer());
    let image =
        TestImage::of(layers).packed(*draws.pick(&[Packing::Plain, Packing::Gzip, Packing::Zstd]));
    let tar = if draws.once_in(2) {
        image.docker()
    } else {
        image.layout()
    };
    let mut bytes = tar.bytes();
    if draws.once_in(3) {
        let words = [
            "sha256:", "layer0", "[]", "null", "manifest", "../", "linux", "0000644",
        ];
        mutate(&mut bytes, &words, draws);
    }
    bytes
}

/// No device, no set-id bit, and of what can be written no more than allowed. Links are not followed.
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
fn an_image_is_unpacked_inside_or_refused_by_the_teams_fault() {
    let scratch = host_folder();
    let root = scratch.path().canonicalize().unwrap();
    let host = root.join("h");
    fs::create_dir(&host).unwrap();
    fs::write(host.join("secret"), "secret").unwrap();
    let shown = host.to_str().unwrap();
    let met = fuzz("images", 3000, |draws| {
        let packed = write(&root, "upload", &archive(draws, shown));
        let into = root.join("out");
        let label = match unpack(&packed, &into, &LIMITS, &|| false) {
            Ok(bundle) => {
                let image = bundle.image.unwrap();
                assert_eq!(fs::read_dir(&into).unwrap().count(), 1);
                let mut unpacked = 0;
                check_tree(&image.root, &mut unpacked);
                assert!(unpacked <= 2 * LIMITS.unpacked_bytes);
                for place in ["agent", "dev", "etc", "proc", "sys", "tmp"] {
                    let metadata = image.root.join(place).symlink_metadata();
                    assert!(metadata.unwrap().is_dir(), "{place}");
                }
                "accepted".to_owned()
            }
            Err(BundleError::Invalid(told)) => {
                let told = told.split_once(": ").map_or(&*told, |(start, rest)| {
                    if start.starts_with("layer ") {
                        rest
                    } else {
                        &told
                    }
                });
                let told = match told.split_once("\" ") {
                    Some((entry, problem)) if entry.starts_with("entry") => problem,
                    _ => told,
                };
                told.chars().take(24).collect()
            }
            Err(error @ (BundleError::Io(_) | BundleError::Cancelled)) => {
                panic!("our fault: {error}")
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
    assert_met(
        &met,
        &[
            "accepted",
            "has '..' in its path",
            "is a whiteout of no poss",
            "is a hard link to \"",
            "is a hard link to what i",
            "what the image's layers ",
            "goes through more than 4",
            "the container image has ",
            "needs \"",
        ],
    );
}

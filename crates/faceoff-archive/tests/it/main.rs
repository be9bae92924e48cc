//! Tests of archives of a season: valid ones, and hostile or damaged ones.
#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod hostile;
mod round_trip;

use faceoff_archive::{Edition, Entry, FORMAT, Manifest, Writer};
use std::path::{Path, PathBuf};

/// The entry of a file with this content.
fn entry(path: &str, content: &[u8]) -> Entry {
    Entry {
        path: path.to_owned(),
        bytes: content.len() as u64,
        blake3: blake3::hash(content).to_string(),
    }
}

/// The manifest of an archive with these files.
fn manifest(files: Vec<Entry>) -> Manifest {
    Manifest {
        format: FORMAT,
        program: "faceoff 0.1.0".into(),
        season: "Season 1".into(),
        made_at: "2026-03-01T10:00:00Z".parse().unwrap(),
        edition: Edition::Public,
        left_out: vec!["nothing".into()],
        files,
    }
}

/// Files of a valid archive.
fn contents() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("README.txt", b"read me\n".to_vec()),
        ("results/1-qualifying/board.json", b"{}".to_vec()),
        ("empty", Vec::new()),
        // Longer than a read buffer, and no multiple of a tar block. The content repeats with a prime period, so that
        // all blocks differ.
        (
            "artifacts/datasets/a.zip",
            (0..700_001_u32).map(|n| (n % 251) as u8).collect(),
        ),
    ]
}

/// Writes a valid archive of [`contents`].
fn valid_archive(folder: &Path) -> (PathBuf, Manifest) {
    let contents = contents();
    let files = contents.iter().map(|(path, content)| entry(path, content));
    let manifest = manifest(files.collect());
    let mut writer = Writer::begin(Vec::new(), &manifest).unwrap();
    let find = |entry: &Entry| {
        let found = contents.iter().find(|(path, _)| *path == entry.path);
        Ok(found.unwrap().1.as_slice())
    };
    while writer.next(find).unwrap() {}
    let archive = folder.join("season.tar.zst");
    std::fs::write(&archive, writer.finish().unwrap()).unwrap();
    (archive, manifest)
}

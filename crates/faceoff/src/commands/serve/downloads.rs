//! The files of the page `/downloads`: this program, examples of agents, models of the robot for other
//! simulators, and the files of a folder.

use crate::{commands::new::example_archives, competition::robot_model_files};
use anyhow::{Context, ensure};
use faceoff_http::{Download, DownloadContent, Downloads};
use std::path::{Path, PathBuf};

/// This program, even if another version has been installed under its name since.
const THIS_PROGRAM: &str = "/proc/self/exe";

/// All files that the server offers.
///
/// # Errors
/// If the folder cannot be read.
pub(super) fn downloads(folder: Option<&Path>) -> anyhow::Result<Downloads> {
    let program = Download {
        name: "faceoff".to_owned(),
        about: format!(
            "The program faceoff {} for Linux on {}: creates, evaluates and submits agents",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::ARCH
        ),
        content: DownloadContent::File(PathBuf::from(THIS_PROGRAM)),
    };
    let mut downloads = vec![program];
    for (name, about, archive) in example_archives()? {
        downloads.push(in_memory(name, about, archive));
    }
    for (name, about, text) in robot_model_files() {
        downloads.push(in_memory(name, about, text.into_bytes()));
    }
    if let Some(folder) = folder {
        let found = files_of(folder);
        let found = found.with_context(|| {
            format!(
                "server.downloads_dir: reading the folder {}",
                folder.display()
            )
        })?;
        for download in found {
            ensure!(
                downloads.iter().all(|other| other.name != download.name),
                "server.downloads_dir: the server itself offers a file named {}; rename that in {}",
                download.name,
                folder.display()
            );
            downloads.push(download);
        }
    }
    Ok(Downloads::new(downloads))
}

fn in_memory(name: &str, about: &str, bytes: Vec<u8>) -> Download {
    Download {
        name: name.to_owned(),
        about: about.to_owned(),
        content: DownloadContent::Memory(bytes.into()),
    }
}

/// The regular files of a folder, by name. Hidden files and names that are no plain ASCII are left out: a name is part of a header.
fn files_of(folder: &Path) -> std::io::Result<Vec<Download>> {
    let mut files = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        let is_plain = name
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"._-+".contains(&byte));
        if is_plain && !name.is_empty() && !name.starts_with('.') && path.is_file() {
            files.push(Download {
                name: name.to_owned(),
                about: about(name).to_owned(),
                content: DownloadContent::File(path),
            });
        }
    }
    files.sort_by(|file, other| file.name.cmp(&other.name));
    Ok(files)
}

/// What a file is, from its extension.
fn about(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "whl")) => "Python package; install it with pip install",
        _ => "",
    }
}

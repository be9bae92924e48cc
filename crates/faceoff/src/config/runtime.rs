//! `[runtimes.NAME]`: a *runtime*, the environment that agents run in. It is a folder with a Python environment, or paths of the
//! host.

use anyhow::{Context as _, bail};
use faceoff_sandbox::{Runtime, RuntimeFiles};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Folders of the host that the sandbox replaces by private ones. `tests/runtimes.sh` has the same list.
const PRIVATE_FOLDERS: [&str; 4] = ["/tmp", "/dev", "/proc", "/agent"];

/// A runtime that the organiser offers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Fields", into = "Fields")]
pub enum RuntimeConfig {
    /// A virtual environment, e.g. one created by `docker/runtime.sh`, and its Python interpreter.
    Folder(PathBuf),
    /// Paths of the host that agents see.
    Paths {
        /// Absolute paths; see [`Runtime`].
        read_only_paths: Vec<PathBuf>,
        /// The agent's `PATH`.
        path: String,
    },
}

/// The fields in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    #[serde(skip_serializing_if = "Option::is_none")]
    folder: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    read_only_paths: Option<Vec<PathBuf>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    path: Option<String>,
}

impl TryFrom<Fields> for RuntimeConfig {
    type Error = String;

    fn try_from(fields: Fields) -> Result<Self, String> {
        match fields {
            Fields {
                folder: Some(folder),
                read_only_paths: None,
                path: None,
            } if folder.is_absolute() => Ok(Self::Folder(folder)),
            Fields {
                folder: Some(folder),
                read_only_paths: None,
                path: None,
            } => Err(format!("folder: expected an absolute path, got {folder:?}")),
            Fields {
                folder: None,
                read_only_paths: Some(read_only_paths),
                path: Some(path),
            } => Ok(Self::Paths {
                read_only_paths,
                path,
            }),
            _ => Err(
                "expected a runtime with either `folder`, or `read_only_paths` and `path`"
                    .to_owned(),
            ),
        }
    }
}

impl From<RuntimeConfig> for Fields {
    fn from(config: RuntimeConfig) -> Self {
        match config {
            RuntimeConfig::Folder(folder) => Self {
                folder: Some(folder),
                read_only_paths: None,
                path: None,
            },
            RuntimeConfig::Paths {
                read_only_paths,
                path,
            } => Self {
                folder: None,
                read_only_paths: Some(read_only_paths),
                path: Some(path),
            },
        }
    }
}

impl RuntimeConfig {
    /// Checks that the folder has a Python that starts. Paths are only checked by `faceoff doctor`.
    ///
    /// # Errors
    /// If there is no Python, or it does not start.
    pub fn check(&self) -> anyhow::Result<()> {
        match self {
            Self::Paths { .. } => Ok(()),
            Self::Folder(folder)
                if PRIVATE_FOLDERS
                    .iter()
                    .any(|private| folder.starts_with(private)) =>
            {
                bail!(
                    "expected a folder outside of {}, which agents see as private folders, got {}",
                    PRIVATE_FOLDERS.join(", "),
                    folder.display()
                )
            }
            Self::Folder(folder) => Runtime::python3_at(&interpreter(folder))
                .map(drop)
                .with_context(|| {
                    format!(
                        "expected a virtual environment in {0}; create it: docker/runtime.sh {0}",
                        folder.display()
                    )
                }),
        }
    }

    /// The runtime for the sandbox. For a folder without Python it names a path that does not exist, so that agents fail instead of
    /// using another Python.
    #[must_use]
    pub fn runtime(&self) -> Runtime {
        match self {
            Self::Folder(folder) => {
                let python = interpreter(folder);
                Runtime::python3_at(&python).unwrap_or_else(|_| Runtime {
                    read_only_paths: vec![python],
                    path: folder.join("bin").display().to_string(),
                    files: RuntimeFiles::Host,
                })
            }
            Self::Paths {
                read_only_paths,
                path,
            } => Runtime {
                read_only_paths: read_only_paths.clone(),
                path: path.clone(),
                files: RuntimeFiles::Host,
            },
        }
    }
}

fn interpreter(folder: &Path) -> PathBuf {
    folder.join("bin/python3")
}

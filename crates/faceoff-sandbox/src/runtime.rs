//! A *runtime*: the host files that agents of one kind see (e.g. a Python with its libraries), and their `PATH`.

use crate::{SandboxError, error::IoContext};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Folders of shared libraries and of the dynamic loader, as distributions lay them out. Also the links of Debian's alternatives, through
/// which libraries and programs are reached, and the time zones. On hosts with a merged /usr the short paths are links, and the sandbox has
/// the same links.
pub(crate) const LIBRARY_PATHS: [&str; 11] = [
    "/etc/alternatives",
    "/usr/share/zoneinfo",
    "/usr/lib",
    "/usr/lib32",
    "/usr/lib64",
    "/usr/libx32",
    "/lib",
    "/lib32",
    "/lib64",
    "/libx32",
    "/etc/ld.so.cache",
];

/// Paths searched for `python3`, in this order.
const PYTHON_CANDIDATES: [&str; 4] = [
    "/usr/local/bin/python3",
    "/usr/bin/python3",
    "/bin/python3",
    "/opt/python/bin/python3",
];

/// Programs that a script's first line usually names.
const SCRIPT_HELPERS: [&str; 5] = [
    "/bin",
    "/bin/sh",
    "/usr/bin/sh",
    "/usr/bin/dash",
    "/usr/bin/env",
];

/// A runtime that the organiser offers (`runtime` in `agent.toml`): the host paths that an agent sees,
/// read-only and under the same names, and its PATH.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Runtime {
    /// Absolute host paths. A symbolic link appears as the same link, so its target must be listed too.
    /// When the service runs as root, files must be world-readable, because agents run as other users.
    pub read_only_paths: Vec<PathBuf>,
    /// The agent's `PATH`.
    pub path: String,
    /// Source of the files that agents see.
    #[serde(skip)]
    pub files: RuntimeFiles,
}

/// Location of a runtime's files.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum RuntimeFiles {
    /// On the host, under the same names as in the sandbox.
    #[default]
    Host,
    /// In a folder in memory that holds a copy of them.
    Copy(PathBuf),
    /// This folder becomes the agent's root: no file of the host is mounted beside it.
    Root(PathBuf),
}

impl Runtime {
    /// Runtime of self-contained binaries: the host's shared libraries and nothing else.
    pub fn native() -> Self {
        Self {
            read_only_paths: existing_paths(&LIBRARY_PATHS),
            path: "/usr/bin:/bin".into(),
            files: RuntimeFiles::Host,
        }
    }

    /// The host's Python: the first `python3` of the usual paths that starts, with its own libraries,
    /// the system's, and `/bin/sh` and `/usr/bin/env` for scripts. `None` if there is none.
    pub fn python3() -> Option<Self> {
        PYTHON_CANDIDATES
            .iter()
            .find_map(|candidate| Self::python3_at(Path::new(candidate)).ok())
    }

    /// A Python that the organiser configures, e.g. one built in `/opt` or a virtual environment.
    ///
    /// # Errors
    /// When `interpreter` does not start or does not print its library paths.
    pub fn python3_at(interpreter: &Path) -> Result<Self, SandboxError> {
        let python = PythonLayout::ask(interpreter)?;
        let mut paths = existing_paths(&LIBRARY_PATHS);
        paths.extend(existing_paths(&SCRIPT_HELPERS));
        let folder = interpreter
            .parent()
            .unwrap_or(Path::new("/usr/bin"))
            .to_path_buf();
        for link in link_chain(interpreter) {
            push_new(&mut paths, link);
        }
        for path in python.paths() {
            push_new(&mut paths, path);
        }
        let mut path = folder.display().to_string();
        for folder in ["/usr/bin", "/bin"] {
            if !path.split(':').any(|known| known == folder) {
                path.push(':');
                path.push_str(folder);
            }
        }
        paths.sort();
        Ok(Self {
            read_only_paths: paths,
            path,
            files: RuntimeFiles::Host,
        })
    }

    /// Runtime of a container image: `root` holds its merged layers, and `path` is its `PATH`.
    ///
    /// `root` must have real folders `agent`, `dev`, `etc`, `proc`, `sys` and `tmp`, and files `etc/passwd` and
    /// `etc/group`, over which the sandbox mounts its own. Other links may point anywhere. Needs
    /// [`Layer::Namespaces`](crate::Layer::Namespaces).
    pub fn from_image(root: &Path, path: &str) -> Self {
        Self {
            read_only_paths: Vec::new(),
            path: path.to_owned(),
            files: RuntimeFiles::Root(root.to_owned()),
        }
    }

    /// The agent's root folder, if it has one of its own.
    pub(crate) fn root(&self) -> Option<&Path> {
        match &self.files {
            RuntimeFiles::Root(root) => Some(root),
            RuntimeFiles::Host | RuntimeFiles::Copy(_) => None,
        }
    }

    /// Host path of the files that the sandbox shows at `path`. A symbolic link appears as the same link.
    pub(crate) fn source(&self, path: &Path) -> PathBuf {
        match &self.files {
            RuntimeFiles::Copy(copy) if !path.is_symlink() => path_in_copy(copy, path),
            _ => path.to_owned(),
        }
    }

    /// Host path of the first `python3` in this runtime's PATH, for messages. `None` for a container image, which
    /// is not searched.
    pub fn interpreter(&self) -> Option<PathBuf> {
        if self.root().is_some() {
            return None;
        }
        self.path
            .split(':')
            .map(|folder| Path::new(folder).join("python3"))
            .find(|path| path.is_file())
    }
}

/// The path at which `copy`, the folder of [`RuntimeFiles::Copy`], holds the host's `path`.
pub(crate) fn path_in_copy(copy: &Path, path: &Path) -> PathBuf {
    copy.join(path.strip_prefix("/").unwrap_or(path))
}

/// File layout of an interpreter, as it reports it.
struct PythonLayout {
    executable: PathBuf,
    /// Installation prefix; in a virtual environment the prefix of the underlying Python.
    base_prefix: PathBuf,
    /// Prefix of the virtual environment; without one, the same as `base_prefix`.
    prefix: PathBuf,
    standard_library: PathBuf,
    packages: Vec<PathBuf>,
}

impl PythonLayout {
    fn ask(interpreter: &Path) -> Result<Self, SandboxError> {
        const SCRIPT: &str = "import sys, os, site, sysconfig\n\
            print(os.path.realpath(sys.executable))\n\
            print(sys.base_prefix)\n\
            print(sys.prefix)\n\
            print(sysconfig.get_path('stdlib'))\n\
            for p in dict.fromkeys(site.getsitepackages() + [sysconfig.get_path('platstdlib')]): print(p)";
        let action = format!("cannot ask {} for its layout", interpreter.display());
        let answer = Command::new(interpreter)
            .args(["-I", "-c", SCRIPT])
            .env_clear()
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .output()
            .context(&action)?;
        if !answer.status.success() {
            return Err(SandboxError::other(action, answer.status.to_string()));
        }
        let text = String::from_utf8_lossy(&answer.stdout);
        let mut lines = text.lines().map(PathBuf::from);
        let mut next = || {
            lines
                .next()
                .ok_or_else(|| SandboxError::other(&action, "its answer is too short"))
        };
        Ok(Self {
            executable: next()?,
            base_prefix: next()?,
            prefix: next()?,
            standard_library: next()?,
            packages: lines.collect(),
        })
    }

    /// A private prefix is shown as a whole; of `/usr` and `/usr/local` only the files of Python.
    fn paths(&self) -> Vec<PathBuf> {
        let mut paths = vec![self.executable.clone()];
        for prefix in [&self.base_prefix, &self.prefix] {
            if !is_shared_prefix(prefix) {
                paths.push(prefix.clone());
            }
        }
        paths.push(self.standard_library.clone());
        paths.extend(self.packages.iter().cloned());
        // A Python below /usr/local links its own libpython from there.
        if self.base_prefix == Path::new("/usr/local") {
            paths.push("/usr/local/lib".into());
        }
        paths.retain(|path| path.is_absolute() && path.exists());
        paths
    }
}

/// Does this prefix also contain files that are not Python's?
fn is_shared_prefix(prefix: &Path) -> bool {
    ["/", "/usr", "/usr/local"]
        .iter()
        .any(|shared| prefix == Path::new(shared))
}

/// Those of `paths` that exist, and the targets of their links.
fn existing_paths(paths: &[&str]) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    for path in paths {
        let path = PathBuf::from(path);
        // `/bin` matters only if it is a link; a real folder of programs is not shown.
        let is_shown = path != Path::new("/bin")
            || fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_symlink());
        if is_shown && path.exists() {
            for link in link_chain(&path) {
                push_new(&mut found, link);
            }
        }
    }
    // The target of `/bin` is a folder of programs: the sandbox needs the link but not the folder.
    found.retain(|path| path != Path::new("/usr/bin"));
    found
}

/// `path` and, while it is a link, its target. Links in parent folders are resolved, not listed.
fn link_chain(path: &Path) -> Vec<PathBuf> {
    let mut chain = vec![path.to_path_buf()];
    // Longer chains end in ELOOP in the kernel as well.
    for _ in 0..40 {
        let last = chain.last().cloned().unwrap_or_default();
        let Ok(target) = fs::read_link(&last) else {
            break;
        };
        let next = last.parent().unwrap_or(Path::new("/")).join(target);
        let Some(parent) = next.parent().and_then(|parent| parent.canonicalize().ok()) else {
            break;
        };
        let Some(name) = next.file_name() else { break };
        chain.push(parent.join(name));
    }
    chain
}

fn push_new(paths: &mut Vec<PathBuf>, path: PathBuf) {
    if !paths.contains(&path) {
        paths.push(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runtime_shows_no_user_or_configuration_folder() {
        let mut runtimes = vec![Runtime::native()];
        runtimes.extend(Runtime::python3());
        for path in runtimes.iter().flat_map(|runtime| &runtime.read_only_paths) {
            for hidden in [
                "/home", "/root", "/var", "/run", "/sys", "/proc", "/srv", "/mnt",
            ] {
                assert!(!path.starts_with(hidden), "{} is shown", path.display());
            }
            assert!(
                path != Path::new("/") && path != Path::new("/usr") && path != Path::new("/etc")
            );
            let shown = ["/etc/ld.so.cache", "/etc/alternatives"].map(Path::new);
            assert!(!path.starts_with("/etc") || shown.contains(&path.as_path()));
        }
    }
}

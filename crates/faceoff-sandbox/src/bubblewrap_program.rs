//! Finds the program `bwrap` of the host, and says why one that is there cannot be used.

use rustix::{
    fs::{Access, access},
    process::geteuid,
};
use std::{
    env,
    ffi::OsStr,
    io,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Where distributions and administrators install it.
const SYSTEM_PATHS: [&str; 3] = ["/usr/bin/bwrap", "/usr/local/bin/bwrap", "/bin/bwrap"];

/// Options that version 0.8 has and older ones lack.
const NEEDED_OPTIONS: [&str; 4] = [
    "--add-seccomp-fd",
    "--size ",
    "--as-pid-1",
    "--json-status-fd",
];

/// A usable `bwrap` of the host.
#[derive(Debug, Clone)]
pub(crate) struct BubblewrapProgram {
    pub path: PathBuf,
    /// Version line, e.g. `bubblewrap 0.8.0`.
    pub version: String,
    /// What it prints for `--help`.
    pub help: String,
}

/// Why no bubblewrap of the host can be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BubblewrapProblem {
    #[error("bubblewrap is not installed ({})", SYSTEM_PATHS.join(", "))]
    Missing,
    #[error("{} may not be executed by this user", .0.display())]
    NotExecutable(PathBuf),
    #[error("{} is {version}, which lacks {option}; 0.8 or newer is needed", path.display())]
    TooOld {
        path: PathBuf,
        version: String,
        option: &'static str,
    },
    #[error("{} does not start: {error}", path.display())]
    Broken { path: PathBuf, error: io::Error },
}

impl BubblewrapProblem {
    /// What to do about it.
    pub(crate) fn fix(&self) -> String {
        match self {
            Self::Missing => {
                "install bubblewrap 0.8 or newer; on Debian: apt-get install bubblewrap".to_owned()
            }
            Self::NotExecutable(path) => {
                format!(
                    "let users execute it: chmod 755 {}; if the system forbids it on purpose, ask its administrator",
                    path.display()
                )
            }
            Self::TooOld { .. } => {
                "install a newer bubblewrap, for example as /usr/local/bin/bwrap (https://github.com/containers/bubblewrap); Debian \
                 12 and newer releases have one"
                    .to_owned()
            }
            Self::Broken { path, .. } => format!(
                "replace {} by a program for this machine; on Debian: apt-get install --reinstall bubblewrap",
                path.display()
            ),
        }
    }
}

impl BubblewrapProgram {
    /// The first usable program: the system's, and for an ordinary user also those in `PATH`. Root starts only the system's.
    pub(crate) fn find() -> Result<Self, BubblewrapProblem> {
        let path = env::var_os("PATH").filter(|_| !geteuid().is_root());
        let system = SYSTEM_PATHS.map(PathBuf::from);
        Self::find_among(candidates(system, path.as_deref()))
    }

    /// The first usable one; otherwise the problem of the first one that exists.
    fn find_among(candidates: impl Iterator<Item = PathBuf>) -> Result<Self, BubblewrapProblem> {
        let mut problem = None;
        for path in candidates.filter(|path| path.is_file()) {
            match Self::check(path) {
                Ok(program) => return Ok(program),
                Err(found) => problem = problem.or(Some(found)),
            }
        }
        Err(problem.unwrap_or(BubblewrapProblem::Missing))
    }

    fn check(path: PathBuf) -> Result<Self, BubblewrapProblem> {
        if access(&path, Access::EXEC_OK).is_err() {
            return Err(BubblewrapProblem::NotExecutable(path));
        }
        let help = match output_of(&path, "--help") {
            Ok(help) => help,
            Err(error) => return Err(BubblewrapProblem::Broken { path, error }),
        };
        let version = output_of(&path, "--version").unwrap_or_default();
        let version = match version.trim() {
            "" => "a bubblewrap of unknown version",
            version => version,
        };
        let version = version.to_owned();
        match NEEDED_OPTIONS
            .iter()
            .find(|option| !help.contains(**option))
        {
            Some(option) => Err(BubblewrapProblem::TooOld {
                path,
                version,
                option: option.trim(),
            }),
            None => Ok(Self {
                path,
                version,
                help,
            }),
        }
    }
}

fn candidates(
    system: impl IntoIterator<Item = PathBuf>,
    path: Option<&OsStr>,
) -> impl Iterator<Item = PathBuf> {
    let folders: Vec<PathBuf> = path.map_or_else(Vec::new, |path| env::split_paths(path).collect());
    let own = folders.into_iter().filter(|folder| folder.is_absolute());
    system
        .into_iter()
        .chain(own.map(|folder| folder.join("bwrap")))
}

fn output_of(program: &Path, option: &str) -> io::Result<String> {
    let output = Command::new(program)
        .arg(option)
        .env_clear()
        .stdin(Stdio::null())
        .output()?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{fs, os::unix::fs::PermissionsExt as _};
    use tempfile::TempDir;

    const NEW: &str = "echo '--add-seccomp-fd --size BYTES --as-pid-1 --json-status-fd'";
    const OLD: &str = "case $1 in --version) echo bubblewrap 0.3.0;; *) echo '--as-pid-1 --json-status-fd';; esac";

    /// A folder with a `bwrap` that runs these commands.
    fn installed(commands: &str, mode: u32) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("bwrap");
        fs::write(&program, format!("#!/bin/sh\n{commands}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(mode)).unwrap();
        folder
    }

    fn find(system: &TempDir, path: Option<&TempDir>) -> Result<PathBuf, String> {
        let path = path.map(|folder| folder.path().as_os_str());
        let system = [system.path().join("bwrap")];
        let found = BubblewrapProgram::find_among(candidates(system, path));
        found
            .map(|program| program.path)
            .map_err(|problem| format!("{problem}; {}", problem.fix()))
    }

    #[test]
    fn usable_bubblewrap_in_path_replaces_an_old_one() {
        let (old, new) = (installed(OLD, 0o755), installed(NEW, 0o755));
        assert_eq!(find(&new, None), Ok(new.path().join("bwrap")));
        assert_eq!(find(&old, Some(&new)), Ok(new.path().join("bwrap")));
        let error = find(&old, None).unwrap_err();
        for part in [
            "bubblewrap 0.3.0",
            "--add-seccomp-fd",
            "0.8 or newer",
            "newer bubblewrap",
        ] {
            assert!(error.contains(part), "{error}");
        }
        assert!(!error.contains("apt-get install bubblewrap"), "{error}");
    }

    #[test]
    fn fix_of_an_unusable_bubblewrap_fits_its_cause() {
        let empty = tempfile::tempdir().unwrap();
        let error = find(&empty, None).unwrap_err();
        assert!(error.contains("apt-get install bubblewrap"), "{error}");
        let closed = installed(NEW, 0o644);
        let error = find(&closed, None).unwrap_err();
        assert!(error.contains("chmod 755"), "{error}");
        let broken = installed(NEW, 0o755);
        fs::write(broken.path().join("bwrap"), b"\x7fELF of another machine").unwrap();
        let error = find(&broken, None).unwrap_err();
        assert!(
            error.contains("--reinstall") && error.contains("does not start"),
            "{error}"
        );
        let relative = candidates([], Some(OsStr::new("bin:/opt/bin")));
        assert_eq!(relative.collect::<Vec<_>>(), [Path::new("/opt/bin/bwrap")]);
    }
}

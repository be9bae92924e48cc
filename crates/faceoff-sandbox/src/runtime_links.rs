//! Links of a runtime that lead to files which agents do not see.
//!
//! Distributions keep parts of a program elsewhere and link to them, as from `/usr/lib/jvm` to `/etc`. Inside the sandbox such a link leads
//! nowhere, and the program fails with an error that names neither the link nor its target.

use crate::{Runtime, runtime::LIBRARY_PATHS};
use rustix::fs::{Mode, OFlags, ResolveFlags, open, openat2};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// Most folder entries that a search examines.
const MAX_ENTRIES: usize = 500_000;
/// Most links that are followed from one name to a program.
const MAX_LINKS: usize = 40;
/// Targets that agree in this many components of their paths, with the root as the first, are reported as one: `/etc/java-17-openjdk`.
const GROUP_COMPONENTS: usize = 3;
/// The same below `/usr`: `/usr/share/nodejs`.
const GROUP_COMPONENTS_BELOW_USR: usize = 4;

/// Links into one folder that agents do not see.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HiddenTarget {
    /// The folder or file on the host.
    pub path: PathBuf,
    /// One of the links.
    pub link: PathBuf,
    /// Number of links.
    pub links: usize,
}

impl Runtime {
    /// Targets of this runtime's links that agents do not see, the folder with most links first. Dangling links are left out. In the
    /// system's library folders, only the folders of the runtime's own programs are searched.
    #[must_use]
    pub fn hidden_targets(&self) -> Vec<HiddenTarget> {
        let mut found: BTreeMap<PathBuf, HiddenTarget> = BTreeMap::new();
        let is_system = |path: &Path| LIBRARY_PATHS.iter().any(|system| path == Path::new(system));
        let mut folders = self.read_only_paths.clone();
        // Folders of the system are not searched. Those that are links themselves, as `/lib64` to `/usr/lib64`, are examined as links.
        folders.retain(|path| !is_system(path) || path.is_symlink());
        let programs: Vec<_> = folders
            .iter()
            .filter_map(|path| home_of_program(path))
            .collect();
        folders.extend(programs);
        let mut entry_count = 0;
        while let Some(path) = folders.pop() {
            let Ok(kind) = fs::symlink_metadata(&path).map(|found| found.file_type()) else {
                continue;
            };
            if kind.is_symlink() {
                if let Some(target) = self.hidden_target(&path) {
                    let components = if target.starts_with("/usr") {
                        GROUP_COMPONENTS_BELOW_USR
                    } else {
                        GROUP_COMPONENTS
                    };
                    let group: PathBuf = target.components().take(components).collect();
                    let hidden = found.entry(group.clone()).or_insert(HiddenTarget {
                        path: group,
                        link: path,
                        links: 0,
                    });
                    hidden.links += 1;
                }
            } else if kind.is_dir() && entry_count < MAX_ENTRIES {
                let children = fs::read_dir(&path).into_iter().flatten().flatten();
                let before = folders.len();
                folders.extend(children.map(|child| child.path()));
                entry_count += folders.len() - before;
            }
        }
        let mut found: Vec<_> = found.into_values().collect();
        found.sort_by(|one, other| (other.links, &one.path).cmp(&(one.links, &other.path)));
        found
    }

    /// Why a program of this runtime cannot start: `search_path` has no folder with it, or it is a link that leads out of the runtime.
    pub(crate) fn reason_program_is_missing(
        &self,
        program: &str,
        search_path: &str,
    ) -> Option<String> {
        for folder in search_path.split(':') {
            if let Some(root) = self.root() {
                if exists_in(root, &Path::new(folder).join(program)) {
                    return None;
                }
                continue;
            }
            // The bundle may set PATH. Only folders that agents see are examined below, or the message would reveal other files of the
            // host.
            let Ok(folder) = fs::canonicalize(folder) else {
                continue;
            };
            let mut path = folder.join(program);
            for _ in 0..MAX_LINKS {
                if !self.shows(&path) || fs::symlink_metadata(&path).is_err() {
                    break;
                }
                if let Some(target) = self.hidden_target(&path) {
                    return Some(format!(
                        "{} is a link to {}, which agents do not see; the organisers add that to `read_only_paths` of the runtime",
                        path.display(),
                        target.display()
                    ));
                }
                let Ok(target) = fs::read_link(&path) else {
                    return None;
                };
                let target = path.parent().unwrap_or(Path::new("/")).join(target);
                let folder = target
                    .parent()
                    .and_then(|folder| fs::canonicalize(folder).ok());
                let (Some(folder), Some(name)) = (folder, target.file_name()) else {
                    return None;
                };
                path = folder.join(name);
            }
        }
        Some(format!(
            "it is in none of the folders of PATH, {search_path}"
        ))
    }

    /// Is `path`, whose folder is canonical, in one that agents see?
    fn shows(&self, path: &Path) -> bool {
        self.read_only_paths
            .iter()
            .any(|shown| path.starts_with(shown))
    }

    /// The target of a link, if it exists and agents do not see it.
    fn hidden_target(&self, link: &Path) -> Option<PathBuf> {
        let target = link.parent()?.join(fs::read_link(link).ok()?);
        let folder = fs::canonicalize(target.parent()?).ok()?;
        let target = folder.join(target.file_name()?);
        let is_visible = self.shows(&target)
            || self
                .read_only_paths
                .iter()
                .any(|path| fs::canonicalize(path).is_ok_and(|path| target.starts_with(path)));
        (!is_visible && target.exists()).then_some(target)
    }
}

/// Is there a file at this path in an image? Links are followed inside of the image only.
fn exists_in(root: &Path, path: &Path) -> bool {
    let folder = open(
        root,
        OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC,
        Mode::empty(),
    );
    let flags = OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let within = ResolveFlags::IN_ROOT | ResolveFlags::NO_MAGICLINKS;
    folder.is_ok_and(|folder| openat2(folder, path, flags, Mode::empty(), within).is_ok())
}

/// The folder in which a program is installed, if it has one of its own: `/usr/lib/jvm/java` for `/usr/lib/jvm/java/bin/java`. Links in
/// `path` are followed.
fn home_of_program(path: &Path) -> Option<PathBuf> {
    let program = fs::canonicalize(path).ok().filter(|path| path.is_file())?;
    let folder = program.parent()?;
    let home = folder.parent().filter(|_| folder.ends_with("bin"))?;
    let is_shared = ["/", "/usr", "/usr/local"]
        .iter()
        .any(|shared| home == Path::new(shared));
    (!is_shared).then(|| home.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RuntimeFiles;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_out_of_a_runtime_are_found() {
        let host = tempfile::tempdir().unwrap();
        let path = |name: &str| host.path().join(name);
        fs::create_dir_all(path("lib/program")).unwrap();
        fs::create_dir_all(path("settings")).unwrap();
        for file in ["settings/one", "settings/two", "lib/inside"] {
            fs::write(path(file), "").unwrap();
        }
        symlink(path("settings/one"), path("lib/program/one")).unwrap();
        symlink("../../settings/two", path("lib/program/two")).unwrap();
        symlink("../inside", path("lib/program/inside")).unwrap();
        symlink("../../nowhere", path("lib/program/broken")).unwrap();
        let runtime = |paths: &[&str]| Runtime {
            read_only_paths: paths.iter().map(|name| path(name)).collect(),
            path: String::new(),
            files: RuntimeFiles::Host,
        };
        let hidden = runtime(&["lib"]).hidden_targets();
        let links: usize = hidden.iter().map(|target| target.links).sum();
        assert_eq!(links, 2, "{hidden:?}");
        assert!(path("settings/one").starts_with(&hidden[0].path));
        assert_eq!(runtime(&["lib", "settings"]).hidden_targets(), []);
        // A program that is reached by a link, as Java in /usr/bin.
        fs::create_dir(path("lib/program/bin")).unwrap();
        fs::write(path("lib/program/bin/run"), "").unwrap();
        symlink("lib/program/bin/run", path("run")).unwrap();
        let by_program = runtime(&["run", "lib/program/bin"]).hidden_targets();
        let links: usize = by_program.iter().map(|target| target.links).sum();
        // Two links into the settings, one to `inside`.
        assert_eq!(links, 3, "{by_program:?}");
        symlink(path("settings/one"), path("lib/elsewhere")).unwrap();
        let folder = path("lib").display().to_string();
        let reason = runtime(&["lib"])
            .reason_program_is_missing("elsewhere", &folder)
            .unwrap();
        assert!(
            reason.contains("settings/one, which agents do not see"),
            "{reason}"
        );
        let reason = runtime(&["lib"])
            .reason_program_is_missing("nothing", &folder)
            .unwrap();
        assert_eq!(
            reason,
            format!("it is in none of the folders of PATH, {folder}")
        );
    }
}

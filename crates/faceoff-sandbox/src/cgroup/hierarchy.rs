//! Cgroup hierarchies of the host. A *controller* limits one resource, such as memory; a *hierarchy* is a mounted tree of cgroups with
//! one or more controllers. This module finds them, and the place where the *service* (the process that starts
//! agents) can create cgroups.

use super::{NOT_OFFERED, files};
use crate::{SandboxError, error::IoContext};
use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

/// Version of the kernel's cgroup interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    V1,
    V2,
}

impl Version {
    /// Weight file and value: ten times the default. Beside a runnable thread of default priority on the same CPU,
    /// agents get ten of eleven parts. With a higher weight, an agent that never sleeps would starve a service that
    /// has no other CPU.
    const fn agents_weight(self) -> (&'static str, &'static str) {
        match self {
            Self::V1 => ("cpu.shares", "10240"),
            Self::V2 => ("cpu.weight", "1000"),
        }
    }
}

/// A controller's hierarchy as the service sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Hierarchy {
    pub version: Version,
    /// Mount point: the cgroup that contains all visible cgroups.
    pub mount_point: PathBuf,
    /// Folder of the service's own cgroup.
    pub service_dir: PathBuf,
}

/// Name of the folder for agents in the service's cgroup.
pub(super) const AGENTS_FOLDER: &str = "faceoff";
/// Name of the cgroup to which the service itself moves, because in v2 inner cgroups must not contain processes.
const SERVICE_LEAF: &str = "faceoff-service";

impl Hierarchy {
    /// Finds `controller` (`memory`, `pids`, `cpu`, `cpuacct`, `cpuset`, `freezer`) in the text of
    /// `/proc/self/mountinfo` and `/proc/self/cgroup`. v1 takes precedence: a controller is in one hierarchy only,
    /// and the v2 hierarchy of a hybrid host has the controllers that v1 does not use.
    pub(super) fn find(controller: &str, mountinfo: &str, own_cgroups: &str) -> Option<Self> {
        let v1 = mountinfo.lines().filter_map(Mount::parse).find(|mount| {
            mount.filesystem == "cgroup"
                && mount.options.split(',').any(|option| option == controller)
        });
        if let Some(mount) = v1 {
            let own_cgroup = own_cgroups.lines().find_map(|line| {
                let mut parts = line.splitn(3, ':');
                let names = parts.nth(1)?;
                names
                    .split(',')
                    .any(|name| name == controller)
                    .then(|| parts.next())
                    .flatten()
            })?;
            return Some(Self {
                version: Version::V1,
                mount_point: mount.point.into(),
                service_dir: mount.resolve(own_cgroup),
            });
        }
        let mount = mountinfo
            .lines()
            .filter_map(Mount::parse)
            .find(|mount| mount.filesystem == "cgroup2")?;
        let own_cgroup = own_cgroups
            .lines()
            .find_map(|line| line.strip_prefix("0::"))?;
        let mut service_dir = mount.resolve(own_cgroup);
        if service_dir.ends_with(SERVICE_LEAF) {
            service_dir.pop();
        }
        Some(Self {
            version: Version::V2,
            mount_point: mount.point.into(),
            service_dir,
        })
    }

    /// Creates the folder for agents and enables `controllers` in it.
    pub(super) fn create_agents_folder(&self, controllers: &[&str]) -> io::Result<PathBuf> {
        let folder = self.service_dir.join(AGENTS_FOLDER);
        if self.version == Version::V2 {
            self.delegate(&self.service_dir, controllers)?;
        }
        match fs::create_dir(&folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        if controllers.contains(&"cpu") {
            let (file, weight) = self.version.agents_weight();
            // Best effort: without the weight, times are less even, and no result is wrong.
            let _ = fs::write(folder.join(file), weight);
        }
        if self.version == Version::V2 {
            self.delegate(&folder, controllers)?;
        } else if controllers.contains(&"cpuset") {
            // A new v1 cpuset is empty, and processes cannot enter an empty one.
            for name in ["cpuset.mems", "cpuset.cpus"] {
                let parent_value = files::read(&self.service_dir.join(name))?;
                fs::write(folder.join(name), parent_value.trim())?;
            }
        }
        Ok(folder)
    }

    /// Version 2 only: enables `controllers` for the children of `dir`.
    fn delegate(&self, dir: &Path, controllers: &[&str]) -> io::Result<()> {
        let offered = files::read(&dir.join("cgroup.controllers"))?;
        if let Some(missing) = controllers.iter().find(|name| !has_word(&offered, name)) {
            return Err(io::Error::new(
                io::ErrorKind::Unsupported,
                format!("{} {NOT_OFFERED} {missing}", dir.display()),
            ));
        }
        let control = dir.join("cgroup.subtree_control");
        let enabled = files::read(&control)?;
        let missing: Vec<_> = controllers
            .iter()
            .filter(|name| !has_word(&enabled, name))
            .map(|name| format!("+{name}"))
            .collect();
        if missing.is_empty() {
            return Ok(());
        }
        // A cgroup with processes cannot enable memory for its children (EBUSY). If it enables only pids and cpu, it
        // becomes threaded, and agents cannot enter a child (EOPNOTSUPP). Only the hierarchy's real root, which has
        // no type, may have processes and enabled controllers.
        if dir.join("cgroup.type").exists() {
            move_processes_out(dir)?;
        }
        let enable = || fs::write(&control, missing.join(" "));
        match enable() {
            // A process has been forked there in the meantime.
            Err(error)
                if error.kind() == io::ErrorKind::ResourceBusy
                    || error.raw_os_error() == Some(libc::EOPNOTSUPP) =>
            {
                move_processes_out(dir)?;
                enable()
            }
            result => result,
        }
    }
}

/// Version 2 only: moves the processes of the service's own cgroup into a child cgroup beside the agents' folder.
fn move_processes_out(dir: &Path) -> io::Result<()> {
    let processes = files::processes(dir);
    if processes.is_empty() {
        return Ok(());
    }
    let leaf = dir.join(SERVICE_LEAF);
    match fs::create_dir(&leaf) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    for pid in processes {
        match fs::write(leaf.join("cgroup.procs"), pid.to_string()) {
            // It has ended in the meantime.
            Err(error) if error.raw_os_error() == Some(libc::ESRCH) => {}
            result => result?,
        }
    }
    Ok(())
}

/// The host's hierarchies, read once per agent.
pub(super) struct Hierarchies {
    mountinfo: String,
    own_cgroups: String,
    /// Cache of [`Self::find`].
    found: RefCell<BTreeMap<String, Option<Hierarchy>>>,
}

impl Hierarchies {
    pub(super) fn read() -> Result<Self, SandboxError> {
        let read =
            |path: &str| fs::read_to_string(path).context(format_args!("cannot read {path}"));
        Ok(Self {
            mountinfo: read("/proc/self/mountinfo")?,
            own_cgroups: read("/proc/self/cgroup")?,
            found: RefCell::default(),
        })
    }

    pub(super) fn find(&self, controller: &str) -> Option<Hierarchy> {
        let mut found = self.found.borrow_mut();
        found
            .entry(controller.to_owned())
            .or_insert_with(|| Hierarchy::find(controller, &self.mountinfo, &self.own_cgroups))
            .clone()
    }
}

fn has_word(text: &str, word: &str) -> bool {
    text.split_whitespace().any(|found| found == word)
}

/// One line of `/proc/self/mountinfo`.
struct Mount<'a> {
    /// The mounted folder of the file system.
    root: &'a str,
    /// Where it is mounted.
    point: &'a str,
    filesystem: &'a str,
    options: &'a str,
}

impl<'a> Mount<'a> {
    fn parse(line: &'a str) -> Option<Self> {
        let (mount_fields, filesystem_fields) = line.split_once(" - ")?;
        let mut mount_fields = mount_fields.split(' ').skip(3);
        let mut filesystem_fields = filesystem_fields.split(' ');
        Some(Self {
            root: mount_fields.next()?,
            point: mount_fields.next()?,
            filesystem: filesystem_fields.next()?,
            options: filesystem_fields.nth(1)?,
        })
    }

    /// The host path of the cgroup that the kernel names `cgroup`. A container may mount only its own part, or see a
    /// name from outside of it.
    fn resolve(&self, cgroup: &str) -> PathBuf {
        let relative = Path::new(cgroup)
            .strip_prefix(self.root)
            .unwrap_or(Path::new(""));
        let path = Path::new(self.point).join(relative.strip_prefix("/").unwrap_or(relative));
        if path.is_dir() || relative.as_os_str().is_empty() {
            path
        } else {
            self.point.into()
        }
    }
}

#[cfg(test)]
mod tests;

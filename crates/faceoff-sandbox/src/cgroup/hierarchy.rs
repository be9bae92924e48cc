//! Where on this host each controller is, and where in it the service may make cgroups.

use super::files;
use crate::{SandboxError, error::IoContext};
use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

/// Which of the kernel's two interfaces a cgroup speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    V1,
    V2,
}

impl Version {
    /// Ten times the ordinary one: beside a thread of ordinary priority that wants the same CPU, agents
    /// have ten of eleven parts. With more, one that never sleeps would starve a service that has no
    /// other CPU.
    const fn weight_of_agents(self) -> (&'static str, &'static str) {
        match self {
            Self::V1 => ("cpu.shares", "10240"),
            Self::V2 => ("cpu.weight", "1000"),
        }
    }
}

/// A controller's hierarchy, seen from the service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Home {
    pub version: Version,
    /// Where it is mounted: the cgroup of everything that can be seen from here.
    pub top: PathBuf,
    /// The service's own cgroup in it.
    pub own: PathBuf,
}

/// The folder that holds all agents of one service's cgroup.
pub(super) const FOLDER: &str = "faceoff";
/// Where the service itself moves when v2 asks that inner cgroups hold no processes.
const SERVICE_LEAF: &str = "faceoff-service";

impl Home {
    /// Finds `controller` (`memory`, `pids`, `cpu`, `cpuacct`, `cpuset`) from the text of
    /// `/proc/self/mountinfo` and `/proc/self/cgroup`. v1 wins: a controller is in one hierarchy only,
    /// and the v2 one of a hybrid host lists what v1 has left over.
    pub(super) fn find(controller: &str, mountinfo: &str, own_cgroups: &str) -> Option<Self> {
        let v1 = mountinfo.lines().filter_map(Mount::parse).find(|mount| {
            mount.filesystem == "cgroup"
                && mount.options.split(',').any(|option| option == controller)
        });
        if let Some(mount) = v1 {
            let own = own_cgroups.lines().find_map(|line| {
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
                top: mount.point.into(),
                own: mount.path_of(own),
            });
        }
        let mount = mountinfo
            .lines()
            .filter_map(Mount::parse)
            .find(|mount| mount.filesystem == "cgroup2")?;
        let own = own_cgroups
            .lines()
            .find_map(|line| line.strip_prefix("0::"))?;
        let mut own = mount.path_of(own);
        if own.ends_with(SERVICE_LEAF) {
            own.pop();
        }
        Some(Self {
            version: Version::V2,
            top: mount.point.into(),
            own,
        })
    }

    /// The folder for agents, made ready to hold `controllers`.
    pub(super) fn prepare_folder(&self, controllers: &[&str]) -> io::Result<PathBuf> {
        let folder = self.own.join(FOLDER);
        if self.version == Version::V2 {
            self.delegate(&self.own, controllers)?;
        }
        match fs::create_dir(&folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        if controllers.contains(&"cpu") {
            let (file, weight) = self.version.weight_of_agents();
            // Without it times are less even, and nothing is wrong.
            let _ = fs::write(folder.join(file), weight);
        }
        if self.version == Version::V2 {
            self.delegate(&folder, controllers)?;
        } else if controllers.contains(&"cpuset") {
            // A v1 cpuset starts empty, and tasks cannot enter an empty one.
            for name in ["cpuset.mems", "cpuset.cpus"] {
                let of_parent = files::read(&self.own.join(name))?;
                fs::write(folder.join(name), of_parent.trim())?;
            }
        }
        Ok(folder)
    }

    /// v2: lets the children of `dir` have `controllers`.
    fn delegate(&self, dir: &Path, controllers: &[&str]) -> io::Result<()> {
        let offered = files::read(&dir.join("cgroup.controllers"))?;
        if let Some(missing) = controllers.iter().find(|name| !has_word(&offered, name)) {
            return Err(io::Error::new(
                io::ErrorKind::Unsupported,
                format!("{} does not offer the controller {missing}", dir.display()),
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
        // A cgroup with processes cannot distribute memory (EBUSY), and one that distributes only pids and cpu becomes a threaded one,
        // below which no agent can be put (EOPNOTSUPP). Only the hierarchy's real top, which has no type, may have both.
        if dir.join("cgroup.type").exists() {
            make_room(dir)?;
        }
        let give_out = || fs::write(&control, missing.join(" "));
        match give_out() {
            // One more has been born there meanwhile.
            Err(error)
                if error.kind() == io::ErrorKind::ResourceBusy
                    || error.raw_os_error() == Some(libc::EOPNOTSUPP) =>
            {
                make_room(dir)?;
                give_out()
            }
            result => result,
        }
    }
}

/// v2: moves whatever lives in the service's own cgroup into a leaf beside the agents'.
fn make_room(dir: &Path) -> io::Result<()> {
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
            // It has ended meanwhile.
            Err(error) if error.raw_os_error() == Some(libc::ESRCH) => {}
            result => result?,
        }
    }
    Ok(())
}

/// The host's hierarchies, read once per agent.
pub(super) struct Hierarchies {
    mountinfo: String,
    own: String,
    found: RefCell<BTreeMap<String, Option<Home>>>,
}

impl Hierarchies {
    pub(super) fn read() -> Result<Self, SandboxError> {
        let read =
            |path: &str| fs::read_to_string(path).context(format_args!("cannot read {path}"));
        Ok(Self {
            mountinfo: read("/proc/self/mountinfo")?,
            own: read("/proc/self/cgroup")?,
            found: RefCell::default(),
        })
    }

    pub(super) fn find(&self, controller: &str) -> Option<Home> {
        let mut found = self.found.borrow_mut();
        found
            .entry(controller.to_owned())
            .or_insert_with(|| Home::find(controller, &self.mountinfo, &self.own))
            .clone()
    }
}

fn has_word(text: &str, word: &str) -> bool {
    text.split_whitespace().any(|found| found == word)
}

/// One line of `/proc/self/mountinfo`.
struct Mount<'a> {
    /// Which folder of the file system is mounted.
    root: &'a str,
    point: &'a str,
    filesystem: &'a str,
    options: &'a str,
}

impl<'a> Mount<'a> {
    fn parse(line: &'a str) -> Option<Self> {
        let (before, after) = line.split_once(" - ")?;
        let mut before = before.split(' ').skip(3);
        let mut after = after.split(' ');
        Some(Self {
            root: before.next()?,
            point: before.next()?,
            filesystem: after.next()?,
            options: after.nth(1)?,
        })
    }

    /// The host path of the cgroup that the kernel calls `cgroup`. Containers may mount only their own
    /// part, or show a name from outside of it.
    fn path_of(&self, cgroup: &str) -> PathBuf {
        let inside = Path::new(cgroup)
            .strip_prefix(self.root)
            .unwrap_or(Path::new(""));
        let path = Path::new(self.point).join(inside.strip_prefix("/").unwrap_or(inside));
        if path.is_dir() || inside.as_os_str().is_empty() {
            path
        } else {
            self.point.into()
        }
    }
}

#[cfg(test)]
mod tests;

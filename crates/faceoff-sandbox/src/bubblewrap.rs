//! Finds bubblewrap and writes its command line.

use crate::{
    Layer, SandboxError, SpawnSpec,
    cpu_view::CpuView,
    error::IoContext,
    private_mounts::PrivateMounts,
    seccomp::{self, Filters},
};
use rustix::fs::{MemfdFlags, memfd_create};
use std::{
    ffi::OsString,
    fs,
    io::{self, Seek, Write},
    os::fd::{AsRawFd, OwnedFd},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
};

const CANDIDATES: [&str; 3] = ["/usr/bin/bwrap", "/usr/local/bin/bwrap", "/bin/bwrap"];
pub(crate) const CURE_INSTALL: &str = "apt-get install bubblewrap";

/// User and group id inside; nobody special.
const INNER_ID: &str = "1000";
const PASSWD: &str = "agent:x:1000:1000:agent:/tmp:/bin/sh\n";
const GROUP: &str = "agent:x:1000:\n";

/// Settings and counters of the whole host (asynchronous input, terminals, open files …), and terminals
/// themselves, whose number all agents share.
const HIDDEN_FOLDERS: [&str; 4] = ["/proc/sys", "/proc/pressure", "/proc/fs", "/dev/pts"];
/// Counters of the whole host, locks among them.
const HIDDEN_FILES: [&str; 17] = [
    "/proc/locks",
    "/proc/vmstat",
    "/proc/interrupts",
    "/proc/softirqs",
    "/proc/buddyinfo",
    "/proc/pagetypeinfo",
    "/proc/zoneinfo",
    "/proc/slabinfo",
    "/proc/vmallocinfo",
    "/proc/diskstats",
    "/proc/schedstat",
    "/proc/cgroups",
    "/proc/keys",
    "/proc/key-users",
    "/proc/timer_list",
    "/proc/allocinfo",
    "/proc/swaps",
];

/// What ordinary libraries read of the host's counters: agents see them as they were before the first agent,
/// for they also count what agents do (the processes that were ever started, say). Of CPUs they tell those that
/// are the agent's.
const FROZEN_FILES: [&str; 5] = [
    "/proc/stat",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/proc/loadavg",
    "/proc/uptime",
];

/// An installed bubblewrap and what it can do.
#[derive(Debug, Clone)]
pub(crate) struct Bubblewrap {
    pub program: PathBuf,
    /// e.g. `bubblewrap 0.8.0`
    pub version: String,
    /// Forbids further user namespaces inside, beside the filter.
    disables_user_namespaces: bool,
}

impl Bubblewrap {
    /// The host's bubblewrap; asked once per process.
    pub(crate) fn find() -> Result<&'static Self, SandboxError> {
        static FOUND: OnceLock<Bubblewrap> = OnceLock::new();
        if let Some(found) = FOUND.get() {
            return Ok(found);
        }
        let program = CANDIDATES
            .iter()
            .map(Path::new)
            .find(|path| path.is_file())
            .ok_or_else(|| SandboxError::Unavailable {
                layer: Layer::Namespaces,
                why: format!(
                    "bubblewrap is not installed ({}); install it: {CURE_INSTALL}",
                    CANDIDATES.join(", ")
                ),
            })?;
        let ask = |option: &str| {
            Command::new(program)
                .arg(option)
                .env_clear()
                .stdin(Stdio::null())
                .output()
                .map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
                .context(format_args!("cannot run {}", program.display()))
        };
        let help = ask("--help")?;
        for option in [
            "--add-seccomp-fd",
            "--size ",
            "--as-pid-1",
            "--json-status-fd",
        ] {
            if !help.contains(option) {
                return Err(SandboxError::Unavailable {
                    layer: Layer::Namespaces,
                    why: format!(
                        "{} lacks {}; bubblewrap 0.8 or newer is needed",
                        program.display(),
                        option.trim()
                    ),
                });
            }
        }
        Ok(FOUND.get_or_init(|| Self {
            program: program.to_path_buf(),
            version: ask("--version")
                .map(|text| text.trim().to_owned())
                .unwrap_or_default(),
            disables_user_namespaces: help.contains("--disable-userns"),
        }))
    }

    /// The command line for `spec`, with what the child needs for it. `private_mounts`: bubblewrap runs
    /// as a user who may be unable to reach the files by name.
    pub(crate) fn command(
        &self,
        spec: &SpawnSpec,
        status: OwnedFd,
        filters: Option<&Filters>,
        private_mounts: bool,
    ) -> Result<Invocation, SandboxError> {
        let mut line = CommandLine {
            args: Vec::new(),
            inherit: Vec::new(),
            mounts: private_mounts.then(PrivateMounts::default),
        };
        line.args([
            "--unshare-user",
            "--unshare-ipc",
            "--unshare-pid",
            "--unshare-net",
            "--unshare-uts",
        ]);
        line.args([
            "--unshare-cgroup",
            "--uid",
            INNER_ID,
            "--gid",
            INNER_ID,
            "--hostname",
            "agent",
        ]);
        if self.disables_user_namespaces {
            line.args(["--disable-userns"]);
        }
        // The agent is its namespace's first process: when it ends, all it left behind ends with it. And
        // no helper of bubblewrap, which no filter binds, is inside to be taken over.
        line.args([
            "--as-pid-1",
            "--die-with-parent",
            "--new-session",
            "--cap-drop",
            "ALL",
            "--clearenv",
        ]);
        line.fd("--json-status-fd", status);
        let root = spec.runtime.root();
        if let Some(root) = root {
            check_own_places(root)?;
            line.read_only(root, Path::new("/"))?;
        }
        for path in mount_order(&spec.runtime.read_only_paths) {
            line.read_only(&spec.runtime.source(&path), &path)?;
        }
        line.args(["--proc", "/proc", "--dev", "/dev"]);
        line.hide_counters();
        let cpus = CpuView::of(&spec.cpus, &spec.limits);
        line.freeze_counters(&cpus)?;
        // Nothing can be made in a root of the agent's own.
        if root.is_some() {
            line.args(["--perms", "0755", "--size", "65536", "--tmpfs", "/sys"]);
        }
        for (path, list) in cpus.lists() {
            line.file(path, &list)?;
        }
        if root.is_some() {
            line.args(["--remount-ro", "/sys"]);
        }
        let scratch = spec.limits.scratch_bytes.max(4096).to_string();
        for folder in ["/dev/shm", "/tmp"] {
            line.args(["--perms", "0700", "--size", &scratch, "--tmpfs", folder]);
        }
        for (path, content) in [("/etc/passwd", PASSWD), ("/etc/group", GROUP)] {
            if root.is_some() {
                line.cover(path, content.as_bytes())?;
            } else {
                line.file(path, content.as_bytes())?;
            }
        }
        line.read_only(&spec.bundle_dir, Path::new("/agent"))?;
        line.args([
            "--chdir",
            "/agent",
            "--remount-ro",
            "/dev",
            "--remount-ro",
            "/",
        ]);
        for (name, value) in environment(spec, "/tmp") {
            line.args(["--setenv", &name, &value]);
        }
        if let Some(filters) = filters {
            for program in filters.in_order() {
                let fd = memory_file(&seccomp::to_bytes(program))?;
                line.fd("--add-seccomp-fd", fd);
            }
        }
        line.args(["--"]);
        line.args(spec.command.iter().map(String::as_str));
        let mut command = Command::new(&self.program);
        // bubblewrap itself sees nothing of the bundle's variables: LD_PRELOAD would work on it outside.
        command.args(line.args).env_clear().current_dir("/");
        Ok(Invocation {
            command,
            inherit: line.inherit,
            mounts: line.mounts,
        })
    }
}

/// bubblewrap's command, and what its process needs before the exec.
#[derive(Debug)]
pub(crate) struct Invocation {
    pub command: Command,
    pub inherit: Vec<OwnedFd>,
    pub mounts: Option<PrivateMounts>,
}

/// The agent's variables; the bundle's own come last, and may replace all others.
pub(crate) fn environment(spec: &SpawnSpec, home: &str) -> Vec<(String, String)> {
    let mut variables = std::collections::BTreeMap::from([
        ("PATH".to_owned(), spec.runtime.path.clone()),
        ("HOME".to_owned(), home.to_owned()),
        ("TMPDIR".to_owned(), home.to_owned()),
        ("USER".to_owned(), "agent".to_owned()),
        ("LOGNAME".to_owned(), "agent".to_owned()),
        ("LANG".to_owned(), "C.UTF-8".to_owned()),
        // A thread of ONNX Runtime's would report to its makers, try again and again, and take the agent's time.
        ("ORT_DISABLE_TELEMETRY".to_owned(), "1".to_owned()),
    ]);
    variables.extend(CpuView::of(&spec.cpus, &spec.limits).variables());
    variables.extend(spec.env.clone());
    variables.into_iter().collect()
}

struct CommandLine {
    args: Vec<OsString>,
    inherit: Vec<OwnedFd>,
    mounts: Option<PrivateMounts>,
}

impl CommandLine {
    fn args<'a>(&mut self, args: impl IntoIterator<Item = &'a str>) {
        self.args.extend(args.into_iter().map(OsString::from));
    }

    fn fd(&mut self, option: &str, fd: OwnedFd) {
        self.args.push(option.into());
        self.args.push(fd.as_raw_fd().to_string().into());
        self.inherit.push(fd);
    }

    /// Covers what tells of the host as a whole, or of other agents, and is of no use to an agent.
    fn hide_counters(&mut self) {
        for folder in HIDDEN_FOLDERS.into_iter().filter(|path| is_there(path)) {
            let cover = ["--perms", "0555", "--size", "4096", "--tmpfs", folder];
            self.args(cover.into_iter().chain(["--remount-ro", folder]));
        }
        for file in HIDDEN_FILES.into_iter().filter(|path| is_there(path)) {
            self.args(["--ro-bind", "/dev/null", file]);
        }
    }

    fn freeze_counters(&mut self, cpus: &CpuView) -> Result<(), SandboxError> {
        static FROZEN: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
        let frozen = FROZEN.get_or_init(|| {
            let read = |path| Some((path, fs::read(path).ok()?));
            FROZEN_FILES.into_iter().filter_map(read).collect()
        });
        for (path, content) in frozen {
            self.cover(path, &cpus.of_file(path, content))?;
        }
        Ok(())
    }

    /// Has a file that is there say something else.
    fn cover(&mut self, inside: &str, content: &[u8]) -> Result<(), SandboxError> {
        let fd = memory_file(content)?;
        self.args(["--perms", "0444"]);
        self.fd("--ro-bind-data", fd);
        self.args([inside]);
        Ok(())
    }

    fn file(&mut self, inside: &str, content: &[u8]) -> Result<(), SandboxError> {
        let fd = memory_file(content)?;
        self.args(["--perms", "0444"]);
        self.fd("--file", fd);
        self.args([inside]);
        Ok(())
    }

    /// Shows `host` as `inside`: a link as the same link, all else as a read-only mount.
    fn read_only(&mut self, host: &Path, inside: &Path) -> Result<(), SandboxError> {
        if host == inside
            && let Ok(target) = fs::read_link(host)
        {
            self.args
                .extend(["--symlink".into(), target.into_os_string(), inside.into()]);
            return Ok(());
        }
        let source = match &mut self.mounts {
            Some(mounts) => mounts.add(host)?,
            None => fs::canonicalize(host)
                .context(format_args!("cannot show {} to the agent", host.display()))?
                .into_os_string(),
        };
        self.args.extend(["--ro-bind".into(), source]);
        self.args.push(inside.into());
        Ok(())
    }
}

/// What a root of the agent's own must have, for the sandbox covers it. bubblewrap follows a link where it
/// mounts, and would do so on the host: whoever made the root has taken care that none is one, and it is looked
/// at again here.
fn check_own_places(root: &Path) -> Result<(), SandboxError> {
    let check = |place: &str, kind: &str, is_right: fn(&fs::Metadata) -> bool| {
        let what = format!("the agent's root has no {kind} /{place}");
        let meta = fs::symlink_metadata(root.join(place)).context(&what)?;
        if is_right(&meta) {
            return Ok(());
        }
        Err(SandboxError::other(what, "it is something else"))
    };
    for folder in ["agent", "dev", "etc", "proc", "sys", "tmp"] {
        check(folder, "folder", fs::Metadata::is_dir)?;
    }
    for file in ["etc/group", "etc/passwd"] {
        check(file, "file", fs::Metadata::is_file)?;
    }
    Ok(())
}

fn is_there(path: &str) -> bool {
    path.starts_with("/dev/") || Path::new(path).exists()
}

/// Parents before what is inside them, and nothing that an earlier mount shows already.
pub(crate) fn mount_order(paths: &[PathBuf]) -> Vec<PathBuf> {
    let mut sorted = paths.to_vec();
    sorted.sort();
    sorted.dedup();
    let mut mounts: Vec<PathBuf> = Vec::new();
    for path in sorted {
        if !mounts.iter().any(|mounted| path.starts_with(mounted)) {
            mounts.push(path);
        }
    }
    mounts
}

/// A file without a name, at its start.
fn memory_file(content: &[u8]) -> Result<OwnedFd, SandboxError> {
    let make = || -> io::Result<OwnedFd> {
        let mut file = fs::File::from(memfd_create("faceoff", MemfdFlags::CLOEXEC)?);
        file.write_all(content)?;
        file.rewind()?;
        Ok(file.into())
    };
    make().context("cannot make a file in memory")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_inside_a_mounted_one_is_not_mounted_again() {
        let paths = ["/usr/lib/python3", "/usr/lib", "/usr/lib64", "/usr/lib"].map(PathBuf::from);
        assert_eq!(
            mount_order(&paths),
            ["/usr/lib", "/usr/lib64"].map(PathBuf::from)
        );
    }
}

//! Finds bubblewrap (`bwrap`), the program that starts an agent in namespaces of its own, and builds its command line.

use crate::{
    Layer, SandboxError, SpawnSpec,
    bubblewrap_program::BubblewrapProgram,
    cpu_view::CpuView,
    error::IoContext,
    memory_view::MemoryView,
    private_mounts::PrivateMounts,
    private_network::PrivateNetwork,
    seccomp::{self, Filters},
};
use rustix::fs::{MemfdFlags, memfd_create};
use std::{
    ffi::OsString,
    fs,
    io::{self, Seek, Write},
    os::{
        fd::{AsRawFd, OwnedFd},
        unix::ffi::OsStrExt,
    },
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

/// User and group id inside the sandbox; the number is arbitrary.
const ID_IN_SANDBOX: &str = "1000";
const PASSWD: &str = "agent:x:1000:1000:agent:/tmp:/bin/sh\n";
const GROUP: &str = "agent:x:1000:\n";
/// Names are looked up in files only: there is no network in which to ask for them.
const NAME_SERVICES: &str = "passwd: files\ngroup: files\nhosts: files\n";
/// The agent's host name.
const HOST_NAME: &str = "agent";
/// Content of `/etc/hosts`: an agent's own names.
pub const HOSTS: &str = "127.0.0.1 localhost agent\n::1 localhost agent\n";

/// The only files of `/proc` that are not hidden beside those of processes. All others show settings and counters of the whole host (locks,
/// asynchronous I/O, interrupts, open files …).
const VISIBLE_IN_PROC: [&[&str]; 4] = [
    // Links, and System V objects, which an agent has of its own.
    &["mounts", "net", "self", "sysvipc", "thread-self"],
    &SNAPSHOT_NAMES,
    // Constants.
    &[
        "config.gz",
        "consoles",
        "devices",
        "dma",
        "execdomains",
        "filesystems",
        "iomem",
        "ioports",
        "kallsyms",
        "misc",
        "mtrr",
        "version",
    ],
    // Files that only root may read. Each mount over a file would take time at the start.
    &[
        "kmsg",
        "kpagecgroup",
        "kpagecount",
        "kpageflags",
        "pagetypeinfo",
        "slabinfo",
        "timer_list",
        "vmallocinfo",
    ],
];
/// The sandbox's first process.
const INIT: &str = "/proc/1";
/// Terminals, whose number all agents share.
const TERMINALS: &str = "/dev/pts";

/// Counters of the host that ordinary libraries read. Agents see snapshots that were taken before the first agent started, because the
/// live counters would show what other agents do (e.g. the number of started processes). The snapshots show the agent's CPUs and memory.
const SNAPSHOT_NAMES: [&str; 5] = ["stat", "cpuinfo", "meminfo", "loadavg", "uptime"];

/// An installed bubblewrap and its features.
#[derive(Debug, Clone)]
pub(crate) struct Bubblewrap {
    pub program: PathBuf,
    /// Version line, e.g. `bubblewrap 0.8.0`.
    pub version: String,
    /// Can this version forbid nested user namespaces (in addition to the seccomp filter, which forbids them, too)?
    disables_user_namespaces: bool,
}

impl Bubblewrap {
    /// The host's bubblewrap, probed once per process.
    pub(crate) fn find() -> Result<&'static Self, SandboxError> {
        static FOUND: OnceLock<Bubblewrap> = OnceLock::new();
        if let Some(found) = FOUND.get() {
            return Ok(found);
        }
        let found = BubblewrapProgram::find().map_err(|problem| SandboxError::Unavailable {
            layer: Layer::Namespaces,
            reason: format!("{problem}; {}", problem.fix()),
        })?;
        Ok(FOUND.get_or_init(|| Self {
            program: found.path,
            version: found.version,
            disables_user_namespaces: found.help.contains("--disable-userns"),
        }))
    }

    /// The command line for `spec`, with the file descriptors and mounts that the child needs. `as_other_user`:
    /// bubblewrap runs as another user than this process, who may be unable to reach the files by path or to make a network. Then the
    /// child makes mounts and the network before it becomes that user.
    pub(crate) fn command(
        &self,
        spec: &SpawnSpec,
        status: OwnedFd,
        filters: Option<&Filters>,
        as_other_user: bool,
    ) -> Result<Invocation, SandboxError> {
        let mut line = CommandLine {
            args: Vec::new(),
            inherited_fds: Vec::new(),
            mounts: as_other_user.then(PrivateMounts::new),
        };
        line.args([
            "--unshare-user",
            "--unshare-ipc",
            "--unshare-pid",
            "--unshare-uts",
        ]);
        let network = if as_other_user {
            Some(PrivateNetwork::new()?)
        } else {
            line.args(["--unshare-net"]);
            None
        };
        line.args([
            "--unshare-cgroup",
            "--uid",
            ID_IN_SANDBOX,
            "--gid",
            ID_IN_SANDBOX,
            "--hostname",
            HOST_NAME,
        ]);
        if self.disables_user_namespaces {
            line.args(["--disable-userns"]);
        }
        // The sandbox's first process is one of bubblewrap, which reaps processes whose parents have ended. The filters restrict it, too,
        // and it ends with the agent: then the kernel kills all remaining processes.
        line.args([
            "--die-with-parent",
            "--new-session",
            "--cap-drop",
            "ALL",
            "--clearenv",
        ]);
        line.fd("--json-status-fd", status);
        let root = spec.runtime.root();
        if let Some(root) = root {
            check_mount_points(root)?;
            line.read_only(root, Path::new("/"))?;
        }
        for path in mount_order(&spec.runtime.read_only_paths) {
            line.read_only(&spec.runtime.source(&path), &path)?;
        }
        line.args(["--proc", "/proc", "--dev", "/dev"]);
        line.hide_host_files();
        let cpus = CpuView::new(spec);
        let memory = MemoryView::new(spec);
        line.show_counter_snapshots(&cpus, &memory)?;
        // An image's root is read-only, so the folder for the CPU lists must be a new file system.
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
        // An image has such files of its own.
        if root.is_none() {
            let hostname = format!("{HOST_NAME}\n");
            for (path, content) in [
                ("/etc/hostname", hostname.as_str()),
                ("/etc/hosts", HOSTS),
                ("/etc/nsswitch.conf", NAME_SERVICES),
            ] {
                line.file(path, content.as_bytes())?;
            }
        }
        line.bundle(&spec.bundle_dir)?;
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
        let mut command = Command::new(&self.program);
        // The options are not on the command line, which the agent can read in `/proc/1`: they name the host's files.
        let options = memory_file(&separated_by_nul(&line.args))?;
        command.arg("--args").arg(options.as_raw_fd().to_string());
        line.inherited_fds.push(options);
        command.arg("--").args(&spec.command);
        // bubblewrap itself gets none of the bundle's variables: LD_PRELOAD would affect it outside the sandbox.
        command.env_clear().current_dir("/");
        Ok(Invocation {
            command,
            inherited_fds: line.inherited_fds,
            mounts: line.mounts,
            network,
        })
    }
}

/// bubblewrap's command, and the descriptors and mounts that its process needs before the exec.
#[derive(Debug)]
pub(crate) struct Invocation {
    pub command: Command,
    pub inherited_fds: Vec<OwnedFd>,
    pub mounts: Option<PrivateMounts>,
    /// The network, if bubblewrap does not make it.
    pub network: Option<PrivateNetwork>,
}

/// The agent's environment variables; the bundle's own may replace all others.
pub(crate) fn environment(spec: &SpawnSpec, home: &str) -> Vec<(String, String)> {
    let mut variables = std::collections::BTreeMap::from([
        ("PATH".to_owned(), spec.runtime.path.clone()),
        ("HOME".to_owned(), home.to_owned()),
        ("TMPDIR".to_owned(), home.to_owned()),
        ("USER".to_owned(), "agent".to_owned()),
        ("LOGNAME".to_owned(), "agent".to_owned()),
        ("LANG".to_owned(), "C.UTF-8".to_owned()),
        // A thread of ONNX Runtime would send telemetry, retry without end, and use the agent's CPU time.
        ("ORT_DISABLE_TELEMETRY".to_owned(), "1".to_owned()),
    ]);
    variables.extend(CpuView::new(spec).variables());
    variables.extend(spec.env.clone());
    variables.into_iter().collect()
}

struct CommandLine {
    args: Vec<OsString>,
    inherited_fds: Vec<OwnedFd>,
    mounts: Option<PrivateMounts>,
}

impl CommandLine {
    fn args<'a>(&mut self, args: impl IntoIterator<Item = &'a str>) {
        self.args.extend(args.into_iter().map(OsString::from));
    }

    /// Adds an option whose value is a file descriptor, which the child inherits.
    fn fd(&mut self, option: &str, fd: OwnedFd) {
        self.args.push(option.into());
        self.args.push(fd.as_raw_fd().to_string().into());
        self.inherited_fds.push(fd);
    }

    /// Covers files that show the whole host or other agents, and that no agent needs.
    fn hide_host_files(&mut self) {
        // Listed at each start: a kernel module that was loaded or unloaded since the last one changes the entries.
        let HiddenProcEntries { folders, files } = HiddenProcEntries::list();
        let folders = folders.iter().map(String::as_str).chain([TERMINALS]);
        for folder in folders {
            let cover = ["--perms", "0555", "--size", "4096", "--tmpfs", folder];
            self.args(cover.into_iter().chain(["--remount-ro", folder]));
        }
        for file in files {
            self.args(["--ro-bind", "/dev/null", &file]);
        }
        // The sandbox's first process is bubblewrap's, whose memory an agent, as the same user, could write to.
        self.args([
            "--perms",
            "0555",
            "--size",
            "4096",
            "--tmpfs",
            INIT,
            "--remount-ro",
            INIT,
        ]);
    }

    /// Mounts the snapshots over the host's counters.
    fn show_counter_snapshots(
        &mut self,
        cpus: &CpuView,
        memory: &MemoryView,
    ) -> Result<(), SandboxError> {
        static SNAPSHOTS: OnceLock<Vec<(String, Vec<u8>)>> = OnceLock::new();
        let snapshots = SNAPSHOTS.get_or_init(|| {
            let paths = SNAPSHOT_NAMES.map(|name| format!("/proc/{name}"));
            let read = |path: String| {
                let content = fs::read(&path).ok()?;
                Some((path, content))
            };
            paths.into_iter().filter_map(read).collect()
        });
        for (path, content) in snapshots {
            let content = match path.as_str() {
                "/proc/meminfo" => memory.filter_file(content),
                _ => cpus.filter_file(path, content),
            };
            self.cover(path, &content)?;
        }
        Ok(())
    }

    /// Mounts `content` over an existing file.
    fn cover(&mut self, inside: &str, content: &[u8]) -> Result<(), SandboxError> {
        let fd = memory_file(content)?;
        self.args(["--perms", "0444"]);
        self.fd("--ro-bind-data", fd);
        self.args([inside]);
        Ok(())
    }

    /// Creates a new file with `content`.
    fn file(&mut self, inside: &str, content: &[u8]) -> Result<(), SandboxError> {
        let fd = memory_file(content)?;
        self.args(["--perms", "0444"]);
        self.fd("--file", fd);
        self.args([inside]);
        Ok(())
    }

    /// Shows the bundle, as a copy if possible.
    fn bundle(&mut self, host: &Path) -> Result<(), SandboxError> {
        let inside = Path::new("/agent");
        let Some(mounts) = &mut self.mounts else {
            return self.read_only(host, inside);
        };
        let source = mounts.add_bundle(host)?;
        self.args
            .extend(["--ro-bind".into(), source, inside.into()]);
        Ok(())
    }

    /// Shows `host` at `inside`: a link as the same link, anything else as a read-only mount.
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

/// Checks the paths of an image's root over which the sandbox mounts. bubblewrap follows a link at a mount
/// point, and would follow it on the host. The code that unpacked the root leaves no link there; this is a second
/// check.
fn check_mount_points(root: &Path) -> Result<(), SandboxError> {
    let check = |path: &str, kind: &str, is_expected: fn(&fs::Metadata) -> bool| {
        let action = format!("the agent's root has no {kind} /{path}");
        let meta = fs::symlink_metadata(root.join(path)).context(&action)?;
        if is_expected(&meta) {
            return Ok(());
        }
        Err(SandboxError::other(action, "it is something else"))
    };
    for folder in ["agent", "dev", "etc", "proc", "sys", "tmp"] {
        check(folder, "folder", fs::Metadata::is_dir)?;
    }
    for file in ["etc/group", "etc/passwd"] {
        check(file, "file", fs::Metadata::is_file)?;
    }
    Ok(())
}

/// The entries of `/proc` that agents must not see.
struct HiddenProcEntries {
    folders: Vec<String>,
    files: Vec<String>,
}

impl HiddenProcEntries {
    /// All but the visible ones and those of processes, which have numbers as names.
    fn list() -> Self {
        let (mut folders, mut files) = (Vec::new(), Vec::new());
        for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
            let Ok(name) = entry.file_name().into_string() else {
                continue;
            };
            let is_process = name.bytes().all(|byte| byte.is_ascii_digit());
            if is_process
                || VISIBLE_IN_PROC
                    .iter()
                    .any(|names| names.contains(&name.as_str()))
            {
                continue;
            }
            let path = format!("/proc/{name}");
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => folders.push(path),
                _ => files.push(path),
            }
        }
        Self { folders, files }
    }
}

/// Sorted paths without duplicates and without paths inside others, which a mount of the outer path shows already.
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

/// The format of bubblewrap's option `--args`.
fn separated_by_nul(args: &[OsString]) -> Vec<u8> {
    args.iter()
        .flat_map(|arg| arg.as_bytes().iter().copied().chain([0]))
        .collect()
}

/// An anonymous file in memory, positioned at its start.
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
    fn path_inside_a_mounted_path_is_not_mounted_again() {
        let paths = ["/usr/lib/python3", "/usr/lib", "/usr/lib64", "/usr/lib"].map(PathBuf::from);
        assert_eq!(
            mount_order(&paths),
            ["/usr/lib", "/usr/lib64"].map(PathBuf::from)
        );
    }
}

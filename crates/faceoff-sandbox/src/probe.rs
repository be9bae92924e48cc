//! Finds out what the host can do by doing it: one small process per layer, with that layer alone.

use crate::{
    AgentProcess, Isolation, Layer, Limits, ReadLine, Runtime, SandboxError, SpawnError, SpawnSpec,
    bubblewrap::{self, Bubblewrap},
};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs, io,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// How long a probe may take on a loaded host.
const PATIENCE: Duration = Duration::from_secs(120);
/// Recognisable in `/proc/self/limits`.
const PROBE_OPEN_FILES: u32 = 61;

/// One feature of the host and what it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HostFeature {
    /// The layer that needs it.
    pub layer: Layer,
    /// Did it work just now?
    pub available: bool,
    /// What was found, or what went wrong.
    pub found: String,
    /// What to do about it, as a command where there is one; `None` when it is available.
    pub cure: Option<String>,
}

/// Probes the host for real (starts a probe process for each layer). Used by `doctor` and at start-up.
pub fn probe_host() -> Vec<HostFeature> {
    Layer::ALL.into_iter().map(probe).collect()
}

fn probe(layer: Layer) -> HostFeature {
    let result = match layer {
        Layer::Namespaces => namespaces(),
        Layer::Seccomp => shown(layer, "/proc/self/status", |text| {
            let mode = field(text, "Seccomp:")?;
            (mode == "2").then(|| "a filter was installed and is active".to_owned())
        }),
        Layer::CgroupMemory => cgroup(layer, "memory"),
        Layer::CgroupPids => cgroup(layer, "pids"),
        Layer::CgroupCpu => cgroup(layer, "cpu"),
        Layer::Rlimits => shown(layer, "/proc/self/limits", |text| {
            let value = field(text, "Max open files")?;
            (value == PROBE_OPEN_FILES.to_string()).then(|| "limits hold across exec".to_owned())
        }),
    };
    match result {
        Ok(found) => HostFeature {
            layer,
            available: true,
            found,
            cure: None,
        },
        Err(why) => HostFeature {
            layer,
            available: false,
            cure: Some(cure(layer, &why)),
            found: why,
        },
    }
}

/// The first word after `name` at a line's start.
fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines()
        .find_map(|line| line.strip_prefix(name)?.split_whitespace().next())
}

fn namespaces() -> Result<String, String> {
    let bubblewrap = Bubblewrap::find().map_err(|error| error.to_string())?;
    // Inside, the process is number one, has no capability left and sees no network but its own.
    let status = run(Layer::Namespaces, "/proc/self/status")?;
    if field(&status, "Pid:") != Some("1") || field(&status, "CapBnd:") != Some("0000000000000000")
    {
        return Err(format!(
            "{} ran, but without namespaces of its own",
            bubblewrap.version
        ));
    }
    let interfaces = run(Layer::Namespaces, "/proc/net/dev")?;
    if interfaces
        .lines()
        .skip(2)
        .any(|line| !line.trim_start().starts_with("lo:"))
    {
        return Err(format!(
            "{} ran, but with the host's network",
            bubblewrap.version
        ));
    }
    let user = if rustix::process::geteuid().is_root() {
        "a user of their own"
    } else {
        "this user"
    };
    Ok(format!(
        "{}, agents run as {user} in a user namespace",
        bubblewrap.version
    ))
}

fn cgroup(layer: Layer, controller: &str) -> Result<String, String> {
    let own = |text: &str| {
        text.lines().find_map(|line| {
            let mut parts = line.splitn(3, ':');
            let (_, names, path) = (parts.next()?, parts.next()?, parts.next()?);
            let version = match names {
                "" => "v2",
                names if names.split(',').any(|name| name == controller) => "v1",
                _ => return None,
            };
            // On a hybrid host the unified line is there too, but the agent is not in it.
            path.contains("/agent-").then(|| {
                format!(
                    "cgroup {version}, limits accepted{}",
                    freezer(layer, version, text)
                )
            })
        })
    };
    shown(layer, "/proc/self/cgroup", own)
}

/// What stops an agent is no layer, but told with the one beside which it matters: without it a game needs CPUs apart.
fn freezer(layer: Layer, version: &str, own_cgroups: &str) -> &'static str {
    let in_one = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let named = parts
            .next()
            .is_some_and(|names| names.split(',').any(|name| name == "freezer"));
        named && parts.next().is_some_and(|path| path.contains("/agent-"))
    };
    match layer {
        Layer::CgroupCpu if version == "v2" || own_cgroups.lines().any(in_one) => {
            "; agents can be frozen"
        }
        Layer::CgroupCpu => {
            "; agents cannot be frozen, so games need CPUs for each side: hand the service a cgroup of the freezer, too"
        }
        _ => "",
    }
}

fn shown(
    layer: Layer,
    file: &str,
    judge: impl Fn(&str) -> Option<String>,
) -> Result<String, String> {
    let text = run(layer, file)?;
    judge(&text)
        .ok_or_else(|| format!("it was applied without an error, but {file} does not show it"))
}

/// Starts `cat file` with `layer` alone and returns what it printed.
fn run(layer: Layer, file: &str) -> Result<String, String> {
    let cat = ["/usr/bin/cat", "/bin/cat"]
        .into_iter()
        .find(|path| Path::new(path).is_file());
    let cat = cat.ok_or("the probe needs /usr/bin/cat")?;
    let (_private, bundle) =
        bundle(layer).map_err(|error| format!("cannot make a folder for the probe: {error}"))?;
    let mut runtime = Runtime::native();
    runtime.read_only_paths.push(cat.into());
    let given_up = Layer::ALL
        .into_iter()
        .filter(|other| *other != layer)
        .collect();
    let spec = SpawnSpec {
        bundle_dir: bundle,
        command: vec![cat.into(), file.into()],
        env: BTreeMap::new(),
        runtime,
        limits: Limits {
            open_files: PROBE_OPEN_FILES,
            ..Limits::default()
        },
        isolation: Isolation::Sandboxed { given_up },
        cpus: Vec::new(),
    };
    let mut agent = AgentProcess::spawn(&spec).map_err(|error| match error {
        SpawnError::Platform(SandboxError::Unavailable { why, .. }) => why,
        other => other.to_string(),
    })?;
    let deadline = Instant::now() + PATIENCE;
    let mut text = String::new();
    loop {
        match agent
            .read_line(64 << 10, deadline)
            .map_err(|error| error.to_string())?
        {
            ReadLine::Line { bytes, .. } => {
                text.push_str(&String::from_utf8_lossy(&bytes));
                text.push('\n');
            }
            ReadLine::Closed => break,
            ReadLine::TimedOut => return Err("the probe did not end in time".into()),
            ReadLine::TooLong { .. } => return Err("the probe printed rubbish".into()),
        }
    }
    match agent.finish(PATIENCE).map_err(|error| error.to_string())? {
        usage if usage.exit.is_none() => Ok(text),
        usage => Err(format!(
            "the probe failed: {:?}; {}",
            usage.exit,
            usage.stderr_tail.trim()
        )),
    }
}

/// An empty bundle. With namespaces it lies, as real ones do, in a folder that only the service may enter;
/// the other layers are tried without them.
fn bundle(layer: Layer) -> io::Result<(tempfile::TempDir, PathBuf)> {
    let outer = tempfile::Builder::new()
        .prefix("faceoff-probe-")
        .tempdir()?;
    let outer_mode = if layer == Layer::Namespaces {
        0o700
    } else {
        0o755
    };
    let bundle = outer.path().join("bundle");
    fs::create_dir(&bundle)?;
    fs::set_permissions(&bundle, fs::Permissions::from_mode(0o755))?;
    fs::set_permissions(outer.path(), fs::Permissions::from_mode(outer_mode))?;
    Ok((outer, bundle))
}

fn cure(layer: Layer, why: &str) -> String {
    match layer {
        Layer::Namespaces => cure_namespaces(why),
        Layer::Seccomp => {
            "use a kernel with CONFIG_SECCOMP_FILTER=y (every distribution's since 2014)".into()
        }
        Layer::CgroupMemory | Layer::CgroupPids | Layer::CgroupCpu => cure_cgroups(),
        Layer::Rlimits => {
            format!(
                "raise the service's own hard limits, e.g. ulimit -Hn {}",
                Limits::default().open_files
            )
        }
    }
}

/// Version 2 can be handed to an ordinary user by systemd; version 1 only by root.
fn cure_cgroups() -> String {
    const CONTAINER: &str = "in Docker: docker run --privileged --cgroupns=private";
    if Path::new("/sys/fs/cgroup/cgroup.controllers").exists() {
        format!(
            "run the service as root, or as a systemd service whose unit says [Service] Delegate=yes; from a \
             shell: systemd-run --user --scope -p Delegate=yes faceoff serve; {CONTAINER}"
        )
    } else {
        format!(
            "run the service as root, or have root hand it a cgroup: for c in memory pids cpu cpuacct freezer; do mkdir \
             -p /sys/fs/cgroup/$c/agents; chown -R USER /sys/fs/cgroup/$c/agents; echo PID > \
             /sys/fs/cgroup/$c/agents/cgroup.procs; done; {CONTAINER}"
        )
    }
}

/// The usual switches that keep an ordinary user from making a sandbox, in the order they bite.
fn cure_namespaces(why: &str) -> String {
    const SWITCHES: [(&str, &str, &str); 3] = [
        (
            "/proc/sys/kernel/unprivileged_userns_clone",
            "0",
            "sysctl -w kernel.unprivileged_userns_clone=1",
        ),
        (
            "/proc/sys/user/max_user_namespaces",
            "0",
            "sysctl -w user.max_user_namespaces=15000",
        ),
        (
            "/proc/sys/kernel/apparmor_restrict_unprivileged_userns",
            "1",
            "sysctl -w kernel.apparmor_restrict_unprivileged_userns=0",
        ),
    ];
    if Bubblewrap::find().is_err() {
        return bubblewrap::CURE_INSTALL.into();
    }
    // Then namespaces were made, and only the last step in them was refused.
    if why.contains("mount proc") {
        return "have a /proc without masked files, beside which agents may have one of their own; in Docker: docker run \
                --security-opt systempaths=unconfined"
            .into();
    }
    let switch = SWITCHES
        .iter()
        .find(|(file, bad, _)| fs::read_to_string(file).is_ok_and(|value| value.trim() == *bad));
    match switch {
        Some((.., command)) => (*command).to_owned(),
        None => "allow user namespaces; in Docker: docker run --security-opt seccomp=docker/seccomp.json --security-opt \
                 apparmor=unconfined --security-opt systempaths=unconfined"
            .into(),
    }
}

//! Probes the host's features: starts one small process per layer, with only that layer enabled.

use crate::{
    AgentProcess, Isolation, Layer, Limits, ReadLine, Runtime, SandboxError, SpawnError, SpawnSpec,
    answered_calls, bubblewrap::Bubblewrap, bubblewrap_program::BubblewrapProgram,
    layer_advice::fix,
};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs, io,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Time limit of a probe; only a failing host reaches it.
const TIMEOUT: Duration = Duration::from_secs(120);
/// An unusual limit, by which the probe recognises in `/proc/self/limits` that limits are applied.
const PROBE_OPEN_FILES: u32 = 61;

/// Result of probing one layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerProbe {
    /// The probed layer.
    pub layer: Layer,
    /// The probe succeeded.
    pub available: bool,
    /// The found feature, or the error.
    pub found: String,
    /// How to provide the layer, as a command if possible; `None` if it is available.
    #[serde(rename = "cure")]
    pub fix: Option<String>,
}

/// Probes the host: starts a process for each layer. Used by `doctor` and at start-up.
pub fn probe_host() -> Vec<LayerProbe> {
    Layer::ALL.into_iter().map(probe).collect()
}

/// Which of `layers` this user cannot get on this host. First starts one process with all of them; only if that fails, one for each layer.
///
/// # Errors
/// If not even a process without any layer can be started: then the cause is none of the layers.
pub fn unavailable_layers(layers: &[Layer]) -> Result<Vec<LayerProbe>, String> {
    if run(layers, "cat", &["/dev/null"]).is_ok() {
        return Ok(Vec::new());
    }
    run(&[], "cat", &["/dev/null"])?;
    let probed = layers.iter().copied().map(probe);
    Ok(probed.filter(|probe| !probe.available).collect())
}

fn probe(layer: Layer) -> LayerProbe {
    let result = match layer {
        Layer::Namespaces => probe_namespaces(),
        Layer::Seccomp => probe_seccomp(),
        Layer::CgroupMemory => probe_cgroup(layer, "memory"),
        Layer::CgroupPids => probe_cgroup(layer, "pids"),
        Layer::CgroupCpu => probe_cgroup(layer, "cpu"),
        Layer::Rlimits => probe_by_file(layer, "/proc/self/limits", |text| {
            let value = field(text, "Max open files")?;
            (value == PROBE_OPEN_FILES.to_string()).then(|| "limits hold across exec".to_owned())
        }),
    };
    match result {
        Ok(found) => LayerProbe {
            layer,
            available: true,
            found,
            fix: None,
        },
        Err(error) => LayerProbe {
            layer,
            available: false,
            fix: Some(fix(layer, &error)),
            found: error,
        },
    }
}

/// The first word after `name` at a line's start.
fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines()
        .find_map(|line| line.strip_prefix(name)?.split_whitespace().next())
}

fn probe_namespaces() -> Result<String, String> {
    // Without a usable bubblewrap this is the error, and `fix` says how to install it.
    BubblewrapProgram::find().map_err(|problem| problem.to_string())?;
    let bubblewrap = Bubblewrap::find().map_err(|error| error.to_string())?;
    // In its namespaces the process is number 2 (bubblewrap's is number 1), has no capabilities, and sees only its own network.
    let status = run_cat(Layer::Namespaces, "/proc/self/status")?;
    if field(&status, "Pid:") != Some("2") || field(&status, "CapBnd:") != Some("0000000000000000")
    {
        return Err(format!(
            "{} ran, but without namespaces of its own",
            bubblewrap.version
        ));
    }
    let interfaces = run_cat(Layer::Namespaces, "/proc/net/dev")?;
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

fn probe_seccomp() -> Result<String, String> {
    let status = run_cat(Layer::Seccomp, "/proc/self/status")?;
    if field(&status, "Seccomp:") != Some("2") {
        return Err("a filter was installed, but it is not active".to_owned());
    }
    // The service answers the call `statfs` (as `stat -f` makes it) in the kernel's place: with the free blocks of an empty scratch folder.
    let answer = run(&[Layer::Seccomp], "stat", &["-f", "-c", "%a", "/"])?;
    let expected = answered_calls::free_blocks(Limits::default().scratch_bytes);
    if answer.trim() != expected.to_string() {
        return Err(
            "a filter is active, but the service cannot answer a process's calls".to_owned(),
        );
    }
    Ok("a filter was installed and is active, and the service answers calls".to_owned())
}

fn probe_cgroup(layer: Layer, controller: &str) -> Result<String, String> {
    let find_cgroup = |text: &str| {
        text.lines().find_map(|line| {
            let mut parts = line.splitn(3, ':');
            let (_, names, path) = (parts.next()?, parts.next()?, parts.next()?);
            let version = match names {
                "" => "v2",
                names if names.split(',').any(|name| name == controller) => "v1",
                _ => return None,
            };
            // A host with both cgroup versions also lists a line of version 2, but the agent's cgroup (`agent-…`) is not in that hierarchy.
            path.contains("/agent-").then(|| {
                format!(
                    "cgroup {version}, limits accepted{}",
                    freezer_note(layer, version, text)
                )
            })
        })
    };
    probe_by_file(layer, "/proc/self/cgroup", find_cgroup)
}

/// A note on the freezer, with which the evaluator stops one side of a game while the other one computes. It is no layer, so it is
/// reported with the CPU layer: without a freezer a game needs CPUs for each side.
fn freezer_note(layer: Layer, version: &str, own_cgroups: &str) -> &'static str {
    let is_agent_in_freezer = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let is_freezer = parts
            .next()
            .is_some_and(|names| names.split(',').any(|name| name == "freezer"));
        is_freezer && parts.next().is_some_and(|path| path.contains("/agent-"))
    };
    match layer {
        Layer::CgroupCpu if version == "v2" || own_cgroups.lines().any(is_agent_in_freezer) => {
            "; agents can be frozen"
        }
        Layer::CgroupCpu => {
            "; agents cannot be frozen, so games need CPUs for each side: give the service a cgroup of the freezer, too"
        }
        _ => "",
    }
}

/// Applies `layer` alone to a process that prints `file`, and lets `evaluate` look for the effect in the text.
fn probe_by_file(
    layer: Layer,
    file: &str,
    evaluate: impl Fn(&str) -> Option<String>,
) -> Result<String, String> {
    let text = run_cat(layer, file)?;
    evaluate(&text)
        .ok_or_else(|| format!("it was applied without an error, but {file} does not show it"))
}

/// Starts `cat file` with only `layer` enabled, and returns its output.
fn run_cat(layer: Layer, file: &str) -> Result<String, String> {
    run(&[layer], "cat", &[file])
}

/// Starts a program of the host, such as `cat`, with only these layers enabled, and returns its output.
fn run(layers: &[Layer], program: &str, arguments: &[&str]) -> Result<String, String> {
    let candidates = ["/usr/bin", "/bin"].map(|folder| Path::new(folder).join(program));
    let found = candidates.iter().find(|path| path.is_file());
    let program = found.ok_or_else(|| format!("the probe needs /usr/bin/{program}"))?;
    let (_outer, bundle) = make_bundle(layers)
        .map_err(|error| format!("cannot make a folder for the probe: {error}"))?;
    let mut runtime = Runtime::native();
    runtime.read_only_paths.push(program.clone());
    let disabled_layers = Layer::ALL
        .into_iter()
        .filter(|other| !layers.contains(other))
        .collect();
    let spec = SpawnSpec {
        bundle_dir: bundle,
        command: std::iter::once(program.display().to_string())
            .chain(arguments.iter().map(|&argument| argument.to_owned()))
            .collect(),
        env: BTreeMap::new(),
        logs_output: false,
        runtime,
        limits: Limits {
            open_files: PROBE_OPEN_FILES,
            ..Limits::default()
        },
        isolation: Isolation::Sandboxed { disabled_layers },
        cpus: Vec::new(),
    };
    let mut agent = AgentProcess::spawn(&spec).map_err(|error| match error {
        SpawnError::Platform(SandboxError::Unavailable { reason, .. }) => reason,
        other => other.to_string(),
    })?;
    let deadline = Instant::now() + TIMEOUT;
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
            ReadLine::TooLong { .. } => return Err("the probe printed too long a line".into()),
        }
    }
    match agent.finish(TIMEOUT).map_err(|error| error.to_string())? {
        usage if usage.exit.is_none() => Ok(text),
        usage => Err(format!(
            "the probe failed: {:?}; {}",
            usage.exit,
            usage.stderr.trim()
        )),
    }
}

/// An empty bundle. With namespaces it is, like real bundles, in a folder that only the service may enter. The other
/// layers are probed without namespaces, so their bundle must be reachable.
fn make_bundle(layers: &[Layer]) -> io::Result<(tempfile::TempDir, PathBuf)> {
    let outer = tempfile::Builder::new()
        .prefix("faceoff-probe-")
        .tempdir()?;
    let outer_mode = if layers.contains(&Layer::Namespaces) {
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

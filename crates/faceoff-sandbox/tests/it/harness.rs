//! Starts the test agents (the Python programs of `tests/agents`) in the sandbox, and checks that they leave nothing behind. What an
//! argument makes an agent do is described in its program.

use faceoff_sandbox::{
    AgentProcess, Isolation, Layer, Limits, ReadLine, Runtime, SpawnSpec, Usage, probe_host,
};
use faceoff_types::AgentFaultKind;
use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
    time::{Duration, Instant},
};

/// Timeout of everything that should happen; no passing test waits for it.
pub const TIMEOUT: Duration = Duration::from_secs(600);
/// Maximum length of a line, in bytes.
pub const LINE_CAP: usize = 64 << 10;

/// Lets one test at a time run per process, because the names of left-over folders and cgroups contain only the pid of the test
/// process. It has no effect under nextest, where each test is a process.
pub struct SerialGuard(());

static LOCK: Mutex<()> = Mutex::new(());
thread_local! {
    /// Number of guards of this thread, and the lock: a test may have several subjects.
    static HELD_GUARDS: RefCell<(usize, Option<MutexGuard<'static, ()>>)> = const { RefCell::new((0, None)) };
}

impl SerialGuard {
    pub fn lock() -> Self {
        HELD_GUARDS.with_borrow_mut(|(count, guard)| {
            if *count == 0 {
                // After a failed test the lock is poisoned; the other tests continue.
                *guard = Some(LOCK.lock().unwrap_or_else(PoisonError::into_inner));
            }
            *count += 1;
        });
        Self(())
    }
}

impl Drop for SerialGuard {
    fn drop(&mut self) {
        HELD_GUARDS.with_borrow_mut(|(count, guard)| {
            *count -= 1;
            if *count == 0 {
                *guard = None;
            }
        });
    }
}

/// An agent under test, with its own bundle and a mark that identifies its processes.
pub struct Subject {
    pub bundle: tempfile::TempDir,
    pub spec: SpawnSpec,
    /// An argument of the agent's command, which its processes inherit; [`processes_marked`] finds them by it.
    pub mark: String,
    _guard: SerialGuard,
}

impl Subject {
    /// The program `tests/agents/NAME.py` with `arguments` in its own bundle, with all sandbox layers that this
    /// host offers.
    pub fn new(name: &str, arguments: &[&str]) -> Self {
        let guard = SerialGuard::lock();
        let bundle = tempfile::Builder::new()
            .prefix("bundle-")
            .tempdir()
            .unwrap();
        fs::set_permissions(bundle.path(), fs::Permissions::from_mode(0o755)).unwrap();
        let file = format!("{name}.py");
        fs::copy(agents_dir().join(&file), bundle.path().join(&file)).unwrap();
        let mark = format!(
            "mark-{}",
            bundle.path().file_name().unwrap().to_str().unwrap()
        );
        let mut command = vec!["python3".to_owned(), file, mark.clone()];
        command.extend(arguments.iter().map(|&argument| argument.to_owned()));
        let spec = SpawnSpec {
            bundle_dir: bundle.path().to_path_buf(),
            command,
            env: BTreeMap::new(),
            logs_output: false,
            runtime: Runtime::python3().expect("the tests need a python3"),
            limits: Limits {
                memory_bytes: 256 << 20,
                scratch_bytes: 16 << 20,
                file_size_bytes: 64 << 20,
                ..Limits::default()
            },
            isolation: Isolation::Sandboxed {
                disabled_layers: missing_layers().to_vec(),
            },
            cpus: Vec::new(),
        };
        Self {
            bundle,
            spec,
            mark,
            _guard: guard,
        }
    }

    /// Makes the bundle so large that the agent sees the host's files, not a copy in memory.
    pub fn with_large_bundle(self) -> Self {
        let filling = fs::File::create(self.bundle.path().join("filling")).unwrap();
        filling.set_len(1 << 30).unwrap();
        self
    }

    pub fn with_limits(mut self, change: impl FnOnce(&mut Limits)) -> Self {
        change(&mut self.spec.limits);
        self
    }

    pub fn spawn(&self) -> AgentProcess {
        AgentProcess::spawn(&self.spec).unwrap()
    }

    /// Runs the agent; returns the line (JSON) that it prints. The agent must then exit on its own and leave nothing behind.
    pub fn report(&self) -> serde_json::Value {
        let mut agent = self.spawn();
        let line = expect_line(&mut agent);
        let usage = agent.finish(TIMEOUT).unwrap();
        assert_eq!(usage.exit, None, "{}", usage.stderr);
        self.assert_nothing_left();
        serde_json::from_str(&line).unwrap()
    }

    /// Waits until the agent ends on its own; returns the agent fault.
    pub fn wait_for_end(&self, agent: &mut AgentProcess) -> AgentFaultKind {
        agent
            .diagnose_end(TIMEOUT)
            .unwrap()
            .unwrap_or_else(|| panic!("no end; {}", agent.stderr()))
    }

    /// Kills the agent and checks that it left nothing behind.
    pub fn finish(&self, agent: AgentProcess) -> Usage {
        let usage = agent.finish(Duration::ZERO).unwrap();
        self.assert_nothing_left();
        usage
    }

    pub fn assert_nothing_left(&self) {
        assert_eq!(
            processes_marked(&self.mark),
            [] as [i32; 0],
            "processes are left"
        );
        let mounts = fs::read_to_string("/proc/self/mountinfo").unwrap();
        // The kernel escapes spaces.
        let bundle = self.bundle.path().to_str().unwrap().replace(' ', "\\040");
        assert!(!mounts.contains(&bundle), "a mount is left: {mounts}");
        let prefix = format!("agent-{}-", std::process::id());
        let cgroups: Vec<_> = agent_cgroups()
            .into_iter()
            .filter(|path| name_of(path).starts_with(&prefix))
            .collect();
        assert_eq!(cgroups, [] as [PathBuf; 0], "cgroups are left");
        let files: Vec<_> = walk(&std::env::temp_dir(), 1)
            .into_iter()
            .filter(|path| {
                name_of(path).starts_with(&format!("faceoff-scratch-{}-", std::process::id()))
            })
            .collect();
        assert_eq!(files, [] as [PathBuf; 0], "scratch folders are left");
    }
}

pub fn agents_dir() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/agents")
}

/// The next line as text; panics with any other outcome.
pub fn expect_line(agent: &mut AgentProcess) -> String {
    match agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap() {
        ReadLine::Line { bytes, .. } => String::from_utf8(bytes).unwrap(),
        other => {
            let end = agent.diagnose_end(Duration::from_secs(1));
            panic!("{other:?}; {end:?}; {}", agent.stderr())
        }
    }
}

/// Sends `line` and expects the same line back.
pub fn expect_echo(agent: &mut AgentProcess, line: &str) {
    agent.send_line(format!("{line}\n").as_bytes()).unwrap();
    assert_eq!(expect_line(agent), line);
}

/// The layers that this host lacks. None may be missing for root; an ordinary user may lack cgroups.
pub fn missing_layers() -> &'static [Layer] {
    static MISSING: OnceLock<Vec<Layer>> = OnceLock::new();
    MISSING.get_or_init(|| {
        let missing: Vec<_> = probe_host()
            .into_iter()
            .filter(|probe| !probe.available)
            .collect();
        for probe in &missing {
            let may_be_missing = !is_root()
                && matches!(
                    probe.layer,
                    Layer::CgroupMemory | Layer::CgroupPids | Layer::CgroupCpu
                );
            assert!(may_be_missing, "this host should have {probe:?}");
            println!("not tested on this host: {}: {}", probe.layer, probe.found);
        }
        missing.into_iter().map(|probe| probe.layer).collect()
    })
}

/// Is the layer available? Prints a note if the test cannot check anything without it.
pub fn has_layer(layer: Layer) -> bool {
    let is_available = !missing_layers().contains(&layer);
    if !is_available {
        println!("this test checks nothing on this host: it needs the layer {layer}");
    }
    is_available
}

pub fn is_root() -> bool {
    rustix::process::geteuid().is_root()
}

/// Processes whose command line or environment contains `mark`. A zombie has neither.
pub fn processes_marked(mark: &str) -> Vec<i32> {
    let contains_mark = |pid: i32, file: &str| {
        fs::read(format!("/proc/{pid}/{file}")).is_ok_and(|text| {
            text.windows(mark.len())
                .any(|window| window == mark.as_bytes())
        })
    };
    let pids = fs::read_dir("/proc")
        .unwrap()
        .flatten()
        .filter_map(|entry| name_of(&entry.path()).parse().ok());
    pids.filter(|&pid| contains_mark(pid, "cmdline") || contains_mark(pid, "environ"))
        .collect()
}

/// All cgroups of agents on this host.
pub fn agent_cgroups() -> Vec<PathBuf> {
    walk(Path::new("/sys/fs/cgroup"), 12)
        .into_iter()
        .filter(|path| {
            name_of(path).starts_with("agent-")
                && path
                    .parent()
                    .is_some_and(|folder| folder.ends_with("faceoff"))
        })
        .collect()
}

/// Folders below `root`, down to `depth`.
fn walk(root: &Path, depth: usize) -> Vec<PathBuf> {
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let folders: Vec<_> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .map(|entry| entry.path())
        .collect();
    let deeper = folders
        .iter()
        .filter(|_| depth > 1)
        .flat_map(|folder| walk(folder, depth - 1));
    let mut found: Vec<_> = deeper.collect();
    found.extend(folders);
    found
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default()
}

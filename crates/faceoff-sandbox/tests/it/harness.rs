//! Starts the programs of `tests/agents` and checks that nothing of them is left.

use faceoff_sandbox::{AgentProcess, Isolation, Limits, ReadLine, Runtime, SpawnError, SpawnSpec};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Long enough for a loaded machine; no test waits for it unless something is broken.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// An agent under test, with a bundle of its own and a mark by which its processes are known.
pub struct Subject {
    pub bundle: tempfile::TempDir,
    pub spec: SpawnSpec,
    pub mark: String,
}

impl Subject {
    /// The program `tests/agents/NAME.py` in a bundle of its own, fully sandboxed.
    pub fn python(name: &str) -> Self {
        Self::with_command(&format!("{name}.py"), |file, mark| {
            vec!["python3".into(), file.into(), mark.into()]
        })
    }

    fn with_command(file: &str, command: impl FnOnce(&str, &str) -> Vec<String>) -> Self {
        use std::os::unix::fs::PermissionsExt;
        let bundle = tempfile::Builder::new()
            .prefix("bundle-")
            .tempdir()
            .unwrap();
        fs::set_permissions(bundle.path(), fs::Permissions::from_mode(0o755)).unwrap();
        fs::copy(agents_dir().join(file), bundle.path().join(file)).unwrap();
        let mark = format!(
            "mark-{}",
            bundle.path().file_name().unwrap().to_str().unwrap()
        );
        let spec = SpawnSpec {
            bundle_dir: bundle.path().to_path_buf(),
            command: command(file, &mark),
            env: BTreeMap::new(),
            runtime: Runtime::python3().expect("the tests need a python3"),
            limits: Limits {
                memory_bytes: 256 << 20,
                scratch_bytes: 16 << 20,
                ..Limits::default()
            },
            isolation: Isolation::Sandboxed {
                given_up: Vec::new(),
            },
            cpus: Vec::new(),
        };
        Self { bundle, spec, mark }
    }

    pub fn spawn(&self) -> Result<AgentProcess, SpawnError> {
        AgentProcess::spawn(&self.spec)
    }
}

pub fn agents_dir() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/agents")
}

/// The next line as text; panics with what came instead.
pub fn expect_line(agent: &mut AgentProcess) -> String {
    match agent
        .read_line(64 << 10, Instant::now() + PATIENCE)
        .unwrap()
    {
        ReadLine::Line { bytes, .. } => String::from_utf8(bytes).unwrap(),
        other => panic!(
            "{other:?}; {:?}; {}",
            agent.diagnose_end(PATIENCE),
            agent.stderr_tail()
        ),
    }
}

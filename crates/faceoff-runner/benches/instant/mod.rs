//! The benchmarks' agent, which answers at once: the benchmark's own program, started with `--agent`.

use faceoff_runner::{AgentEnvironment, Supervision, TimeLimits, bundle::Bundle};
use faceoff_sandbox::{Isolation, Limits, Runtime};
use faceoff_wire::{Manifest, StandardOutput};
use std::{
    collections::BTreeMap,
    fs,
    io::{BufRead, BufReader, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// An action of the cubic interpolation with all digits, as a real agent sends them.
pub const ACTION: &str = "[[0.012345678901234567,-0.19612345678901234,0.0001234567890123456,\
-1.8436123456789012,0.0012345678901234567,0.97041234567890123,0.0123456789012345],\
[0.12345678901234567,-0.49612345678901234,0.5001234567890123,-1.1436123456789012,\
0.7012345678901234,0.27041234567890123,-0.4123456789012345]]";

/// Answers every message at once, and parses as little as possible.
pub fn instant_agent() {
    let mut input = BufReader::with_capacity(64 << 10, std::io::stdin());
    let mut output = std::io::stdout();
    let (mut line, mut answer) = (Vec::new(), Vec::new());
    while input.read_until(b'\n', &mut line).unwrap() > 0 {
        answer.clear();
        if let Some(rest) = line.strip_prefix(b"{\"type\":\"step\",\"step\":") {
            let digits = rest.split(|byte| *byte == b',').next().unwrap();
            answer.extend_from_slice(b"{\"type\":\"act\",\"step\":");
            answer.extend_from_slice(digits);
            answer.extend_from_slice(b",\"action\":");
            answer.extend_from_slice(ACTION.as_bytes());
            answer.extend_from_slice(b"}\n");
        } else if let Some(rest) = line.strip_prefix(b"{\"type\":\"reset\",\"episode\":") {
            let digits = rest.split(|byte| *byte == b'}').next().unwrap();
            answer.extend_from_slice(b"{\"type\":\"ready\",\"episode\":");
            answer.extend_from_slice(digits);
            answer.extend_from_slice(b"}\n");
        } else if line.starts_with(b"{\"type\":\"hello\"") {
            answer.extend_from_slice(b"{\"type\":\"ready\",\"protocol\":1,\"interpolation\":3}\n");
        } else if line.starts_with(b"{\"type\":\"bye\"") {
            return;
        }
        output.write_all(&answer).unwrap();
        output.flush().unwrap();
        line.clear();
    }
}

/// A bundle that contains this program.
pub struct InstantAgent {
    _dir: tempfile::TempDir,
    pub bundle: Bundle,
}

impl InstantAgent {
    pub fn new() -> Self {
        let dir = tempfile::Builder::new()
            .permissions(fs::Permissions::from_mode(0o755))
            .tempdir()
            .unwrap();
        fs::copy(std::env::current_exe().unwrap(), dir.path().join("agent")).unwrap();
        let manifest = Manifest {
            name: "instant".into(),
            command: vec!["./agent".into(), "--agent".into()],
            runtime: "native".into(),
            interpolation: Some(3),
            stdout: StandardOutput::Answers,
            env: BTreeMap::new(),
        };
        let bundle = Bundle {
            dir: Path::new(dir.path()).to_owned(),
            manifest,
            image: None,
        };
        Self { _dir: dir, bundle }
    }
}

/// The default limits, with this isolation.
pub fn environment(isolation: Isolation) -> AgentEnvironment {
    AgentEnvironment {
        limits: Limits::default(),
        time: TimeLimits::default(),
        isolation,
        runtimes: BTreeMap::from([("native".to_owned(), Runtime::native())]),
        images: false,
        agent_cpus: Vec::new(),
        supervision: Supervision::default(),
        simulator: faceoff_airhockey::simulator(),
    }
}

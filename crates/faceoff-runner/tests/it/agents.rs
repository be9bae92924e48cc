//! Test agents in Python, each a real process.

use faceoff_runner::{AgentEnvironment, Supervision, TimeLimits, bundle::Bundle};
use faceoff_sandbox::{Isolation, Limits, Runtime, RuntimeFiles};
use faceoff_types::{AgentFaultKind, Phase};
use faceoff_wire::{Manifest, StandardOutput};
use std::{collections::BTreeMap, fs, os::unix::fs::PermissionsExt};
use tempfile::TempDir;

/// A complete agent that keeps its initial pose, with hooks for misbehaviour: `on_hello(hello)`, `on_reset(episode)` and
/// `on_step(step, answer)`, which returns the line to send, or `None` for no answer. They
/// replace `#HOOKS`.
const AGENT_TEMPLATE: &str = r#"
import json, os, sys, time
INTERPOLATION = 3
def on_hello(hello): pass
def on_reset(episode): pass
def on_step(step, answer): return json.dumps(answer)
def say(line):
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
#HOOKS
start_position = None
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        env = message["env"]
        on_hello(message)
        say(json.dumps({"type": "ready", "protocol": 1, "interpolation": INTERPOLATION}))
    elif kind == "reset":
        start_position = None
        on_reset(message["episode"])
        say(json.dumps({"type": "ready", "episode": message["episode"]}))
    elif kind == "step":
        obs = message["obs"]
        if start_position is None:
            start_position = [obs[i] for i in env["joint_pos_ids"]]
        action = {1: start_position, 3: [start_position, [0.0] * 7]}.get(INTERPOLATION)
        answer = on_step(message["step"], {"type": "act", "step": message["step"], "action": action})
        if answer is not None:
            say(answer)
    elif kind == "bye":
        print("goodbye", file=sys.stderr)
        break
"#;

/// A bundle whose agent is [`AGENT_TEMPLATE`] with hooks.
pub struct Agent {
    _dir: TempDir,
    pub bundle: Bundle,
}

impl Agent {
    /// An agent without misbehaviour.
    pub fn behaving() -> Self {
        Self::with_hooks("")
    }

    /// An agent with these hooks, in Python.
    pub fn with_hooks(hooks: &str) -> Self {
        Self::script(&AGENT_TEMPLATE.replace("#HOOKS", hooks))
    }

    /// An agent with this Python program instead of [`AGENT_TEMPLATE`].
    pub fn script(script: &str) -> Self {
        let dir = tempfile::Builder::new()
            .permissions(fs::Permissions::from_mode(0o755))
            .tempdir()
            .unwrap();
        fs::write(dir.path().join("agent.py"), script).unwrap();
        let manifest = Manifest {
            name: "test".into(),
            command: vec!["python3".into(), "agent.py".into()],
            runtime: "python3".into(),
            interpolation: None,
            stdout: StandardOutput::Answers,
            env: BTreeMap::new(),
        };
        let bundle = Bundle {
            dir: dir.path().to_owned(),
            manifest,
            image: None,
        };
        Self { _dir: dir, bundle }
    }

    /// Changes the agent's manifest.
    pub fn manifest(mut self, change: impl FnOnce(&mut Manifest)) -> Self {
        change(&mut self.bundle.manifest);
        self
    }
}

/// The full sandbox, with deadlines so long that load on the machine does not matter.
pub fn sandboxed_environment() -> AgentEnvironment {
    AgentEnvironment {
        limits: Limits {
            memory_bytes: 256 << 20,
            pids: 20,
            ..Limits::default()
        },
        time: TimeLimits {
            startup_s: 600.0,
            reset_s: 600.0,
            step_s: 600.0,
            bye_s: 600.0,
            mean_s: 600.0,
            episode_extra_s: 600.0,
            resets_extra_s: 600.0,
            // Tests of other features must not depend on other load of the host.
            host_interference_reruns: 0,
            ..TimeLimits::default()
        },
        isolation: Isolation::Sandboxed {
            disabled_layers: Vec::new(),
        },
        runtimes: BTreeMap::from([
            ("native".to_owned(), Runtime::native()),
            (
                "python3".to_owned(),
                Runtime::python3().expect("a python3 for the tests"),
            ),
        ]),
        images: true,
        agent_cpus: Vec::new(),
        supervision: Supervision::default(),
        simulator: faceoff_airhockey::simulator(),
    }
}

/// The sandbox with a short step limit, for agents that never answer.
pub fn short_step_limit_environment() -> AgentEnvironment {
    let mut env = sandboxed_environment();
    env.time.step_s = 0.5;
    env
}

/// A developer's own agent, without the sandbox.
pub fn unconfined_environment() -> AgentEnvironment {
    let mut env = sandboxed_environment();
    env.isolation = Isolation::None;
    env.runtimes.insert(
        "python3".into(),
        Runtime {
            read_only_paths: Vec::new(),
            path: std::env::var("PATH").unwrap(),
            files: RuntimeFiles::Host,
        },
    );
    env
}

/// Asserts that an agent exceeded the time limit of this phase.
#[track_caller]
pub fn assert_timed_out(fault: &AgentFaultKind, expected: Phase) {
    let is_expected = matches!(fault, AgentFaultKind::TimedOut { phase, .. } if *phase == expected);
    assert!(is_expected, "{fault:?}");
}

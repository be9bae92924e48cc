//! Supervision of the *evaluator* (the thread that waits for an agent's answers): a call that blocks it ends with the agent's
//! death.

use crate::{
    agents::{Agent, assert_timed_out, sandboxed_environment},
    shard::{RecordingObserver, spec},
};
use faceoff_airhockey::HIT;
use faceoff_runner::{
    AgentEnvironment, InterferenceMonitor, PlatformFault, Supervision, run_shard,
    run_shard_monitored, stuck_threads,
};
use faceoff_types::Phase;
use std::{
    fs,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

/// An agent that does not answer its second step. It sets its process name, so that the test can find it.
fn silent_agent(name: &str) -> Agent {
    const PR_SET_NAME: u32 = 15;
    Agent::with_hooks(&format!(
        "import ctypes\n\
         def on_step(step, answer):\n    \
         if step == 1:\n        \
         ctypes.CDLL(None).prctl({PR_SET_NAME}, b'{name}', 0, 0, 0)\n        \
         time.sleep(10_000)\n    \
         return json.dumps(answer)"
    ))
}

/// Is there a living process with this name?
fn is_alive(name: &str) -> bool {
    let named = format!("({name}) ");
    let processes = fs::read_dir("/proc").unwrap().flatten();
    processes
        .filter_map(|entry| fs::read_to_string(entry.path().join("stat")).ok())
        .any(|stat| {
            let state = stat.split_once(&named).map(|(_, rest)| rest);
            state.is_some_and(|state| !state.starts_with(['Z', 'X']))
        })
}

/// Blocks the evaluator until the agent with this process name is dead.
#[derive(Debug)]
struct BlockedByAgent(&'static str);

impl InterferenceMonitor for BlockedByAgent {
    fn interference(&self, _: Instant, _: Instant, _: Option<Duration>) -> Duration {
        while is_alive(self.0) {
            thread::sleep(Duration::from_millis(5));
        }
        Duration::ZERO
    }
}

fn short_limits_environment(supervision: Supervision) -> AgentEnvironment {
    let mut env = sandboxed_environment();
    env.time.step_s = 0.2;
    env.time.bye_s = 0.1;
    env.supervision = supervision.with_slack(Duration::from_millis(100));
    env
}

#[test]
fn agent_that_blocks_its_evaluator_is_killed_and_blamed() {
    const NAME: &str = "blocks-thread";
    let agent = silent_agent(NAME);
    let out = tempfile::tempdir().unwrap();
    let mut spec = spec(HIT, 0..2);
    spec.max_faults = 10;
    let report = run_shard_monitored(
        &spec,
        &agent.bundle,
        &short_limits_environment(Supervision::default()),
        out.path(),
        &mut RecordingObserver::default(),
        &BlockedByAgent(NAME),
    )
    .unwrap();
    assert_eq!(report.outcomes.len(), 2);
    for outcome in &report.outcomes {
        let fault = &outcome.fault.as_ref().unwrap().fault;
        assert_timed_out(fault, Phase::Step);
    }
    assert_eq!(stuck_threads(), [] as [String; 0]);
}

#[test]
fn cancelled_job_does_not_wait_for_its_agent() {
    const NAME: &str = "waits-cancelled";
    let agent = silent_agent(NAME);
    let out = tempfile::tempdir().unwrap();
    let cancelled = Arc::new(AtomicBool::new(false));
    let mut env = sandboxed_environment();
    // This limit is never reached.
    env.time.step_s = 3600.0;
    env.supervision = Supervision::new({
        let cancelled = Arc::clone(&cancelled);
        move || cancelled.load(Ordering::Relaxed)
    });
    let played = thread::scope(|scope| {
        let played = scope.spawn(|| {
            run_shard(
                &spec(HIT, 0..1),
                &agent.bundle,
                &env,
                out.path(),
                &mut RecordingObserver::default(),
            )
        });
        while !is_alive(NAME) {
            thread::yield_now();
        }
        cancelled.store(true, Ordering::Relaxed);
        played.join().unwrap()
    });
    assert!(
        matches!(played, Err(PlatformFault::Cancelled)),
        "{played:?}"
    );
    assert!(!is_alive(NAME));
}

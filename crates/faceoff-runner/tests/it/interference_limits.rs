//! Host interference (time in which the host let others run instead of the agent) counts towards no limit: not in a
//! validation's verdict, not in the reset budget, not in the start-up limit. A monitor that reports a fixed share of each wait
//! replaces the kernel's counters.

use crate::{
    agents::{Agent, assert_timed_out, sandboxed_environment},
    shard::{RecordingObserver, spec},
};
use faceoff_airhockey::HIT;
use faceoff_runner::{
    AgentEnvironment, InterferenceMonitor, PlatformFault, ValidationFailure, ValidationReport,
    ValidationSpec, run_shard_monitored, validate_monitored,
};
use faceoff_types::{AgentFaultKind, Phase, Seed};
use std::time::{Duration, Instant};

/// Attributes a fixed share (0 to 1) of every wait to the host.
#[derive(Debug)]
struct FixedShare(f64);

const NO_INTERFERENCE: FixedShare = FixedShare(0.0);
const NEARLY_ALL_INTERFERENCE: FixedShare = FixedShare(0.9999);

impl InterferenceMonitor for FixedShare {
    fn interference(&self, asked_at: Instant, now: Instant, _: Option<Duration>) -> Duration {
        (now - asked_at).mul_f64(self.0)
    }
}

fn run_validation(
    agent: &Agent,
    env: &AgentEnvironment,
    monitor: &FixedShare,
) -> Result<ValidationReport, PlatformFault> {
    let seed = Seed::from_number(0);
    let spec = ValidationSpec {
        ruleset: faceoff_airhockey::RULESET,
        profile: faceoff_airhockey::EVALUATION,
        perturbations: Default::default(),
        episodes_per_task: 1000,
        episodes_per_shard: 50,
        tasks: faceoff_airhockey::TASKS.to_vec(),
        seed,
        mismatch_seed: seed.model_mismatch(),
    };
    validate_monitored(&spec, &agent.bundle, env, &|| false, monitor)
}

#[test]
fn validation_mean_excludes_host_interference() {
    let agent = Agent::with_hooks(
        "def on_step(step, answer): time.sleep(0.012); return json.dumps(answer)",
    );
    let mut env = sandboxed_environment();
    env.time.mean_s = 0.006;
    let report = run_validation(&agent, &env, &NEARLY_ALL_INTERFERENCE).unwrap();
    assert_eq!(report.failure, None);
    let report = run_validation(&agent, &env, &NO_INTERFERENCE).unwrap();
    let Some(failure @ ValidationFailure::TooSlow { .. }) = &report.failure else {
        panic!("{:?}", report.failure)
    };
    let message = failure.to_string();
    for part in [
        "too slow",
        "0.0 ms of host interference on average",
        "the agent's processes ran",
    ] {
        assert!(message.contains(part), "{part} is not in: {message}");
    }
}

#[test]
fn validation_timeout_by_the_host_is_a_platform_fault() {
    let agent = Agent::with_hooks(
        "def on_step(step, answer): return None if step == 3 else json.dumps(answer)",
    );
    let mut env = sandboxed_environment();
    env.time.step_s = 0.1;
    for reruns in [0, 2] {
        env.time.host_interference_reruns = reruns;
        let result = run_validation(&agent, &env, &NEARLY_ALL_INTERFERENCE);
        assert!(
            matches!(result, Err(PlatformFault::HostBusy(_))),
            "{result:?}"
        );
    }
    let report = run_validation(&agent, &env, &NO_INTERFERENCE).unwrap();
    let Some(
        failure @ ValidationFailure::Fault {
            fault,
            wait: Some(wait),
        },
    ) = &report.failure
    else {
        panic!("{:?}", report.failure)
    };
    assert_timed_out(&fault.fault, Phase::Step);
    assert!(wait.wall >= Duration::from_millis(100), "{wait:?}");
    for message in [failure.to_string(), report.log] {
        assert!(
            message.contains("including 0.0 ms of host interference"),
            "{message}"
        );
        assert!(message.contains("the agent's processes ran"), "{message}");
    }
}

#[test]
fn start_up_limit_excludes_host_interference() {
    let agent = Agent::with_hooks("def on_hello(hello): time.sleep(1.0)");
    let mut env = sandboxed_environment();
    env.time.startup_s = 0.5;
    let report = run_validation(&agent, &env, &NO_INTERFERENCE).unwrap();
    let Some(ValidationFailure::Fault {
        fault,
        wait: Some(_),
    }) = report.failure
    else {
        panic!("{:?}", report.failure)
    };
    assert_timed_out(&fault.fault, Phase::StartUp);
    // The agent never starts; as long as the monitor blames the host, it is a platform fault.
    let result = run_validation(
        &Agent::with_hooks("def on_hello(hello): time.sleep(10_000)"),
        &env,
        &NEARLY_ALL_INTERFERENCE,
    );
    assert!(
        matches!(result, Err(PlatformFault::HostBusy(_))),
        "{result:?}"
    );
}

#[test]
fn reset_budget_excludes_host_interference() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks("def on_reset(episode): time.sleep(0.4)");
    let mut env = sandboxed_environment();
    (env.time.resets_extra_s, env.time.reset_mean_s) = (0.5, 1e-9);
    let play = |monitor| {
        let spec = spec(HIT, 0..3);
        let report = run_shard_monitored(
            &spec,
            &agent.bundle,
            &env,
            out.path(),
            &mut RecordingObserver::default(),
            monitor,
        );
        let faults = report
            .unwrap()
            .outcomes
            .into_iter()
            .filter_map(|outcome| outcome.fault);
        faults.map(|fault| fault.fault).collect::<Vec<_>>()
    };
    assert_eq!(play(&NEARLY_ALL_INTERFERENCE), []);
    let faults = play(&NO_INTERFERENCE);
    assert!(
        matches!(
            faults[0],
            AgentFaultKind::TimeBudget {
                phase: Phase::Reset,
                ..
            }
        ),
        "{faults:?}"
    );
}

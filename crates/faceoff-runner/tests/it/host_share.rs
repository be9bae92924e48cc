//! What the host took is in no limit: not in a smoke run's verdict, not in the budgets of resets, not in the
//! start. A judge that is put in the place of the counters says what it took.

use crate::{
    agents::{Agent, sandboxed},
    shard::{Watcher, spec},
};
use faceoff_runner::{
    AgentEnvironment, HostWatch, PlatformFault, SmokeDefect, SmokeReport, SmokeSpec,
    run_shard_watched, smoke_watched,
};
use faceoff_types::{AgentFaultKind, Phase, Seed, Task};
use std::time::{Duration, Instant};

/// The host took this share of every wait.
#[derive(Debug)]
struct Took(f64);

const NOTHING: Took = Took(0.0);
const NEARLY_ALL: Took = Took(0.9999);

impl HostWatch for Took {
    fn taken(&self, asked: Instant, now: Instant, _: Option<Duration>) -> Duration {
        (now - asked).mul_f64(self.0)
    }
}

fn smoked(
    agent: &Agent,
    env: &AgentEnvironment,
    watch: &Took,
) -> Result<SmokeReport, PlatformFault> {
    let seed = Seed::from_number(0);
    let spec = SmokeSpec {
        seed,
        mismatch_seed: seed.model_mismatch(),
    };
    smoke_watched(&spec, &agent.bundle, env, &|| false, watch)
}

#[test]
fn a_smoke_runs_mean_is_the_agents_alone_and_a_refusal_tells_the_rest() {
    let agent =
        Agent::with("def on_step(step, answer): time.sleep(0.012); return json.dumps(answer)");
    let mut env = sandboxed();
    env.time.mean_s = 0.006;
    let report = smoked(&agent, &env, &NEARLY_ALL).unwrap();
    assert_eq!(report.defect, None);
    let report = smoked(&agent, &env, &NOTHING).unwrap();
    let Some(defect @ SmokeDefect::TooSlow { .. }) = &report.defect else {
        panic!("{:?}", report.defect)
    };
    let told = defect.to_string();
    for part in [
        "too slow",
        "0.0 ms in the mean that the host took",
        "the agent's processes ran",
    ] {
        assert!(told.contains(part), "{part} is not in: {told}");
    }
}

#[test]
fn an_upload_that_the_host_kept_from_answering_is_our_fault_and_a_silent_one_is_told_whose_time_it_was()
 {
    let agent =
        Agent::with("def on_step(step, answer): return None if step == 3 else json.dumps(answer)");
    let mut env = sandboxed();
    env.time.step_s = 0.1;
    for reruns in [0, 2] {
        env.time.host_noise_reruns = reruns;
        let ours = smoked(&agent, &env, &NEARLY_ALL);
        assert!(matches!(ours, Err(PlatformFault::HostBusy(_))), "{ours:?}");
    }
    let report = smoked(&agent, &env, &NOTHING).unwrap();
    let Some(
        defect @ SmokeDefect::Fault {
            fault,
            waited: Some(waited),
        },
    ) = &report.defect
    else {
        panic!("{:?}", report.defect)
    };
    assert!(
        matches!(
            fault.fault,
            AgentFaultKind::TimedOut {
                phase: Phase::Step,
                ..
            }
        ),
        "{fault:?}"
    );
    assert!(waited.wall >= Duration::from_millis(100), "{waited:?}");
    for told in [defect.to_string(), report.log] {
        assert!(told.contains("of which the host took 0.0 ms"), "{told}");
        assert!(told.contains("the agent's processes ran"), "{told}");
    }
}

#[test]
fn a_start_that_the_host_holds_up_is_no_fault_of_the_agents() {
    let agent = Agent::with("def on_hello(hello): time.sleep(1.0)");
    let mut env = sandboxed();
    env.time.startup_s = 0.5;
    let late = smoked(&agent, &env, &NOTHING).unwrap();
    let Some(SmokeDefect::Fault {
        fault,
        waited: Some(_),
    }) = late.defect
    else {
        panic!("{:?}", late.defect)
    };
    assert!(
        matches!(
            fault.fault,
            AgentFaultKind::TimedOut {
                phase: Phase::StartUp,
                ..
            }
        ),
        "{fault:?}"
    );
    // As long as the host is said to be the cause, and the agent would never start, it is ours.
    let ours = smoked(
        &Agent::with("def on_hello(hello): time.sleep(10_000)"),
        &env,
        &NEARLY_ALL,
    );
    assert!(matches!(ours, Err(PlatformFault::HostBusy(_))), "{ours:?}");
}

#[test]
fn the_resets_budget_counts_what_is_the_agents() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with("def on_reset(episode): time.sleep(0.4)");
    let mut env = sandboxed();
    (env.time.resets_extra_s, env.time.reset_mean_s) = (0.5, 1e-9);
    let play = |watch| {
        let spec = spec(Task::Hit, 0..3);
        let report = run_shard_watched(
            &spec,
            &agent.bundle,
            &env,
            out.path(),
            &mut Watcher::default(),
            watch,
        );
        let faults = report
            .unwrap()
            .outcomes
            .into_iter()
            .filter_map(|outcome| outcome.fault);
        faults.map(|fault| fault.fault).collect::<Vec<_>>()
    };
    assert_eq!(play(&NEARLY_ALL), []);
    let faults = play(&NOTHING);
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

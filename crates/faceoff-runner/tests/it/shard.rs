//! Shards: ranges of episodes of one task, played by one agent, with their outcomes, faults and logs.

use crate::agents::{Agent, sandboxed_environment};
use faceoff_airhockey::{DEFEND, EVALUATION, HIT, PREPARE};
use faceoff_runner::{
    AgentEnvironment, Observer, PlatformFault, ShardReport, ShardSpec, run_shard,
};
use faceoff_types::{AgentFaultKind, EpisodeEnd, EpisodeOutcome, Seed, Task};
use std::{ops::Range, path::Path};

/// Records the events of a shard, and stops it after a number of episodes.
#[derive(Default)]
pub struct RecordingObserver {
    /// The episodes that are over.
    pub episodes: Vec<u32>,
    pub logs: Vec<String>,
    /// Number of episodes after which the shard is cancelled.
    pub stop_after: Option<usize>,
}

impl Observer for RecordingObserver {
    fn on_episode_end(&mut self, outcome: &EpisodeOutcome) {
        self.episodes.push(outcome.episode);
    }

    fn log(&mut self, log: &str) {
        self.logs.push(log.to_owned());
    }

    fn cancelled(&self) -> bool {
        self.stop_after
            .is_some_and(|count| self.episodes.len() >= count)
    }
}

/// A shard of these episodes.
pub fn spec(task: Task, episodes: Range<u32>) -> ShardSpec {
    let seed = Seed::from_number(7);
    ShardSpec {
        ruleset: faceoff_airhockey::RULESET,
        platform_retries: 0,
        task,
        episodes,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        max_faults: 2,
        perturbations: Default::default(),
    }
}

pub fn run(
    spec: &ShardSpec,
    agent: &Agent,
    env: &AgentEnvironment,
    out: &Path,
) -> Result<ShardReport, PlatformFault> {
    run_shard(
        spec,
        &agent.bundle,
        env,
        out,
        &mut RecordingObserver::default(),
    )
}

/// The outcomes without times, which depend on the host.
pub fn without_times(outcomes: &[EpisodeOutcome]) -> Vec<EpisodeOutcome> {
    outcomes
        .iter()
        .map(|outcome| EpisodeOutcome {
            computation_time: Default::default(),
            ..outcome.clone()
        })
        .collect()
}

#[test]
fn agent_plays_all_tasks_with_its_interpolation() {
    let out = tempfile::tempdir().unwrap();
    for (task, hooks) in [(HIT, ""), (DEFEND, "INTERPOLATION = 1"), (PREPARE, "")] {
        let agent = Agent::with_hooks(hooks);
        let dir = out.path().join(task.as_str());
        let report = run(&spec(task, 0..2), &agent, &sandboxed_environment(), &dir).unwrap();
        assert!(!report.stopped_by_faults);
        assert_eq!(
            report
                .outcomes
                .iter()
                .map(|o| o.episode)
                .collect::<Vec<_>>(),
            [0, 1]
        );
        for outcome in &report.outcomes {
            assert_eq!((outcome.task, &outcome.fault), (task, &None), "{outcome:?}");
            assert!(outcome.steps > 0 && outcome.steps <= faceoff_sim::EPISODE_STEPS);
            let time = outcome.computation_time;
            assert!(time.mean_s > 0.0 && time.mean_s <= time.max_s, "{time:?}");
        }
        assert_eq!(report.log, "goodbye\n");
    }
}

#[test]
fn results_do_not_depend_on_the_division_into_shards() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::behaving();
    let env = sandboxed_environment();
    let whole = run(&spec(DEFEND, 0..5), &agent, &env, &out.path().join("whole")).unwrap();
    let mut parts = Vec::new();
    for range in [3..5, 0..1, 1..3] {
        let dir = out.path().join(format!("from-{}", range.start));
        parts.extend(
            run(&spec(DEFEND, range), &agent, &env, &dir)
                .unwrap()
                .outcomes,
        );
    }
    parts.sort_by_key(|outcome| outcome.episode);
    assert_eq!(without_times(&parts), without_times(&whole.outcomes));
}

#[test]
fn fault_ends_its_episode_and_restarts_the_agent() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks(
        "count = 0\n\
         def on_reset(episode):\n    global count; count += 1; print('reset', episode, count, file=sys.stderr)\n    \
         global now; now = episode\n\
         def on_step(step, answer):\n    \
         return 'oops' if (now, step) == (1, 2) else json.dumps(answer)",
    );
    let report = run(
        &spec(PREPARE, 0..3),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    let [first, second, third] = &report.outcomes[..] else {
        panic!("three episodes: {report:?}");
    };
    assert_eq!((&first.fault, &third.fault), (&None, &None));
    assert_eq!(
        (second.end, second.success, second.steps),
        (EpisodeEnd::AGENT_FAULT, false, 2)
    );
    let fault = second.fault.as_ref().unwrap();
    assert!(
        matches!(fault.fault, AgentFaultKind::NotJson { .. }),
        "{fault}"
    );
    assert_eq!(
        (fault.agent_task, fault.episode, fault.step),
        (PREPARE.into(), Some(1), Some(2))
    );
    assert_eq!(fault.line.as_deref(), Some("oops"));
    // The counter shows the new process, and the log line shows the reason.
    assert!(
        report
            .log
            .starts_with("reset 0 1\nreset 1 2\n[faceoff] prepare, episode 1, step 2: ")
    );
    assert!(
        report.log.ends_with("reset 2 1\ngoodbye\n"),
        "{}",
        report.log
    );
    // The other episodes are the same as without the fault.
    let undisturbed = run(
        &spec(PREPARE, 2..3),
        &Agent::behaving(),
        &sandboxed_environment(),
        &out.path().join("undisturbed"),
    );
    assert_eq!(
        without_times(&undisturbed.unwrap().outcomes),
        without_times(std::slice::from_ref(third))
    );
}

#[test]
fn too_many_faults_stop_the_shard() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks("def on_step(step, answer): sys.exit(3)");
    let report = run(
        &spec(HIT, 0..9),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    assert!(report.stopped_by_faults);
    assert_eq!(
        report.outcomes.len(),
        3,
        "two faults are allowed, the third ends the shard"
    );
    for outcome in &report.outcomes {
        let fault = outcome.fault.as_ref().unwrap();
        assert_eq!(fault.fault, AgentFaultKind::Exited { code: 3 });
    }
}

#[test]
fn failed_start_is_a_fault_without_an_episode() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::script("import sys\nsys.exit('no model')");
    let report = run(
        &spec(HIT, 0..1),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    let fault = report.outcomes[0].fault.as_ref().unwrap();
    assert_eq!(fault.fault, AgentFaultKind::Exited { code: 1 });
    assert_eq!((fault.episode, fault.step), (None, None));
    assert_eq!(report.outcomes[0].episode, 0);
    assert!(report.log.starts_with("no model\n"), "{}", report.log);
}

#[test]
fn cancelled_shard_leaves_no_recording() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks("print('started', file=sys.stderr)");
    let mut observer = RecordingObserver {
        stop_after: Some(1),
        ..RecordingObserver::default()
    };
    let dir = out.path().join("shard");
    let result = run_shard(
        &spec(DEFEND, 0..3),
        &agent.bundle,
        &sandboxed_environment(),
        &dir,
        &mut observer,
    );
    assert!(
        matches!(result, Err(PlatformFault::Cancelled)),
        "{result:?}"
    );
    assert_eq!(observer.episodes, [0]);
    assert_eq!(observer.logs, ["started\n"]);
    assert!(!dir.join("shard.json").exists());
    // The same folder can be used again.
    run(&spec(DEFEND, 0..1), &agent, &sandboxed_environment(), &dir).unwrap();
    let mut names: Vec<_> = dir
        .read_dir()
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "agent.log",
            "clips",
            "episodes.parquet",
            "report.json",
            "shard.json",
            "steps.parquet"
        ]
    );
}

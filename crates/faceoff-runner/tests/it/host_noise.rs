//! Late answers, and whose fault they are: real agents, and a host that stalls or says that it does.

use crate::{
    agents::{Agent, impatient, sandboxed, unconfined},
    recording::{floats, ints, read, seconds},
    shard::{Watcher, run, spec, timeless},
};
use arrow_array::Array;
use faceoff_runner::{
    AgentEnvironment, HostWatch, ShardReport, ShardSpec, run_shard, run_shard_watched,
};
use faceoff_types::{AgentFaultKind, Task};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Answers the second step of each episode late without doing anything.
const SLEEPS: &str = "def on_step(step, answer):\n    \
    if step == 1: time.sleep(0.15)\n    \
    return json.dumps(answer)";

/// Tells by a file that the host is to have stalled, which takes an agent without a sandbox.
struct Mark(PathBuf);

impl Mark {
    fn of(out: &Path) -> Self {
        Self(out.join("stalled"))
    }

    /// Hooks in which `stall()` leaves the mark and `go_on()` removes it.
    fn hooks(&self, hooks: &str) -> String {
        let path = self.0.to_str().unwrap();
        format!(
            "def stall(): open({path:?}, 'w').close()\n\
             def go_on(): os.remove({path:?})\n{hooks}"
        )
    }
}

/// Stalled while the mark is there, whatever the host really does.
impl HostWatch for Mark {
    fn stalled_s(&self, from: Instant, to: Instant) -> f64 {
        if self.0.exists() {
            (to - from).as_secs_f64()
        } else {
            0.0
        }
    }
}

/// Computes for longer than half of the largest limit.
const COMPUTES: &str = "def on_step(step, answer):\n    \
    if step == 1: stall()\n    \
    if step == 2: go_on()\n    \
    until = time.process_time() + 0.15\n    \
    while step == 1 and time.process_time() < until: pass\n    \
    return json.dumps(answer)";

struct NeverStalled;

impl HostWatch for NeverStalled {
    fn stalled_s(&self, _: Instant, _: Instant) -> f64 {
        0.0
    }
}

struct AlwaysStalled;

impl HostWatch for AlwaysStalled {
    fn stalled_s(&self, from: Instant, to: Instant) -> f64 {
        (to - from).as_secs_f64()
    }
}

fn env(reruns: u32) -> AgentEnvironment {
    let mut env = sandboxed();
    env.time.host_noise_reruns = reruns;
    env
}

fn developers() -> AgentEnvironment {
    let mut env = unconfined();
    env.time.host_noise_reruns = 2;
    env
}

fn watched(
    spec: &ShardSpec,
    agent: &Agent,
    env: &AgentEnvironment,
    watch: &dyn HostWatch,
    out: &Path,
) -> ShardReport {
    run_shard_watched(
        spec,
        &agent.bundle,
        env,
        out,
        &mut Watcher::default(),
        watch,
    )
    .unwrap()
}

#[test]
fn an_agent_that_sleeps_is_not_excused() {
    let out = tempfile::tempdir().unwrap();
    let report = watched(
        &spec(Task::Hit, 0..2),
        &Agent::with(SLEEPS),
        &env(2),
        &NeverStalled,
        out.path(),
    );
    assert_eq!(report.timing.host_noise_reruns, 0);
    for outcome in &report.outcomes {
        assert!(outcome.computation_time.max_s >= 0.15, "{outcome:?}");
        let time = &outcome.computation_time;
        assert!(faceoff_scoring::computation_time_penalty(time) >= 1.0);
    }
    let episodes = read(&out.path().join("episodes.parquet"));
    assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[0, 0]);
}

#[test]
fn an_agent_that_computes_is_not_excused_even_if_the_host_stalls() {
    let out = tempfile::tempdir().unwrap();
    let mark = Mark::of(out.path());
    let agent = Agent::with(&mark.hooks(COMPUTES));
    let spec = spec(Task::Hit, 0..1);
    let report = watched(&spec, &agent, &developers(), &mark, out.path());
    assert_eq!(report.timing.host_noise_reruns, 0);
    let steps = read(&out.path().join("steps.parquet"));
    assert!(seconds(&steps, "cpu_time_ns")[1] >= 0.15);
}

#[test]
fn an_episode_that_the_host_spoilt_is_played_again_and_the_dropped_try_leaves_no_trace() {
    let out = tempfile::tempdir().unwrap();
    let mark = Mark::of(out.path());
    let spec = spec(Task::Defend, 0..2);
    // The host stalls for the whole first try, which is late at least once; the second counts.
    let agent = Agent::with(&mark.hooks(
        "tries = 0\n\
         def on_reset(episode):\n    \
         global tries; tries += 1; print('reset', episode, file=sys.stderr)\n    \
         if tries == 1: stall()\n    \
         if tries == 2: go_on()\n\
         def on_step(step, answer):\n    \
         if step == 3 and tries == 1: time.sleep(0.15)\n    \
         return json.dumps(answer)",
    ));
    let dir = out.path().join("spoilt");
    let report = watched(&spec, &agent, &developers(), &mark, &dir);
    assert_eq!(report.timing.host_noise_reruns, 1);
    assert_eq!(report.log, "reset 0\nreset 0\nreset 1\ngoodbye\n");
    let episodes = read(&dir.join("episodes.parquet"));
    assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[1, 0]);
    assert_eq!(ints(&episodes, "episode").values(), &[0, 1]);

    // Same seed, same bits, as if nothing had happened.
    let plain = out.path().join("plain");
    let undisturbed = run(&spec, &Agent::behaving(), &sandboxed(), &plain).unwrap();
    assert_eq!(timeless(&report.outcomes), timeless(&undisturbed.outcomes));
    let [spoilt, plain] = [dir, plain].map(|dir| read(&dir.join("steps.parquet")));
    for name in ["obs_puck_x", "puck_x", "ee_z", "constraint_ee"] {
        assert_eq!(floats(&spoilt, name), floats(&plain, name), "{name}");
    }
    assert_eq!(ints(&spoilt, "step"), ints(&plain, "step"));
}

#[test]
fn reruns_are_bounded_and_the_last_try_counts() {
    let out = tempfile::tempdir().unwrap();
    for reruns in [0, 2] {
        let report = watched(
            &spec(Task::Hit, 0..1),
            &Agent::with(SLEEPS),
            &env(reruns),
            &AlwaysStalled,
            out.path(),
        );
        assert_eq!(report.timing.host_noise_reruns, reruns);
        assert_eq!(report.outcomes.len(), 1);
        assert!(report.outcomes[0].computation_time.max_s >= 0.15);
        let episodes = read(&out.path().join("episodes.parquet"));
        assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[reruns]);
    }
}

#[test]
fn a_hard_limit_that_passed_while_the_host_stalled_is_tried_again_before_it_is_a_fault() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with("def on_step(step, answer): return None");
    let mut env = impatient();
    env.time.host_noise_reruns = 1;
    let mut spec = spec(Task::Hit, 0..1);
    spec.max_faults = 0;
    let report = watched(&spec, &agent, &env, &AlwaysStalled, out.path());
    assert_eq!(report.timing.host_noise_reruns, 1);
    let fault = report.outcomes[0].fault.as_ref().unwrap();
    assert!(matches!(fault.fault, AgentFaultKind::TimedOut { .. }));
    let notes: Vec<&str> = report
        .log
        .lines()
        .filter(|line| line.starts_with("[faceoff]"))
        .collect();
    assert_eq!(notes.len(), 3, "{}", report.log);
    assert!(notes[1].contains("not counted"), "{}", notes[1]);

    let punished = watched(&spec, &agent, &env, &NeverStalled, out.path());
    assert_eq!(punished.timing.host_noise_reruns, 0);
    assert!(punished.outcomes[0].fault.is_some());
}

/// The platform really stands still here: a developer's agent, which no sandbox keeps from it, stops
/// the process that asks it, for 0.15 s from when each of its threads is seen to stand still.
#[test]
fn a_service_that_was_stopped_is_seen_by_the_watch() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with(
        "import signal\n\
         def stands(thread):\n    \
         try: return open(f'/proc/{os.getppid()}/task/{thread}/stat').read().rpartition(')')[2].split()[0] == 'T'\n    \
         except OSError: return True\n\
         def on_step(step, answer):\n    \
         if step == 2:\n        \
         os.kill(os.getppid(), signal.SIGSTOP)\n        \
         while not all(map(stands, os.listdir(f'/proc/{os.getppid()}/task'))): time.sleep(0.001)\n        \
         time.sleep(0.15); os.kill(os.getppid(), signal.SIGCONT)\n    \
         return json.dumps(answer)",
    );
    let report = run_shard(
        &spec(Task::Hit, 0..1),
        &agent.bundle,
        &developers(),
        out.path(),
        &mut Watcher::default(),
    )
    .unwrap();
    assert!(report.timing.longest_stall_s >= 0.15, "{:?}", report.timing);
}

#[test]
fn an_agent_that_sleeps_does_not_look_like_a_stall() {
    let out = tempfile::tempdir().unwrap();
    let report = run_shard(
        &spec(Task::Hit, 0..4),
        &Agent::with(SLEEPS).bundle,
        &env(2),
        out.path(),
        &mut Watcher::default(),
    )
    .unwrap();
    // A busy host stalls, too, now and then, and then is blamed; a calm one never is.
    let timing = report.timing;
    assert!(
        timing.longest_stall_s > 0.0 || timing.host_noise_reruns == 0,
        "{timing:?}"
    );
    assert_eq!(report.outcomes.len(), 4);
}

#[test]
fn the_noise_floor_is_measured_before_and_between_episodes() {
    let out = tempfile::tempdir().unwrap();
    let report = run(
        &spec(Task::Hit, 0..2),
        &Agent::behaving(),
        &sandboxed(),
        out.path(),
    )
    .unwrap();
    let timing = report.timing;
    assert_eq!((timing.before_s.count, timing.during_s.count), (200, 20));
    for trips in [timing.before_s, timing.during_s] {
        assert!(trips.p50 > 0.0 && trips.p50 <= trips.p99 && trips.p99 <= trips.max);
    }
}

#[test]
fn cpu_time_is_measured_without_a_sandbox_too_and_counts_children() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with(
        "import subprocess\n\
         BURN = 'import sys, time\\nwhile time.process_time() < 0.15: pass\\n'\\\n    \
         'print(1, flush=True)\\nsys.stdin.read()'\n\
         def on_step(step, answer):\n    \
         global child\n    \
         if step == 1:\n        \
         child = subprocess.Popen([sys.executable, '-c', BURN], stdin=-1, stdout=-1)\n        \
         child.stdout.readline()\n    \
         return json.dumps(answer)",
    );
    let mut env = developers();
    env.time.host_noise_reruns = 0;
    run(&spec(Task::Hit, 0..1), &agent, &env, out.path()).unwrap();
    let steps = read(&out.path().join("steps.parquet"));
    let column = steps.column_by_name("cpu_time_ns").unwrap();
    assert_eq!(column.null_count(), 0);
    let cpu_time_s = seconds(&steps, "cpu_time_ns");
    assert!(cpu_time_s[1] >= 0.15, "{}", cpu_time_s[1]);
    assert!(cpu_time_s[3] < 0.15, "{}", cpu_time_s[3]);
}

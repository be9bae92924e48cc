//! Late answers and *host interference* (time in which the host let others run instead of the agent): real agents, with real
//! interference or with a fixed monitor.

use crate::{
    agents::{Agent, sandboxed_environment, unconfined_environment},
    recording::{floats, ints, read_table, seconds},
    shard::{RecordingObserver, run, spec, without_times},
};
use arrow_array::Array;
use faceoff_airhockey::{DEFEND, HIT};
use faceoff_runner::{
    AgentEnvironment, InterferenceMonitor, ShardReport, ShardSpec, run_shard, run_shard_monitored,
};
use faceoff_sandbox::affinity;
use faceoff_types::AgentFaultKind;
use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

/// Sleeps before it answers the second step of each episode.
const SLEEPING_HOOKS: &str = "def on_step(step, answer):\n    \
    if step == 1: time.sleep(0.15)\n    \
    return json.dumps(answer)";

/// Does not answer the fourth step.
const HANGING_HOOKS: &str = "def on_hello(hello): print('a new process', file=sys.stderr)\n\
    def on_step(step, answer):\n    \
    return None if step == 3 else json.dumps(answer)";

/// Attributes a fixed share (0 to 1) of every wait to the host.
#[derive(Debug)]
struct FixedShare(f64);

impl InterferenceMonitor for FixedShare {
    fn interference(&self, asked_at: Instant, now: Instant, _: Option<Duration>) -> Duration {
        (now - asked_at).mul_f64(self.0)
    }
}

/// Sets the maximum reruns per episode, and per 100 episodes. A rerun repeats an episode that host interference ended; the column
/// `host_noise_reruns` counts them.
fn with_reruns(mut env: AgentEnvironment, per_episode: u32, per_100: u32) -> AgentEnvironment {
    env.time.host_interference_reruns = per_episode;
    env.time.host_interference_reruns_per_100 = per_100;
    env
}

/// The sandbox with this step limit, for agents that do not answer in time.
fn with_step_limit(step_s: f64) -> AgentEnvironment {
    let mut env = sandboxed_environment();
    env.time.step_s = step_s;
    env
}

fn run_monitored(
    spec: &ShardSpec,
    agent: &Agent,
    env: &AgentEnvironment,
    monitor: &dyn InterferenceMonitor,
    out: &Path,
) -> ShardReport {
    run_shard_monitored(
        spec,
        &agent.bundle,
        env,
        out,
        &mut RecordingObserver::default(),
        monitor,
    )
    .unwrap()
}

#[test]
fn sleeping_agent_is_not_excused() {
    let out = tempfile::tempdir().unwrap();
    let env = with_reruns(sandboxed_environment(), 2, 100);
    let agent = Agent::with_hooks(SLEEPING_HOOKS);
    let report = run_monitored(&spec(HIT, 0..2), &agent, &env, &FixedShare(0.0), out.path());
    assert_eq!(report.timing.host_interference_reruns, 0);
    for outcome in &report.outcomes {
        assert!(outcome.computation_time.max_s >= 0.15, "{outcome:?}");
        let time = &outcome.computation_time;
        assert!(faceoff_scoring::computation_time_penalty(time) >= 1.0);
    }
    let episodes = read_table(&out.path().join("episodes.parquet"));
    assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[0, 0]);
}

#[test]
fn host_interference_is_subtracted_from_a_late_answer() {
    let out = tempfile::tempdir().unwrap();
    let env = with_reruns(sandboxed_environment(), 2, 100);
    let agent = Agent::with_hooks(SLEEPING_HOOKS);
    let report = run_monitored(&spec(HIT, 0..1), &agent, &env, &FixedShare(0.5), out.path());
    assert_eq!(report.timing.host_interference_reruns, 0);
    let steps = read_table(&out.path().join("steps.parquet"));
    let (counted, host) = (
        seconds(&steps, "computation_time_ns"),
        seconds(&steps, "host_time_ns"),
    );
    let (counted_s, host_s) = (counted[1], host[1]);
    assert!(host_s >= 0.075, "half of at least 150 ms: {host_s}");
    // The other half counts, with the CPU time that the agent used after the answer before.
    let early_cpu_s = counted_s - host_s;
    assert!((-1e-9..0.05).contains(&early_cpu_s), "{counted_s} {host_s}");
    assert_eq!(
        report.outcomes[0].computation_time.max_s,
        counted.iter().copied().fold(0.0, f64::max)
    );
    assert_eq!(
        report.timing.max_host_interference_s,
        host.iter().copied().fold(0.0, f64::max)
    );
}

#[test]
fn episode_ended_by_the_host_is_rerun_by_a_new_process() {
    let out = tempfile::tempdir().unwrap();
    let spec = spec(DEFEND, 0..2);
    // Without a sandbox the second process can detect that it is not the first.
    let mark = out.path().join("mark of the first process");
    let agent = Agent::with_hooks(&format!(
        "def on_hello(hello): print('a new process', file=sys.stderr)\n\
         def on_reset(episode): print('reset', episode, file=sys.stderr)\n\
         def on_step(step, answer):\n    \
         if step == 3 and not os.path.exists({mark:?}):\n        \
         open({mark:?}, 'w').close(); return None\n    \
         return json.dumps(answer)"
    ));
    let mut env = with_reruns(unconfined_environment(), 2, 100);
    env.time.step_s = 0.5;
    let dir = out.path().join("rerun");
    let report = run_monitored(&spec, &agent, &env, &FixedShare(1.0), &dir);
    assert_eq!(report.timing.host_interference_reruns, 1);
    let agent_lines: Vec<&str> = report
        .log
        .lines()
        .filter(|line| !line.starts_with("[faceoff]"))
        .collect();
    let expected = [
        "a new process",
        "reset 0",
        "a new process",
        "reset 0",
        "reset 1",
        "goodbye",
    ];
    assert_eq!(agent_lines, expected);
    let episodes = read_table(&dir.join("episodes.parquet"));
    assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[1, 0]);
    assert_eq!(ints(&episodes, "episode").values(), &[0, 1]);

    // Same seed, same bits, as without the interruption.
    let undisturbed_dir = out.path().join("undisturbed");
    let undisturbed = run(
        &spec,
        &Agent::behaving(),
        &sandboxed_environment(),
        &undisturbed_dir,
    )
    .unwrap();
    assert_eq!(
        without_times(&report.outcomes),
        without_times(&undisturbed.outcomes)
    );
    let [rerun, undisturbed] =
        [dir, undisturbed_dir].map(|dir| read_table(&dir.join("steps.parquet")));
    for name in ["obs_puck_x", "puck_x", "ee_z", "constraint_ee"] {
        assert_eq!(floats(&rerun, name), floats(&undisturbed, name), "{name}");
    }
    assert_eq!(ints(&rerun, "step"), ints(&undisturbed, "step"));
}

#[test]
fn reruns_are_bounded_and_the_last_try_counts() {
    let out = tempfile::tempdir().unwrap();
    // Maximum reruns per episode and per 100 episodes (for the three episodes here 3/100 of it, rounded up), and the reruns of each
    // episode.
    for (per_episode, per_100, expected) in
        [(0, 100, [0, 0, 0]), (2, 100, [2, 1, 0]), (2, 5, [1, 0, 0])]
    {
        let env = with_reruns(with_step_limit(0.1), per_episode, per_100);
        let mut spec = spec(HIT, 0..3);
        spec.max_faults = 10;
        let report = run_monitored(
            &spec,
            &Agent::with_hooks(HANGING_HOOKS),
            &env,
            &FixedShare(1.0),
            out.path(),
        );
        assert_eq!(report.outcomes.len(), 3);
        for outcome in &report.outcomes {
            let fault = outcome.fault.as_ref().map(|fault| &fault.fault);
            assert!(
                matches!(fault, Some(AgentFaultKind::TimedOut { .. })),
                "{fault:?}"
            );
        }
        let episodes = read_table(&out.path().join("episodes.parquet"));
        assert_eq!(ints(&episodes, "host_noise_reruns").values(), &expected);
        let total: u32 = expected.iter().sum();
        assert_eq!(report.timing.host_interference_reruns, total);
        // Every try had its own process.
        let processes = report.log.lines().filter(|line| *line == "a new process");
        let processes = processes.count();
        assert_eq!(processes, 3 + total as usize, "{}", report.log);
        let notes = report.log.matches("not counted").count();
        assert_eq!(notes, total as usize, "{}", report.log);
    }
}

#[test]
fn step_limit_is_extended_only_by_host_interference() {
    let out = tempfile::tempdir().unwrap();
    let late = "def on_step(step, answer):\n    \
        if step == 1: time.sleep(1.5)\n    \
        return json.dumps(answer)";
    let env = with_reruns(with_step_limit(1.0), 2, 100);
    let agent = Agent::with_hooks(late);
    let play = |share| {
        run_monitored(
            &spec(HIT, 0..1),
            &agent,
            &env,
            &FixedShare(share),
            out.path(),
        )
        .outcomes
        .remove(0)
    };
    let fault = play(0.0).fault.unwrap();
    assert!(
        matches!(fault.fault, AgentFaultKind::TimedOut { .. }),
        "{fault:?}"
    );
    assert_eq!(play(1.0).fault, None);
}

/// Storms of simultaneous events on the agent's own CPU: a name, and Python code. `at` is the instant of the events, as
/// seconds and nanoseconds. Such storms once distorted the measurement of host interference; their time must count as
/// the agent's.
const STORMS: [(&str, &str); 6] = [
    (
        "timers that send signals",
        "event = (ctypes.c_int * 16)(0, 0, signal.SIGCONT, 0)\n    \
         for _ in range(40_000):\n        \
         timer = ctypes.c_void_p()\n        \
         if libc.timer_create(1, ctypes.byref(event), ctypes.byref(timer)): break\n        \
         libc.timer_settime(timer, 1, (ctypes.c_long * 4)(0, 0, *at), None)",
    ),
    (
        "timers behind descriptors",
        "for _ in range(900):\n        \
         fd = libc.timerfd_create(1, 0)\n        \
         if fd < 0: break\n        \
         libc.timerfd_settime(fd, 1, (ctypes.c_long * 4)(0, 0, *at), None)",
    ),
    (
        "an interval timer in each of many processes",
        "children = []\n    \
         for _ in range(15):\n        \
         child = os.fork()\n        \
         if child == 0:\n            \
         signal.signal(signal.SIGALRM, lambda *_: None)\n            \
         signal.setitimer(signal.ITIMER_REAL, 0.05, 0.0001)\n            \
         until = time.monotonic() + 0.1\n            \
         while time.monotonic() < until: time.sleep(0.01)\n            \
         os._exit(0)\n        \
         children.append(child)\n    \
         for child in children: os.waitpid(child, 0)",
    ),
    (
        "threads that sleep to one instant",
        "def run():\n        \
         time.sleep(max(0, at[0] + at[1] * 1e-9 - time.monotonic()))\n        \
         for _ in range(50): time.sleep(0.001)\n    \
         threads = [threading.Thread(target=run) for _ in range(15)]\n    \
         for thread in threads: thread.start()\n    \
         for thread in threads: thread.join()",
    ),
    (
        "processes that start and end",
        "until = time.monotonic() + 0.1\n    \
         while time.monotonic() < until:\n        \
         children = []\n        \
         for _ in range(8):\n            \
         children.append(os.fork())\n            \
         if children[-1] == 0: os._exit(0)\n        \
         for child in children: os.waitpid(child, 0)",
    ),
    (
        "memory up to the limit",
        "for _ in range(2): hoard = bytearray(90 << 20); hoard[::4096] = bytes(len(hoard[::4096]))",
    ),
];

/// Run time of all processes on a CPU plus its steal time, in seconds, if cgroup version 1 reports it.
fn busy_s(cpu: usize) -> Option<f64> {
    let usage_per_cpu = fs::read_to_string("/sys/fs/cgroup/cpuacct/cpuacct.usage_percpu").ok()?;
    let ran_ns: f64 = usage_per_cpu.split_whitespace().nth(cpu)?.parse().ok()?;
    let stat = fs::read_to_string("/proc/stat").ok()?;
    let name = format!("cpu{cpu} ");
    let line = stat.lines().find_map(|line| line.strip_prefix(&name))?;
    // The eighth number of the line is the steal time, in ticks of 10 ms.
    let stolen_ticks: f64 = line.split_whitespace().nth(7)?.parse().ok()?;
    Some(ran_ns * 1e-9 + stolen_ticks * 0.01)
}

#[test]
fn event_storms_of_the_agent_are_not_host_interference() {
    let out = tempfile::tempdir().unwrap();
    let cpu = *affinity::allowed_cpus().unwrap().last().unwrap();
    for (name, storm) in STORMS {
        let agent = Agent::with_hooks(&format!(
            "import ctypes, signal, threading\n\
             libc = ctypes.CDLL(None)\n\
             signal.signal(signal.SIGCONT, lambda *_: None)\n\
             def start_storm(at):\n    {storm}\n\
             def on_step(step, answer):\n    \
             if step in range(5, 50, 5):\n        \
             nanoseconds = time.monotonic_ns() + 50_000_000\n        \
             start_storm(divmod(nanoseconds, 10**9))\n        \
             while time.monotonic_ns() < nanoseconds + 100_000_000: time.sleep(0.001)\n    \
             return json.dumps(answer)"
        ));
        let mut env = with_reruns(sandboxed_environment(), 2, 100);
        env.agent_cpus = vec![cpu];
        env.limits.pids = 40;
        let before_s = busy_s(cpu);
        let report = run_shard(
            &spec(HIT, 0..1),
            &agent.bundle,
            &env,
            out.path(),
            &mut RecordingObserver::default(),
        )
        .unwrap();
        let after_s = busy_s(cpu);
        assert_eq!(report.outcomes[0].fault, None, "{name}");
        assert_eq!(report.timing.host_interference_reruns, 0, "{name}");
        let steps = read_table(&out.path().join("steps.parquet"));
        let [host, counted, cpu_time] = ["host_time_ns", "computation_time_ns", "cpu_time_ns"]
            .map(|name| seconds(&steps, name));
        // The steps with a storm.
        for step in (5..50).step_by(5).take_while(|step| *step < host.len()) {
            assert!(host[step] + counted[step] >= 0.15, "{name}: step {step}");
        }
        // Independent check: interference cannot exceed the run time of other processes on this CPU.
        if let (Some(before_s), Some(after_s)) = (before_s, after_s) {
            let others_s = after_s - before_s - cpu_time.iter().sum::<f64>();
            let interference_s: f64 = host.iter().sum();
            // Ticks of the steal time are rounded down.
            assert!(
                interference_s <= others_s + 0.02,
                "{name}: {interference_s} of {others_s}"
            );
        }
    }
}

#[test]
fn missing_cgroup_yields_no_host_interference() {
    let out = tempfile::tempdir().unwrap();
    let report = run_shard(
        &spec(HIT, 0..1),
        &Agent::with_hooks(SLEEPING_HOOKS).bundle,
        &with_reruns(unconfined_environment(), 2, 100),
        out.path(),
        &mut RecordingObserver::default(),
    )
    .unwrap();
    assert_eq!(report.timing.max_host_interference_s, 0.0);
    let steps = read_table(&out.path().join("steps.parquet"));
    assert!(
        seconds(&steps, "host_time_ns")
            .iter()
            .all(|time| *time == 0.0)
    );
    assert!(seconds(&steps, "computation_time_ns")[1] >= 0.15);
}

/// Programs of the host, outside of the agent's cgroup, that never sleep.
struct BusyLoops(Vec<std::process::Child>);

impl BusyLoops {
    fn on(cpu: usize) -> Self {
        let script = format!(
            "import os\nos.sched_setaffinity(0, [{cpu}])\n\
             print(flush=True)\nwhile os.getppid() != 1: sum(range(1000))"
        );
        let child = |_| {
            let child = std::process::Command::new("python3")
                .args(["-c", &script])
                .stdout(std::process::Stdio::null())
                .spawn();
            child.unwrap()
        };
        Self((0..3).map(child).collect())
    }
}

impl Drop for BusyLoops {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // The child may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[test]
fn other_load_on_the_agents_cpu_is_measured() {
    let out = tempfile::tempdir().unwrap();
    let cpu = *affinity::allowed_cpus().unwrap().last().unwrap();
    let mut env = sandboxed_environment();
    env.agent_cpus = vec![cpu];
    // The agent gets only a part of the CPU, and each of its steps needs 0.1 s of CPU time.
    let busy_loops = BusyLoops::on(cpu);
    let agent = Agent::with_hooks(
        "def on_step(step, answer):\n    \
         until = time.thread_time() + 0.1\n    \
         while step in range(1, 6) and time.thread_time() < until: pass\n    \
         return json.dumps(answer)",
    );
    let report = run(&spec(HIT, 0..1), &agent, &env, out.path());
    drop(busy_loops);
    report.unwrap();
    let steps = read_table(&out.path().join("steps.parquet"));
    let [host, counted, cpu_time] =
        ["host_time_ns", "computation_time_ns", "cpu_time_ns"].map(|name| seconds(&steps, name));
    if cpu_time[1] == 0.0 || host.iter().all(|time| *time == 0.0) {
        panic!("no interference was measured: {host:?} {counted:?} {cpu_time:?}");
    }
    for step in 1..6 {
        // The kernel's counters lag by a tick.
        assert!(
            counted[step] + 0.02 >= cpu_time[step],
            "{step}: {counted:?} {cpu_time:?}"
        );
    }
}

/// Helper processes of an agent that wait for the CPU while its main thread sleeps (a name, and Python code): with the
/// policies `SCHED_IDLE` and `SCHED_BATCH`, or with ordinary priority; all the time, or briefly each time.
const HELPERS: [(&str, &str); 4] = [
    (
        "idle",
        "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\n        while True: time.sleep(2e-5)",
    ),
    (
        "batch",
        "os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))\n        while True: time.sleep(2e-5)",
    ),
    (
        "idle that never sleep",
        "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\n        while True: pass",
    ),
    ("ordinary", "while True: time.sleep(2e-5)"),
];

#[test]
fn waits_of_helpers_do_not_excuse_a_sleeping_agent() {
    let cpu = *affinity::allowed_cpus().unwrap().last().unwrap();
    for (name, body) in HELPERS {
        let agent = Agent::with_hooks(&format!(
            "def run_helper():\n        {body}\n\
             def on_hello(hello):\n    \
             for _ in range(8):\n        \
             if os.fork() == 0: run_helper()\n\
             def on_step(step, answer):\n    \
             if step in range(1, 4): time.sleep(0.5)\n    \
             return json.dumps(answer)",
        ));
        let mut env = with_reruns(sandboxed_environment(), 2, 100);
        env.agent_cpus = vec![cpu];
        let out = tempfile::tempdir().unwrap();
        let busy_loops = BusyLoops::on(cpu);
        let report = run(&spec(HIT, 0..1), &agent, &env, out.path());
        drop(busy_loops);
        let report = report.unwrap();
        assert_eq!(report.outcomes[0].fault, None, "{name}: {}", report.log);
        assert_eq!(report.timing.host_interference_reruns, 0, "{name}");
        let steps = read_table(&out.path().join("steps.parquet"));
        let [host, counted] =
            ["host_time_ns", "computation_time_ns"].map(|name| seconds(&steps, name));
        let shares: Vec<f64> = (1..4)
            .map(|step| host[step] / (host[step] + counted[step]))
            .collect();
        // At the end of its sleep, the agent may have to wait for the CPU: long, if other programs use it as well. The helpers' waits
        // would excuse every step.
        assert!(
            shares.iter().any(|share| *share <= 0.3),
            "{name}: {shares:?} of the time are attributed to the host"
        );
    }
}

/// The noise floor is the delay that the host adds to the answers of a test agent which answers at once.
#[test]
fn noise_floor_is_measured_before_and_between_episodes() {
    let out = tempfile::tempdir().unwrap();
    let report = run(
        &spec(HIT, 0..2),
        &Agent::behaving(),
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    let timing = report.timing;
    assert_eq!((timing.before_s.count, timing.during_s.count), (200, 20));
    for round_trips in [timing.before_s, timing.during_s] {
        assert!(round_trips.p50 > 0.0 && round_trips.p50 <= round_trips.p99);
        assert!(round_trips.p99 <= round_trips.max);
    }
}

#[test]
fn cpu_time_without_a_sandbox_includes_children() {
    let out = tempfile::tempdir().unwrap();
    let agent = Agent::with_hooks(
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
    run(
        &spec(HIT, 0..1),
        &agent,
        &unconfined_environment(),
        out.path(),
    )
    .unwrap();
    let steps = read_table(&out.path().join("steps.parquet"));
    let column = steps.column_by_name("cpu_time_ns").unwrap();
    assert_eq!(column.null_count(), 0);
    let cpu_time_s = seconds(&steps, "cpu_time_ns");
    assert!(cpu_time_s[1] >= 0.15, "{}", cpu_time_s[1]);
    assert!(cpu_time_s[3] < 0.15, "{}", cpu_time_s[3]);
}

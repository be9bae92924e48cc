//! Late answers, and whose time they are: real agents, and a host that takes time or is said to.

use crate::{
    agents::{Agent, sandboxed, unconfined},
    recording::{floats, ints, read, seconds},
    shard::{Watcher, run, spec, timeless},
};
use arrow_array::Array;
use faceoff_runner::{
    AgentEnvironment, HostWatch, ShardReport, ShardSpec, run_shard, run_shard_watched,
};
use faceoff_sandbox::affinity;
use faceoff_types::{AgentFaultKind, Task};
use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

/// Answers the second step of each episode late without doing anything.
const SLEEPS: &str = "def on_step(step, answer):\n    \
    if step == 1: time.sleep(0.15)\n    \
    return json.dumps(answer)";

/// Answers nothing at the fourth step.
const HANGS: &str = "def on_hello(hello): print('a new process', file=sys.stderr)\n\
    def on_step(step, answer):\n    \
    return None if step == 3 else json.dumps(answer)";

/// The host took this share of every wait, whatever it really did.
#[derive(Debug)]
struct Took(f64);

impl HostWatch for Took {
    fn taken(&self, asked: Instant, now: Instant, _: Option<Duration>) -> Duration {
        (now - asked).mul_f64(self.0)
    }
}

/// Re-runs: of one episode, and of 100.
fn with_reruns(mut env: AgentEnvironment, of_one: u32, of_100: u32) -> AgentEnvironment {
    env.time.host_noise_reruns = of_one;
    env.time.host_noise_reruns_per_100 = of_100;
    env
}

/// With a short limit of a step, for agents that meet it because they never answer.
fn impatient(step_s: f64) -> AgentEnvironment {
    let mut env = sandboxed();
    env.time.step_s = step_s;
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
    let env = with_reruns(sandboxed(), 2, 100);
    let agent = Agent::with(SLEEPS);
    let report = watched(&spec(Task::Hit, 0..2), &agent, &env, &Took(0.0), out.path());
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
fn a_late_answer_counts_less_what_the_host_took_and_nothing_is_played_again() {
    let out = tempfile::tempdir().unwrap();
    let env = with_reruns(sandboxed(), 2, 100);
    let agent = Agent::with(SLEEPS);
    let report = watched(&spec(Task::Hit, 0..1), &agent, &env, &Took(0.5), out.path());
    assert_eq!(report.timing.host_noise_reruns, 0);
    let steps = read(&out.path().join("steps.parquet"));
    let (counted, host) = (
        seconds(&steps, "computation_time_ns"),
        seconds(&steps, "host_time_ns"),
    );
    assert!((counted[1] - host[1]).abs() < 1e-6, "{counted:?} {host:?}");
    assert!(counted[1] + host[1] >= 0.15, "{counted:?} {host:?}");
    assert_eq!(
        report.outcomes[0].computation_time.max_s,
        counted.iter().copied().fold(0.0, f64::max)
    );
    assert_eq!(
        report.timing.longest_stall_s,
        host.iter().copied().fold(0.0, f64::max)
    );
}

#[test]
fn an_episode_that_the_host_ended_is_played_again_by_a_new_process_and_leaves_no_trace() {
    let out = tempfile::tempdir().unwrap();
    let spec = spec(Task::Defend, 0..2);
    // Without a sandbox the second process can tell that it is not the first.
    let mark = out.path().join("mark");
    let agent = Agent::with(&format!(
        "def on_hello(hello): print('a new process', file=sys.stderr)\n\
         def on_reset(episode): print('reset', episode, file=sys.stderr)\n\
         def on_step(step, answer):\n    \
         if step == 3 and not os.path.exists({mark:?}):\n        \
         open({mark:?}, 'w').close(); return None\n    \
         return json.dumps(answer)"
    ));
    let mut env = with_reruns(unconfined(), 2, 100);
    env.time.step_s = 0.5;
    let dir = out.path().join("ended");
    let report = watched(&spec, &agent, &env, &Took(1.0), &dir);
    assert_eq!(report.timing.host_noise_reruns, 1);
    let said: Vec<&str> = report
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
    assert_eq!(said, expected);
    let episodes = read(&dir.join("episodes.parquet"));
    assert_eq!(ints(&episodes, "host_noise_reruns").values(), &[1, 0]);
    assert_eq!(ints(&episodes, "episode").values(), &[0, 1]);

    // Same seed, same bits, as if nothing had happened.
    let plain = out.path().join("plain");
    let undisturbed = run(&spec, &Agent::behaving(), &sandboxed(), &plain).unwrap();
    assert_eq!(timeless(&report.outcomes), timeless(&undisturbed.outcomes));
    let [ended, plain] = [dir, plain].map(|dir| read(&dir.join("steps.parquet")));
    for name in ["obs_puck_x", "puck_x", "ee_z", "constraint_ee"] {
        assert_eq!(floats(&ended, name), floats(&plain, name), "{name}");
    }
    assert_eq!(ints(&ended, "step"), ints(&plain, "step"));
}

#[test]
fn reruns_are_bounded_per_episode_and_in_all_and_the_last_try_counts() {
    let out = tempfile::tempdir().unwrap();
    for (of_one, of_100, expected) in [(0, 100, [0, 0, 0]), (2, 100, [2, 1, 0]), (2, 5, [1, 0, 0])]
    {
        let env = with_reruns(impatient(0.1), of_one, of_100);
        let mut spec = spec(Task::Hit, 0..3);
        spec.max_faults = 10;
        let report = watched(&spec, &Agent::with(HANGS), &env, &Took(1.0), out.path());
        assert_eq!(report.outcomes.len(), 3);
        for outcome in &report.outcomes {
            let fault = outcome.fault.as_ref().map(|fault| &fault.fault);
            assert!(
                matches!(fault, Some(AgentFaultKind::TimedOut { .. })),
                "{fault:?}"
            );
        }
        let episodes = read(&out.path().join("episodes.parquet"));
        assert_eq!(ints(&episodes, "host_noise_reruns").values(), &expected);
        let in_all: u32 = expected.iter().sum();
        assert_eq!(report.timing.host_noise_reruns, in_all);
        // Every try had a process of its own.
        let processes = report.log.lines().filter(|line| *line == "a new process");
        let processes = processes.count();
        assert_eq!(processes, 3 + in_all as usize, "{}", report.log);
        let notes = report.log.matches("not counted").count();
        assert_eq!(notes, in_all as usize, "{}", report.log);
    }
}

#[test]
fn a_hard_limit_goes_on_by_what_the_host_took_and_by_nothing_else() {
    let out = tempfile::tempdir().unwrap();
    let late = "def on_step(step, answer):\n    \
        if step == 1: time.sleep(1.5)\n    \
        return json.dumps(answer)";
    let env = with_reruns(impatient(1.0), 2, 100);
    let agent = Agent::with(late);
    let play = |share| {
        watched(
            &spec(Task::Hit, 0..1),
            &agent,
            &env,
            &Took(share),
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

/// Ways to let many things happen at one instant on the agent's own CPU, which once starved the witness
/// of the host's stalls: what comes of each is the agent's time.
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

/// Run time of everything on a CPU and what a machine below took of it, seconds, where version 1 of the
/// cgroup interface tells.
fn busy_s(cpu: usize) -> Option<f64> {
    let each = fs::read_to_string("/sys/fs/cgroup/cpuacct/cpuacct.usage_percpu").ok()?;
    let ran_ns: f64 = each.split_whitespace().nth(cpu)?.parse().ok()?;
    let stat = fs::read_to_string("/proc/stat").ok()?;
    let name = format!("cpu{cpu} ");
    let line = stat.lines().find_map(|line| line.strip_prefix(&name))?;
    let stolen_ticks: f64 = line.split_whitespace().nth(7)?.parse().ok()?;
    Some(ran_ns * 1e-9 + stolen_ticks * 0.01)
}

#[test]
fn no_storm_of_the_agents_own_is_put_down_to_the_host() {
    let out = tempfile::tempdir().unwrap();
    let cpu = *affinity::allowed().unwrap().last().unwrap();
    for (name, storm) in STORMS {
        let agent = Agent::with(&format!(
            "import ctypes, signal, threading\n\
             libc = ctypes.CDLL(None)\n\
             signal.signal(signal.SIGCONT, lambda *_: None)\n\
             def unleash(at):\n    {storm}\n\
             def on_step(step, answer):\n    \
             if step in range(5, 50, 5):\n        \
             nanoseconds = time.monotonic_ns() + 50_000_000\n        \
             unleash(divmod(nanoseconds, 10**9))\n        \
             while time.monotonic_ns() < nanoseconds + 100_000_000: time.sleep(0.001)\n    \
             return json.dumps(answer)"
        ));
        let mut env = with_reruns(sandboxed(), 2, 100);
        env.agent_cpus = vec![cpu];
        env.limits.pids = 40;
        let before_s = busy_s(cpu);
        let report = run_shard(
            &spec(Task::Hit, 0..1),
            &agent.bundle,
            &env,
            out.path(),
            &mut Watcher::default(),
        )
        .unwrap();
        let after_s = busy_s(cpu);
        assert_eq!(report.outcomes[0].fault, None, "{name}");
        assert_eq!(report.timing.host_noise_reruns, 0, "{name}");
        let steps = read(&out.path().join("steps.parquet"));
        let [host, counted, cpu] = ["host_time_ns", "computation_time_ns", "cpu_time_ns"]
            .map(|name| seconds(&steps, name));
        for storm in (5..50).step_by(5).take_while(|step| *step < host.len()) {
            assert!(host[storm] + counted[storm] >= 0.15, "{name}: step {storm}");
        }
        // Another witness: more than what others ran there all the while cannot have been taken.
        if let (Some(before_s), Some(after_s)) = (before_s, after_s) {
            let others_s = after_s - before_s - cpu.iter().sum::<f64>();
            let taken_s: f64 = host.iter().sum();
            // Ticks of the stolen time are cut off.
            assert!(
                taken_s <= others_s + 0.02,
                "{name}: {taken_s} of {others_s}"
            );
        }
    }
}

#[test]
fn without_a_cgroup_there_is_no_evidence_and_no_excuse() {
    let out = tempfile::tempdir().unwrap();
    let report = run_shard(
        &spec(Task::Hit, 0..1),
        &Agent::with(SLEEPS).bundle,
        &with_reruns(unconfined(), 2, 100),
        out.path(),
        &mut Watcher::default(),
    )
    .unwrap();
    assert_eq!(report.timing.longest_stall_s, 0.0);
    let steps = read(&out.path().join("steps.parquet"));
    assert!(
        seconds(&steps, "host_time_ns")
            .iter()
            .all(|time| *time == 0.0)
    );
    assert!(seconds(&steps, "computation_time_ns")[1] >= 0.15);
}

/// Programs of the host's, outside of the agent's cgroup, that never sleep.
struct Burners(Vec<std::process::Child>);

impl Burners {
    fn on(cpu: usize) -> Self {
        let burn = format!(
            "import os\nos.sched_setaffinity(0, [{cpu}])\n\
             print(flush=True)\nwhile os.getppid() != 1: sum(range(1000))"
        );
        let burner = |_| {
            let burner = std::process::Command::new("python3")
                .args(["-c", &burn])
                .stdout(std::process::Stdio::null())
                .spawn();
            burner.unwrap()
        };
        Self((0..3).map(burner).collect())
    }
}

impl Drop for Burners {
    fn drop(&mut self) {
        for burner in &mut self.0 {
            // One that has ended is fine.
            let _ = burner.kill();
            let _ = burner.wait();
        }
    }
}

#[test]
fn what_others_run_on_the_agents_cpu_is_told_apart() {
    let out = tempfile::tempdir().unwrap();
    let cpu = *affinity::allowed().unwrap().last().unwrap();
    let mut env = sandboxed();
    env.agent_cpus = vec![cpu];
    // More of them than the agent's share: each of its steps needs 0.1 s of a CPU that it has a part of.
    let burners = Burners::on(cpu);
    let agent = Agent::with(
        "def on_step(step, answer):\n    \
         until = time.thread_time() + 0.1\n    \
         while step in range(1, 6) and time.thread_time() < until: pass\n    \
         return json.dumps(answer)",
    );
    let report = run(&spec(Task::Hit, 0..1), &agent, &env, out.path());
    drop(burners);
    report.unwrap();
    let steps = read(&out.path().join("steps.parquet"));
    let [host, counted, cpu] =
        ["host_time_ns", "computation_time_ns", "cpu_time_ns"].map(|name| seconds(&steps, name));
    if cpu[1] == 0.0 || host.iter().all(|time| *time == 0.0) {
        panic!("nothing was told apart: {host:?} {counted:?} {cpu:?}");
    }
    for step in 1..6 {
        // The kernel tells what runs now a tick later.
        assert!(
            counted[step] + 0.02 >= cpu[step],
            "{step}: {counted:?} {cpu:?}"
        );
    }
}

/// Helpers that wait for the CPU in the sleeping main thread's place: of lowest priority, in no hurry, always or for
/// an instant each, or as anybody.
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
fn waits_of_helpers_are_not_the_sleeping_agents() {
    let cpu = *affinity::allowed().unwrap().last().unwrap();
    for (name, body) in HELPERS {
        let agent = Agent::with(&format!(
            "def help():\n        {body}\n\
             def on_hello(hello):\n    \
             for _ in range(8):\n        \
             if os.fork() == 0: help()\n\
             def on_step(step, answer):\n    \
             if step in range(1, 4): time.sleep(0.5)\n    \
             return json.dumps(answer)",
        ));
        let mut env = with_reruns(sandboxed(), 2, 100);
        env.agent_cpus = vec![cpu];
        let out = tempfile::tempdir().unwrap();
        let burners = Burners::on(cpu);
        let report = run(&spec(Task::Hit, 0..1), &agent, &env, out.path());
        drop(burners);
        let report = report.unwrap();
        assert_eq!(report.outcomes[0].fault, None, "{name}: {}", report.log);
        assert_eq!(report.timing.host_noise_reruns, 0, "{name}");
        let steps = read(&out.path().join("steps.parquet"));
        let [host, counted] =
            ["host_time_ns", "computation_time_ns"].map(|name| seconds(&steps, name));
        for step in 1..4 {
            // To be woken at the end of its sleep it may have to wait for others' turn.
            assert!(
                host[step] <= 0.3 * (host[step] + counted[step]),
                "{name}: of {} s the host is said to have taken {} s",
                host[step] + counted[step],
                host[step]
            );
        }
    }
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
    run(&spec(Task::Hit, 0..1), &agent, &unconfined(), out.path()).unwrap();
    let steps = read(&out.path().join("steps.parquet"));
    let column = steps.column_by_name("cpu_time_ns").unwrap();
    assert_eq!(column.null_count(), 0);
    let cpu_time_s = seconds(&steps, "cpu_time_ns");
    assert!(cpu_time_s[1] >= 0.15, "{}", cpu_time_s[1]);
    assert!(cpu_time_s[3] < 0.15, "{}", cpu_time_s[3]);
}

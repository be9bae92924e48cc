//! Agents that try to gain an unfair advantage, on a real server and with its evaluator: thinking time that is not charged to
//! them, faked host interference (time that other load on the machine took), messages to another agent. Each attack has
//! several variants.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{python_agent, python_bundle},
    program, repository,
    server::Server,
};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// First argument of each program in `tests/agents`. It marks the processes for tests that search them; here none does.
const PROCESS_MARK: &str = "mark";

/// A bundle that runs the program `file` of `tests/agents` in place of an agent; the program's report goes to the log.
fn reporting_bundle(scratch: &Path, name: &str, file: &str, arguments: &[&str]) -> PathBuf {
    let source = format!(
        "import runpy, sys\n\
         sys.argv[1:] = {arguments:?}\n\
         sys.stdout = sys.stderr\n\
         runpy.run_path({file:?}, run_name='__main__')\n\
         sys.exit(3)\n"
    );
    let folder = python_bundle(scratch, name, &source);
    let program = repository().join("tests/agents").join(file);
    fs::copy(program, folder.join(file)).expect("the program is there");
    folder
}

/// Submits the bundle and returns its report. The submission is invalid, since the program is no agent.
fn report(server: &Server, name: &str, folder: &Path) -> Value {
    let verdict = Team::create(server, name).submit(server, folder);
    assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    let log = verdict["log"].as_str().expect("an invalid agent has a log");
    let line = log
        .lines()
        .find(|line| line.starts_with('{'))
        .unwrap_or_else(|| panic!("no report in {log}"));
    serde_json::from_str(line).expect("a report is JSON")
}

/// The channel between evaluator and agent consists of the agent's standard input, output and error.
#[test]
fn agent_cannot_reopen_or_resize_its_channel() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let folder = reporting_bundle(
        scratch.path(),
        "reopens",
        "reopens_channel.py",
        &[PROCESS_MARK],
    );
    let answers = report(&server, "Reopens", &folder);
    let attempts = answers.as_object().expect("a report is an object");
    for attempt in [
        "own /proc/self/fd/0 write",
        "own /proc/self/fd/1 read",
        "/dev/stdin",
    ] {
        assert!(attempts.contains_key(attempt), "{attempt} was not made");
    }
    for (attempt, answer) in attempts {
        assert_ne!(answer, "ok", "{attempt}");
    }
    for attempt in ["shrink input", "shrink output", "shrink copy"] {
        assert_eq!(attempts[attempt], "EPERM", "{attempt}");
    }

    let folder = reporting_bundle(scratch.path(), "timers", "makes_timers.py", &[PROCESS_MARK]);
    let timer_report = report(&server, "Timers", &folder);
    assert!(
        timer_report["timers"]
            .as_u64()
            .is_some_and(|timers| timers <= 256),
        "{timer_report}"
    );
}

#[test]
fn agent_leaves_no_trace_visible_to_another_teams_agent() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // Libraries of the runtimes are copied to memory, as by default: agents then share these copies.
    let config = CONFIG.replace("resident_bytes = 0", "");
    let server = Server::start(&scratch.path().join("data"), &config);
    // The first agent uses locks, leases, hints, notifications, advice, non-blocking reads, counters, terminals, kernel
    // objects and files, on a file that both can read. The second makes the same calls, and gets the same answers as the first.
    let shared_file = "library";
    // The first run of the program leaves traces, the second looks for them. Both report the answers of the kernel.
    let [first_agent, second_agent] = ["leave", "look"].map(|action| {
        let arguments = [PROCESS_MARK, shared_file, action];
        let folder = reporting_bundle(scratch.path(), action, "covert_channel.py", &arguments);
        report(&server, action, &folder)
    });
    assert_eq!(first_agent, second_agent);
    // Each call or observation of the program, with its error, its value or `ok`.
    for (call, answer) in [
        ("exclusive_lock_of_file", "ENOSYS"),
        ("lock_query", "ok"),
        ("open_file_lock", "EINVAL"),
        ("read_if_in_memory", "ENOTSUP"),
        ("mincore", "ENOSYS"),
        ("cachestat", "ENOSYS"),
        ("inotify_init1", "ENOSYS"),
        ("asynchronous_slots", "ENOSYS"),
        ("write_hint", "EINVAL"),
        ("new_terminal", "ENOENT"),
        ("shared_segments", "0"),
        ("semaphores", "0"),
        ("queues", "0"),
        ("leftover_queue", "gone"),
        ("system_forks", "same"),
        ("leftover_files", ""),
        ("system_locks", "EACCES"),
    ] {
        assert_eq!(second_agent[call], answer, "{call}");
    }
}

/// Evaluates an agent with `faceoff eval`, which evaluates as the server does; returns the results.
fn evaluate_locally(scratch: &Path, name: &str, source: &str, config: &str) -> Value {
    let folder = python_bundle(scratch, name, source);
    let config_file = scratch.join(format!("{name}.toml"));
    let long_time_limits = include_str!("../long_time_limits.toml");
    fs::write(&config_file, format!("{long_time_limits}\n{config}"))
        .expect("a scratch file can be written");
    let out = scratch.join(format!("{name}-out"));
    let output = Command::new(program("faceoff"))
        .arg("eval")
        .arg(&folder)
        .args([
            "--task",
            "hit",
            "--episodes",
            "1",
            "--allow-faults",
            "--config",
        ])
        .arg(&config_file)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the program can be started");
    assert!(output.status.success(), "{name}: {output:?}");
    let results = fs::read(out.join("results.json")).expect("there are results");
    serde_json::from_slice(&results).expect("results are JSON")
}

/// Statements that cause many events at one instant, each within 0.15 s. Each was once mistaken for host interference.
/// The timers use clock 1, CLOCK_MONOTONIC, and expire after 50 ms.
const EVENT_STORMS: [(&str, &str); 4] = [
    (
        "timers",
        "libc = ctypes.CDLL(None)\n\
         for _ in range(40_000):\n    \
         timer = ctypes.c_void_p()\n    \
         if libc.timer_create(1, (ctypes.c_int * 16)(0, 0, signal.SIGCONT, 0), ctypes.byref(timer)): break\n    \
         libc.timer_settime(timer, 0, (ctypes.c_long * 4)(0, 0, 0, 50_000_000), None)\n\
         time.sleep(0.15)",
    ),
    (
        "descriptors",
        "libc = ctypes.CDLL(None)\n\
         for _ in range(900):\n    \
         fd = libc.timerfd_create(1, 0)\n    \
         if fd < 0: break\n    \
         libc.timerfd_settime(fd, 0, (ctypes.c_long * 4)(0, 0, 0, 50_000_000), None)\n\
         time.sleep(0.15)",
    ),
    (
        "threads",
        "threads = [threading.Thread(target=time.sleep, args=(0.15,)) for _ in range(100)]\n\
         for thread in threads: thread.start()\n\
         for thread in threads: thread.join()",
    ),
    (
        "processes",
        "until = time.monotonic() + 0.15\n\
         while time.monotonic() < until:\n    \
         child = os.fork()\n    \
         if child == 0: os._exit(0)\n    \
         os.waitpid(child, 0)",
    ),
];

#[test]
fn event_storm_of_agent_is_charged_to_agent() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    for (name, storm) in EVENT_STORMS {
        let body = storm.replace('\n', "\n    ");
        let source = python_agent(&format!("if message['step'] == 3:\n    {body}\nsay(hold)"));
        let source = format!(
            "import ctypes, signal, threading\nsignal.signal(signal.SIGCONT, lambda *_: None)\n{source}"
        );
        let result = evaluate_locally(scratch.path(), name, &source, "");
        assert_eq!(
            result["timing"]["host_noise_reruns"], 0,
            "{name}: {result:#}"
        );
        // All of the time is charged, except for host interference that is proven. `host_noise_reruns` counts episodes that were
        // repeated because of host interference, and `longest_stall_s` is the longest one.
        let charged_s = &result["tasks"]["hit"]["computation_time_s"]["max"];
        let host_s = &result["timing"]["longest_stall_s"];
        let (charged_s, host_s) = (charged_s.as_f64(), host_s.as_f64());
        assert!(
            charged_s
                .zip(host_s)
                .is_some_and(|(charged_s, host_s)| charged_s + host_s >= 0.15),
            "{name}: {result:#}"
        );
    }
}

#[test]
fn slow_answers_report_agent_and_host_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = CONFIG.replace("episodes_per_task = 4", "episodes_per_task = 8");
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Hesitant");
    // The agent answers step 3 of each episode slowly, alternately by computing and by sleeping. `TIMES` counts these answers.
    let source = python_agent(
        "if message['step'] == 3:\n    \
         until = time.process_time() + 0.25\n    \
         if TIMES % 2: time.sleep(0.25)\n    \
         while TIMES % 2 == 0 and time.process_time() < until: pass\n    \
         TIMES += 1\n\
         say(hold)",
    );
    let source = format!("TIMES = 0\n{source}");
    let folder = python_bundle(scratch.path(), "hesitant", &source);
    let submission = team.submit(&server, &folder);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let path = team.evaluate(&server, &submission);
    let finished = team.wait_until_finished(&server, &path);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let violations = server
        .get(&format!("{path}/violations"), Some(&team.token))
        .json::<Value>()
        .expect("the API speaks JSON");
    // Episodes in which the slow answer was computing, and in which it was sleeping.
    let (mut computed, mut slept) = (0, 0);
    for (task, task_violations) in violations["tasks"].as_object().expect("there are tasks") {
        let slow = task_violations["computation_time"]
            .as_array()
            .expect("a list");
        assert_eq!(slow.len(), 8, "{task}: {task_violations:#}");
        for episode in slow {
            let slowest = &episode["slowest"];
            let seconds = |field: &str| slowest[field].as_f64().expect("a time");
            let charged = episode["max_s"].as_f64().expect("a time");
            assert!(seconds("wall_s") >= 0.25, "{episode:#}");
            assert!((seconds("wall_s") - seconds("host_s") - charged).abs() < 1e-6);
            match seconds("cpu_s") {
                _ if slowest["step"] != 3 => {}
                cpu_s if cpu_s >= 0.25 => computed += 1,
                _ => slept += 1,
            }
        }
    }
    assert!(computed > 0 && slept > 0, "{computed} and {slept}");

    // The page shows the worst twenty episodes and links to the complete list.
    let page = server.get(&path.replace("/api/v1", ""), None);
    let page = page.text().expect("a page is text");
    assert!(page.contains("the worst 20 of 24 episodes"), "{page}");
    assert!(page.contains(&format!("{path}/violations")));
    let other = Team::create(&server, "Other");
    let other_answer = server.get(&format!("{path}/violations"), Some(&other.token));
    assert_eq!(other_answer.status(), 404);
}

/// Source of an agent that tries to think for 0.3 s without being charged: right before its answer is read it blocks its
/// output, by splicing from an empty socket, until it has thought about the next answer.
const BLOCKING_AGENT: &str = r#"
import json, os, socket, sys, threading, time

def block(fd, source):
    try:
        os.splice(source, fd, 1)
    except OSError as error:
        print(error, file=sys.stderr)

def say(answer):
    os.write(1, (json.dumps(answer) + "\n").encode())

held = None
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif message["type"] == "reset":
        say({"type": "ready", "episode": message["episode"]})
    elif message["type"] == "step":
        held = held or message["obs"][6:13]
        say({"type": "act", "step": message["step"], "action": [held, [0.0] * 7]})
        if message["step"] in (3, 4, 5):
            writer, reader = socket.socketpair()
            blocker = threading.Thread(target=block, args=(1, reader.fileno()))
            blocker.start()
            time.sleep(0.3)
            writer.close()
            blocker.join()
    elif message["type"] == "bye":
        sys.exit(0)
"#;

#[test]
fn thinking_behind_blocked_channel_is_charged() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // With the sandbox's filter of system calls (seccomp), and without it.
    for (name, config) in [
        ("filtered", ""),
        ("unfiltered", "[sandbox]\ngiven_up = [\"seccomp\"]"),
    ] {
        let result = evaluate_locally(scratch.path(), name, BLOCKING_AGENT, config);
        let hit = &result["tasks"]["hit"];
        let (charged_s, host_s) = (
            hit["computation_time_s"]["max"].as_f64(),
            result["timing"]["longest_stall_s"].as_f64(),
        );
        assert!(
            charged_s
                .zip(host_s)
                .is_some_and(|(charged_s, host_s)| charged_s + host_s >= 0.3),
            "{result:#}"
        );
        assert_eq!(result["timing"]["host_noise_reruns"], 0);
    }
}

//! Agents that try to choose their luck, on a real server and by the evaluator that it runs: free thinking
//! time, forged stalls, notes left for another agent. Each attack comes in variants that differ in a detail.

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

/// A program of `tests/agents`, run in place of an agent, with its report in the log.
fn reporting(scratch: &Path, name: &str, file: &str, arguments: &[&str]) -> PathBuf {
    let source = format!(
        "import runpy, sys\n\
         sys.argv[1:] = {arguments:?}\n\
         sys.stdout = sys.stderr\n\
         runpy.run_path({file:?}, run_name='__main__')\n\
         sys.exit(3)\n"
    );
    let folder = python_bundle(scratch, name, &source);
    let from = repository().join("tests/agents").join(file);
    fs::copy(from, folder.join(file)).expect("the program is there");
    folder
}

/// What it reported: no agent, so its upload is refused, with its log.
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

#[test]
fn no_agent_gets_at_the_ends_of_its_channel() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let folder = reporting(scratch.path(), "reopens", "reopens.py", &["mark"]);
    let found = report(&server, "Reopens", &folder);
    let answers = found.as_object().expect("a report is an object");
    for way in [
        "own /proc/self/fd/0 write",
        "own /proc/self/fd/1 read",
        "/dev/stdin",
    ] {
        assert!(answers.contains_key(way), "{way} was not tried");
    }
    for (way, answer) in answers {
        assert_ne!(answer, "ok", "{way}");
    }
    let shrinks = ["shrink input", "shrink output", "shrink copy"];
    for way in shrinks {
        assert_eq!(answers[way], "EPERM", "{way}");
    }

    let folder = reporting(scratch.path(), "timers", "makes_timers.py", &["mark"]);
    let made = report(&server, "Timers", &folder);
    assert!(
        made["timers"].as_u64().is_some_and(|timers| timers <= 256),
        "{made}"
    );
}

#[test]
fn what_one_teams_agent_leaves_another_teams_agent_does_not_find() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // Its runtimes in memory, as an organiser would have them.
    let config = CONFIG.replace("resident_bytes = 0", "");
    let server = Server::start(&scratch.path().join("data"), &config);
    // Locks, leases, hints, notices, advice, reads without waiting, counters, terminals, objects of the
    // kernel, files: each on a file that both see. The first leaves what it can, the second looks.
    let board = "library";
    let [before, after] = ["leave", "look"].map(|what| {
        let arguments = ["mark", board, what];
        let folder = reporting(scratch.path(), what, "notice_board.py", &arguments);
        report(&server, what, &folder)
    });
    assert_eq!(before, after);
    for (call, answer) in [
        ("flock", "ENOSYS"),
        ("lock_is_asked_for", "ok"),
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
        ("named_queue_left", "gone"),
        ("forks_of_all", "same"),
        ("files_left", ""),
        ("locks_of_all", "EACCES"),
    ] {
        assert_eq!(after[call], answer, "{call}");
    }
}

/// Plays an agent with the server's evaluator; returns its results.
fn evaluated(scratch: &Path, name: &str, source: &str, config: &str) -> Value {
    let folder = python_bundle(scratch, name, source);
    let file = scratch.join(format!("{name}.toml"));
    let patient = include_str!("../patient.toml");
    fs::write(&file, format!("{patient}\n{config}")).expect("a scratch file can be written");
    let out = scratch.join(format!("{name}-out"));
    let played = Command::new(program("faceoff"))
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
        .arg(&file)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the program can be started");
    assert!(played.status.success(), "{name}: {played:?}");
    let results = fs::read(out.join("results.json")).expect("there are results");
    serde_json::from_slice(&results).expect("results are JSON")
}

/// Ways to have many things happen at one instant, 0.15 s long, each once the ground of an excuse.
const STORMS: [(&str, &str); 4] = [
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
fn a_storm_of_the_agents_own_is_no_excuse() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    for (name, storm) in STORMS {
        let body = storm.replace('\n', "\n    ");
        let source = python_agent(&format!("if message['step'] == 3:\n    {body}\nsay(hold)"));
        let source = format!(
            "import ctypes, signal, threading\nsignal.signal(signal.SIGCONT, lambda *_: None)\n{source}"
        );
        let result = evaluated(scratch.path(), name, &source, "");
        assert_eq!(
            result["timing"]["host_noise_reruns"], 0,
            "{name}: {result:#}"
        );
        // All of it is its own time, but for what others provably ran on its CPU.
        let took = &result["tasks"]["hit"]["computation_time_s"]["max"];
        let host = &result["timing"]["longest_stall_s"];
        let (took, host) = (took.as_f64(), host.as_f64());
        assert!(
            took.zip(host)
                .is_some_and(|(took, host)| took + host >= 0.15),
            "{name}: {result:#}"
        );
    }
}

#[test]
fn a_slow_answer_that_costs_points_tells_whose_time_it_was() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = CONFIG.replace("episodes_per_task = 4", "episodes_per_task = 8");
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Hesitant");
    // Two ways to be slow, one that computes and one that sleeps.
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
    let finished = team.finished(&server, &path);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let violations = server
        .get(&format!("{path}/violations"), Some(&team.token))
        .json::<Value>()
        .expect("the API speaks JSON");
    let (mut computed, mut slept) = (0, 0);
    for (task, of_task) in violations["tasks"].as_object().expect("there are tasks") {
        let slow = of_task["computation_time"].as_array().expect("a list");
        assert_eq!(slow.len(), 8, "{task}: {of_task:#}");
        for episode in slow {
            let slowest = &episode["slowest"];
            let of = |field: &str| slowest[field].as_f64().expect("a time");
            let counted = episode["max_s"].as_f64().expect("a time");
            assert!(of("wall_s") >= 0.25, "{episode:#}");
            assert!((of("wall_s") - of("host_s") - counted).abs() < 1e-6);
            match of("cpu_s") {
                _ if slowest["step"] != 3 => {}
                cpu_s if cpu_s >= 0.25 => computed += 1,
                _ => slept += 1,
            }
        }
    }
    assert!(computed > 0 && slept > 0, "{computed} and {slept}");

    // Beyond the worst twenty the page tells where all are.
    let page = server.get(&path.replace("/api/v1", ""), None);
    let page = page.text().expect("a page is text");
    assert!(page.contains("The worst 20 of 24 episodes"), "{page}");
    assert!(page.contains(&format!("{path}/violations")));
    let other = Team::create(&server, "Other");
    let foreign = server.get(&format!("{path}/violations"), Some(&other.token));
    assert_eq!(foreign.status(), 404);
}

/// Holds its channel, as far as it can, from right before an answer is seen until it has thought about the next one.
const THINKS_FOR_FREE: &str = r#"
import json, os, socket, sys, threading, time

def hold(fd, source):
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
            ours, theirs = socket.socketpair()
            holder = threading.Thread(target=hold, args=(1, theirs.fileno()))
            holder.start()
            time.sleep(0.3)
            ours.close()
            holder.join()
    elif message["type"] == "bye":
        sys.exit(0)
"#;

#[test]
fn thinking_behind_a_held_channel_costs_points() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    for (name, given_up) in [
        ("thinks", ""),
        ("unfiltered", "[sandbox]\ngiven_up = [\"seccomp\"]"),
    ] {
        let result = evaluated(scratch.path(), name, THINKS_FOR_FREE, given_up);
        let hit = &result["tasks"]["hit"];
        let (took, host) = (
            hit["computation_time_s"]["max"].as_f64(),
            result["timing"]["longest_stall_s"].as_f64(),
        );
        assert!(
            took.zip(host)
                .is_some_and(|(took, host)| took + host >= 0.3),
            "{result:#}"
        );
        assert_eq!(result["timing"]["host_noise_reruns"], 0);
    }
}

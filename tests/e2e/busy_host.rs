//! Other load on the host (the evaluator's machine): it causes no penalty point and no fault, and changes no score. Reference
//! agents of the folder `agents` are evaluated with the time limits of the rules, beside each kind of load.

use crate::{Team, start_day, without_times};
use faceoff_tests::{
    bundle::{self, copy_folder},
    server::Server,
};
use serde_json::Value;
use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
};

/// Keeps the time limits of the rules, unlike the other tests.
const CONFIG: &str =
    "[workers]\nslots = 1\n[evaluation]\nepisodes_per_task = 4\nepisodes_per_shard = 2\n";
/// Reference agents that are evaluated.
const AGENTS: [&str; 2] = ["hold", "striker"];

/// A function that starts a load beside a server.
type StartLoad = fn(&mut Load, &Server);

/// Processes and threads that load the host; dropping it ends them.
#[derive(Default)]
struct Load {
    processes: Vec<Child>,
    threads: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
}

impl Drop for Load {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for child in &mut self.processes {
            // The process may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

impl Load {
    fn start_program(&mut self, name: &str, arguments: &[&str]) {
        let child = Command::new(name)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        self.processes
            .push(child.expect("a program can be started"));
    }

    /// Runs `body` repeatedly on a thread.
    fn repeat(&mut self, mut body: impl FnMut() + Send + 'static) {
        let stop = Arc::clone(&self.stop);
        self.threads.push(thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                body();
            }
        }));
    }

    /// Starts a process per CPU that never sleeps.
    fn start_cpu_hogs(&mut self) {
        let cpus = thread::available_parallelism().map_or(1, std::num::NonZero::get);
        for _ in 0..cpus {
            self.start_program("sh", &["-c", "while :; do :; done"]);
        }
    }

    /// Starts a process that writes a quarter of the memory repeatedly, from end to end.
    fn start_memory_writer(&mut self) {
        let meminfo = fs::read_to_string("/proc/meminfo").expect("Linux reports its memory");
        let bytes_of = |key: &str| {
            let line = meminfo.lines().find_map(|line| line.strip_prefix(key));
            let kib: u64 = line
                .expect(key)
                .trim_end_matches("kB")
                .trim()
                .parse()
                .expect(key);
            kib << 10
        };
        let bytes = (bytes_of("MemTotal:") / 4).min(bytes_of("MemAvailable:") / 2);
        // One byte per page of 4096 bytes makes the whole page dirty.
        let source = "import sys\nmemory = bytearray(int(sys.argv[1]))\nn = 0\n\
                      while True:\n    n += 1\n    memory[::4096] = bytes([n % 256]) * len(memory[::4096])";
        self.start_program("python3", &["-c", source, &bytes.to_string()]);
    }

    /// Starts 48 visitors without a token that fetch pages without a pause, each page on a new connection.
    fn start_page_flood(&mut self, server: &Server) {
        let address = server.url.trim_start_matches("http://").to_owned();
        for visitor in 0..48 {
            let address = address.clone();
            self.repeat(move || {
                let page = ["/", "/season", "/api/v1/board"][visitor % 3];
                // A refused visitor tries again.
                let Ok(mut stream) = TcpStream::connect(&address) else {
                    return;
                };
                let request =
                    format!("GET {page} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
                if stream.write_all(request.as_bytes()).is_ok() {
                    let _ = stream.read_to_end(&mut Vec::new());
                }
            });
        }
    }

    /// Starts 12 threads that each run one short process after another, as a compilation does; each process starts another.
    fn start_process_bursts(&mut self) {
        for _ in 0..12 {
            self.repeat(|| {
                let source = "import subprocess\nsum(i * i for i in range(300_000))\n\
                              subprocess.run(['sh', '-c', ':'])\nbytearray(1 << 24)";
                let _ = Command::new("python3").args(["-c", source]).status();
            });
        }
    }
}

/// Runs an evaluation day of the season in `data`, from uploads to results, beside a load. Returns the results by agent.
fn evaluate_day(
    data: &Path,
    scratch: &Path,
    start_load: impl FnOnce(&mut Load, &Server),
) -> Vec<Value> {
    let server = Server::start(data, CONFIG);
    let mut load = Load::default();
    start_load(&mut load, &server);
    let teams: Vec<(Team, Value)> = AGENTS
        .iter()
        .map(|name| {
            let team = Team::create(&server, name);
            let verdict = team.submit(&server, &bundle::example_agent(name, scratch));
            assert_eq!(verdict["state"], "valid", "{name}: {verdict:#}");
            (team, verdict)
        })
        .collect();
    let day = start_day(&server);
    let results = teams
        .iter()
        .map(|(team, submission)| {
            let path = crate::evaluation_path(&day, submission);
            // Before the release of the day a team sees only its score.
            let finished = server.poll(&path, &team.token, |answer| {
                !answer["released_at"].is_null()
            });
            assert_eq!(finished["state"], "finished", "{finished:#}");
            for (task, result) in finished["result"]["tasks"]
                .as_object()
                .expect("a result has tasks")
            {
                assert_eq!(
                    result["violations"]["computation_time"],
                    0,
                    "{task}: {finished:#}\n{}",
                    server.log()
                );
            }
            finished["result"].clone()
        })
        .collect();
    drop(load);
    results
}

/// Evaluates the same day of the same season without load and beside each load: scores and penalty points are equal.
fn assert_no_effect(loads: &[(&str, StartLoad)]) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // Copies of one data folder have the same secret, which determines the episodes. So all days have the same ones.
    let season = scratch.path().join("season");
    Server::start(&season, CONFIG).kill();
    let undisturbed = scratch.path().join("undisturbed");
    copy_folder(&season, &undisturbed);
    let expected = evaluate_day(&undisturbed, scratch.path(), |_, _| {});
    for (name, load) in loads {
        let data = scratch.path().join(name);
        copy_folder(&season, &data);
        let results = evaluate_day(&data, scratch.path(), load);
        for (expected, result) in expected.iter().zip(&results) {
            assert_eq!(
                without_times(result),
                without_times(expected),
                "beside {name}"
            );
            assert_eq!(
                result["penalty_points"], expected["penalty_points"],
                "beside {name}"
            );
        }
    }
}

#[test]
fn cpu_hogs_and_flood_change_no_result() {
    assert_no_effect(&[("hogs, memory and flood", |load, server| {
        load.start_cpu_hogs();
        load.start_memory_writer();
        load.start_page_flood(server);
    })]);
}

#[test]
#[ignore = "it uses all of the machine for minutes; `make busy` runs it alone"]
fn separate_and_combined_loads_change_no_result() {
    assert_no_effect(&[
        ("hogs", |load, _| load.start_cpu_hogs()),
        ("memory", |load, _| load.start_memory_writer()),
        ("flood", Load::start_page_flood),
        ("burst", |load, _| load.start_process_bursts()),
        ("all", |load, server| {
            load.start_cpu_hogs();
            load.start_memory_writer();
            load.start_page_flood(server);
            load.start_process_bursts();
        }),
    ]);
}

/// A thread's name and its CPUs.
type ThreadCpus = (String, String);

/// The server's threads with their CPUs: first those of ordinary priority, then those of lower priority.
fn threads_of(server: &Server) -> (Vec<ThreadCpus>, Vec<ThreadCpus>) {
    let tasks =
        fs::read_dir(format!("/proc/{}/task", server.process_id())).expect("the server runs");
    let (mut ordinary, mut low_priority) = (Vec::new(), Vec::new());
    for task in tasks.flatten() {
        // A thread that has just ended has no files.
        let read = |file: &str| fs::read_to_string(task.path().join(file)).ok();
        let (Some(name), Some(stat), Some(status)) = (read("comm"), read("stat"), read("status"))
        else {
            continue;
        };
        // Field 19 of `stat` is the nice value. The name in brackets is field 2 and may contain spaces.
        let after_name = stat.rsplit_once(") ").expect("a name in brackets").1;
        let nice: i32 = after_name
            .split(' ')
            .nth(16)
            .expect("nice")
            .parse()
            .expect("a number");
        let cpus = status
            .lines()
            .find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
        let thread = (
            name.trim().to_owned(),
            cpus.expect("its CPUs").trim().to_owned(),
        );
        if nice > 0 {
            low_priority.push(thread)
        } else {
            ordinary.push(thread)
        }
    }
    (ordinary, low_priority)
}

#[test]
fn http_threads_yield_and_avoid_agent_cpus() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let mut load = Load::default();
    load.start_page_flood(&server);
    let team = Team::create(&server, "Held");
    let id = team.upload(
        &server,
        bundle::pack(&bundle::example_agent("hold", scratch.path())),
    );
    let verdict = team.verdict(&server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    let (ordinary, low_priority) = threads_of(&server);
    let cpus_of = |threads: &[ThreadCpus], prefix: &str| -> Vec<String> {
        let matching = threads.iter().filter(|thread| thread.0.starts_with(prefix));
        matching.map(|thread| thread.1.clone()).collect()
    };
    let slot_cpus = cpus_of(&ordinary, "faceoff-slot");
    assert_eq!(slot_cpus.len(), 1, "{ordinary:?}");
    for name in ["http", "sqlx-sqlite", "service"] {
        assert!(
            !cpus_of(&low_priority, name).is_empty(),
            "{name}: {low_priority:?}"
        );
    }
    // A service thread that was just started for a slot has the slot's priority until it has lowered its own.
    let has_service_thread = |threads: &[ThreadCpus]| {
        let names = ["http", "service"];
        names.iter().any(|name| !cpus_of(threads, name).is_empty())
    };
    let mut threads = ordinary;
    for _ in 0..1000 {
        if !has_service_thread(&threads) {
            break;
        }
        thread::yield_now();
        threads = threads_of(&server).0;
    }
    assert!(!has_service_thread(&threads), "{threads:?}");
    // With more than two CPUs, the HTTP threads avoid those of the agent and the simulator. With two, the agent has one, and the
    // simulator shares the other with the HTTP threads.
    let cpus = thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let http_cpus = cpus_of(&low_priority, "http");
    assert!(
        http_cpus.iter().all(|list| *list == http_cpus[0]),
        "{low_priority:?}"
    );
    match cpus {
        1 => {}
        2 => assert_eq!(
            http_cpus[0], slot_cpus[0],
            "HTTP threads share the simulator's CPU at a lower priority"
        ),
        _ => assert_ne!(http_cpus[0], slot_cpus[0]),
    }
}

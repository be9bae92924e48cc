//! Other load on the host, ours or strangers': it becomes neither a penalty point nor a fault nor another
//! score. Reference agents play under the rules' own limits, beside each kind of load.

use crate::{Team, kills::copy_folder, start_day, without_times};
use faceoff_tests::{bundle, server::Server};
use serde_json::Value;
use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
};

/// The rules' own limits.
const CONFIG: &str =
    "[workers]\nslots = 1\n[evaluation]\nepisodes_per_task = 6\nepisodes_per_shard = 3\n";
const AGENTS: [&str; 2] = ["hold", "striker"];

/// Begins to run beside a server.
type Beside = fn(&mut Load, &Server);

/// What runs beside; all of it ends with this.
#[derive(Default)]
struct Load {
    processes: Vec<Child>,
    threads: Vec<JoinHandle<()>>,
    over: Arc<AtomicBool>,
    /// Pages fetched, processes of a burst that ended.
    done: Arc<AtomicU64>,
}

impl Drop for Load {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for child in &mut self.processes {
            // Already ended is fine.
            let _ = child.kill();
            let _ = child.wait();
        }
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

impl Load {
    fn program(&mut self, name: &str, arguments: &[&str]) {
        let child = Command::new(name)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        self.processes
            .push(child.expect("a program can be started"));
    }

    /// Runs `body` again and again on a thread.
    fn again(&mut self, mut body: impl FnMut() + Send + 'static) {
        let (over, done) = (Arc::clone(&self.over), Arc::clone(&self.done));
        self.threads.push(thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                body();
                done.fetch_add(1, Ordering::Relaxed);
            }
        }));
    }

    /// A process per CPU that never sleeps.
    fn hogs(&mut self) {
        let cpus = thread::available_parallelism().map_or(1, std::num::NonZero::get);
        for _ in 0..cpus {
            self.program("sh", &["-c", "while :; do :; done"]);
        }
    }

    /// A quarter of the memory, written again and again, from end to end.
    fn memory(&mut self) {
        let told = fs::read_to_string("/proc/meminfo").expect("Linux tells of its memory");
        let of = |key: &str| {
            let line = told.lines().find_map(|line| line.strip_prefix(key));
            let kib: u64 = line
                .expect(key)
                .trim_end_matches("kB")
                .trim()
                .parse()
                .expect(key);
            kib << 10
        };
        let bytes = (of("MemTotal:") / 4).min(of("MemAvailable:") / 2);
        let source = "import sys\nheld = bytearray(int(sys.argv[1]))\nn = 0\n\
                      while True:\n    n += 1\n    held[::4096] = bytes([n % 256]) * len(held[::4096])";
        self.program("python3", &["-c", source, &bytes.to_string()]);
    }

    /// Visitors without a token, each on a connection of its own, fetching pages as fast as they come.
    fn flood(&mut self, server: &Server) {
        let address = server.url.trim_start_matches("http://").to_owned();
        for visitor in 0..48 {
            let address = address.clone();
            self.again(move || {
                let page = ["/", "/season", "/api/v1/board"][visitor % 3];
                // A visitor that is turned away comes again.
                let Ok(mut stream) = TcpStream::connect(&address) else {
                    return;
                };
                let asked =
                    format!("GET {page} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
                if stream.write_all(asked.as_bytes()).is_ok() {
                    let _ = stream.read_to_end(&mut Vec::new());
                }
            });
        }
    }

    /// Many processes at a time, each as long as one of a compiler, of which some start others.
    fn burst(&mut self) {
        for _ in 0..12 {
            self.again(|| {
                let source = "import subprocess\nsum(i * i for i in range(300_000))\n\
                              subprocess.run(['sh', '-c', ':'])\nbytearray(1 << 24)";
                let _ = Command::new("python3").args(["-c", source]).status();
            });
        }
    }
}

/// Plays a day of the season in `data` from uploads to results, beside the load.
fn day_beside(data: &Path, scratch: &Path, load: impl FnOnce(&mut Load, &Server)) -> Vec<Value> {
    let server = Server::start(data, CONFIG);
    let mut beside = Load::default();
    load(&mut beside, &server);
    let teams: Vec<(Team, Value)> = AGENTS
        .iter()
        .map(|name| {
            let team = Team::create(&server, name);
            let verdict = team.submit(&server, &bundle::reference(name, scratch));
            assert_eq!(verdict["state"], "valid", "{name}: {verdict:#}");
            (team, verdict)
        })
        .collect();
    let day = start_day(&server);
    let results = teams
        .iter()
        .map(|(team, submission)| {
            let path = crate::path_of(&day, submission);
            // Until the whole day is over a team is told its score alone.
            let finished = server.poll(&path, &team.token, |answer| {
                !answer["released_at"].is_null()
            });
            assert_eq!(finished["state"], "finished", "{finished:#}");
            for (task, played) in finished["result"]["tasks"].as_object().expect("tasks") {
                assert_eq!(
                    played["violations"]["computation_time"],
                    0,
                    "{task}: {finished:#}\n{}",
                    server.log()
                );
            }
            finished["result"].clone()
        })
        .collect();
    drop(beside);
    results
}

/// The same day of the same season, undisturbed and beside each of the loads: the same scores, and no point.
fn costs_nothing(loads: &[(&str, Beside)]) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // One season, so that all days draw the same episodes: the secret is in the folder.
    let season = scratch.path().join("season");
    Server::start(&season, CONFIG).kill();
    let undisturbed = scratch.path().join("undisturbed");
    copy_folder(&season, &undisturbed);
    let expected = day_beside(&undisturbed, scratch.path(), |_, _| {});
    for (name, load) in loads {
        let data = scratch.path().join(name);
        copy_folder(&season, &data);
        let found = day_beside(&data, scratch.path(), load);
        for (expected, found) in expected.iter().zip(&found) {
            assert_eq!(
                without_times(found),
                without_times(expected),
                "beside {name}"
            );
            assert_eq!(
                found["penalty_points"], expected["penalty_points"],
                "beside {name}"
            );
        }
    }
}

#[test]
fn hogs_and_a_flood_cost_no_point_no_fault_and_no_success() {
    costs_nothing(&[("hogs, memory and flood", |load, server| {
        load.hogs();
        load.memory();
        load.flood(server);
    })]);
}

#[test]
#[ignore = "for minutes it leaves the other tests nothing of the machine; `make busy` runs it alone"]
fn a_busy_host_costs_no_point_no_fault_and_no_success() {
    costs_nothing(&[
        ("hogs", |load, _| load.hogs()),
        ("memory", |load, _| load.memory()),
        ("flood", Load::flood),
        ("burst", |load, _| load.burst()),
        ("all", |load, server| {
            load.hogs();
            load.memory();
            load.flood(server);
            load.burst();
        }),
    ]);
}

/// A thread's name and its CPUs.
type Named = (String, String);

/// The server's threads with their CPUs: those of ordinary priority, and those that give way.
fn threads_of(server: &Server) -> (Vec<Named>, Vec<Named>) {
    let tasks = fs::read_dir(format!("/proc/{}/task", server.process_id())).expect("it runs");
    let (mut ordinary, mut giving_way) = (Vec::new(), Vec::new());
    for task in tasks.flatten() {
        // A thread that has just ended has no files.
        let of = |file: &str| fs::read_to_string(task.path().join(file)).ok();
        let (Some(name), Some(stat), Some(status)) = (of("comm"), of("stat"), of("status")) else {
            continue;
        };
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
            giving_way.push(thread)
        } else {
            ordinary.push(thread)
        }
    }
    (ordinary, giving_way)
}

#[test]
fn what_answers_strangers_gives_way_and_keeps_off_the_agents_cpus() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let mut beside = Load::default();
    beside.flood(&server);
    let team = Team::create(&server, "Held");
    let id = team.upload(
        &server,
        bundle::packed(&bundle::reference("hold", scratch.path())),
    );
    let verdict = team.verdict(&server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    let (ordinary, giving_way) = threads_of(&server);
    let of = |threads: &[Named], begins: &str| -> Vec<String> {
        let named = threads.iter().filter(|one| one.0.starts_with(begins));
        named.map(|one| one.1.clone()).collect()
    };
    let slot = of(&ordinary, "faceoff-slot");
    assert_eq!(slot.len(), 1, "{ordinary:?}");
    for name in ["http", "sqlx-sqlite", "service"] {
        assert!(!of(&giving_way, name).is_empty(), "{name}: {giving_way:?}");
    }
    // One that is being started for a slot's request gives way as its first deed.
    let started = |threads: &[Named]| {
        let names = ["http", "service"];
        names.iter().any(|name| !of(threads, name).is_empty())
    };
    let mut seen = ordinary;
    for _ in 0..1000 {
        if !started(&seen) {
            break;
        }
        thread::yield_now();
        seen = threads_of(&server).0;
    }
    assert!(!started(&seen), "{seen:?}");
    // Two CPUs at least: the agent's is none of these.
    let cpus = thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let theirs = of(&giving_way, "http");
    assert!(
        theirs.iter().all(|list| *list == theirs[0]),
        "{giving_way:?}"
    );
    match cpus {
        1 => {}
        2 => assert_eq!(
            theirs[0], slot[0],
            "they share the simulator's, and give way there"
        ),
        _ => assert_ne!(theirs[0], slot[0]),
    }
}

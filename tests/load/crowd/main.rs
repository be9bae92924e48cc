//! What one server carries when many machines work for it: `make crowd`.
//!
//! Starts a real nats-server and a real `faceoff serve` that plays nothing itself, queues evaluations of the default size, and has
//! them "played" by workers in this process that speak with the server as `faceoff worker` does and sleep in place of
//! playing ([`stub`]). So what is measured is what the server, NATS and SQLite need for a shard, and how long a free slot waits. First
//! a few workers, to see how the time of one grows into that of many; then all of them.
//!
//! Recordings are bytes without meaning, which nobody could score. So the last shard of each evaluation says that the agent
//! broke its limits: that ends the evaluation without a score. What scoring takes is the server's own slots' and is told by its
//! `faceoff_unit_duration_seconds{work="finalise"}`. For the same reason no episode is simulated again to check it.
//!
//! All run on the same CPUs; whoever reads the numbers sees what this process took of them. Nothing is asserted but that each
//! evaluation came to its end: how fast a machine is, is the machine's.

#![expect(clippy::print_stdout, reason = "it reports what it measured")]

mod evaluations;
mod figures;
mod stub;
mod usage;

use anyhow::{Context as _, ensure};
use evaluations::Evaluations;
use faceoff_tests::{bundle, nats::Nats, program, repository, server::Server};
use faceoff_wire::remote::Introduction;
use figures::Phase;
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    env, fs,
    pin::pin,
    process,
    str::FromStr,
    sync::{Arc, atomic::AtomicI64},
    thread,
    time::{Duration, Instant},
};
use stub::{Plan, Share, Stub, Tally};
use tokio::{runtime::Runtime, task::JoinSet};
use usage::{Threads, Usage};

/// The defaults of a stage: a season's shards, and what a shard's outcomes weigh.
const EPISODES_PER_TASK: u32 = 1000;
const EPISODES_PER_SHARD: u32 = 50;
const TASKS: u32 = 3;
/// Shards of an evaluation.
const SHARDS: u32 = TASKS * EPISODES_PER_TASK.div_ceil(EPISODES_PER_SHARD);
/// Teams; there are as many stages as it takes, since a stage has one cut a day.
const TEAMS: u32 = 8;
/// The few workers, how many shards each plays, and for how long.
const FEW: [usize; 5] = [1, 2, 4, 8, 16];
const ROUNDS: u32 = 10;
const FEWS_SLEEP: Duration = Duration::from_secs(2);
/// Shards differ: with all of them alike, all workers would ask at once, for ever.
const SPREAD: f64 = 0.5;
/// How often is looked at what threads use.
const LOOK: Duration = Duration::from_secs(1);
/// What the database's threads are called, as far as the kernel keeps a name.
const DATABASE: &str = "sqlx-sqlite";

struct Settings {
    shards: u32,
    workers: usize,
    sleep: Duration,
    recording_bytes: usize,
}

impl Settings {
    fn from_environment() -> anyhow::Result<Self> {
        let settings = Self {
            shards: setting("SHARDS", 10_000)?,
            workers: setting("WORKERS", 200)?,
            sleep: Duration::try_from_secs_f64(setting("SLEEP_S", 10.0)?)
                .context("SLEEP_S: expected seconds")?,
            recording_bytes: setting("RECORDING_BYTES", 65_536)?,
        };
        ensure!(settings.workers > 0, "WORKERS: expected at least one");
        ensure!(settings.shards > 0, "SHARDS: expected at least one");
        Ok(settings)
    }
}

fn setting<T: FromStr<Err: std::error::Error + Send + Sync + 'static>>(
    name: &str,
    default: T,
) -> anyhow::Result<T> {
    match env::var(name) {
        Ok(text) if !text.is_empty() => text.parse().with_context(|| format!("{name}: {text:?}")),
        _ => Ok(default),
    }
}

fn main() -> anyhow::Result<()> {
    let settings = Settings::from_environment()?;
    let scratch = tempfile::tempdir()?;
    let nats = Nats::start(&scratch.path().join("nats"));
    let server = Server::start(&scratch.path().join("data"), &configuration(&nats));
    let of_few = FEW.iter().sum::<usize>() * ROUNDS as usize;
    let of_few = u32::try_from(of_few)?;
    let stages = (settings.shards + of_few).div_ceil(SHARDS * TEAMS);
    let queued = Queued::make(&server, stages)?;
    let of_many = stages * TEAMS * SHARDS - of_few;
    println!(
        "{} evaluations of {SHARDS} shards of {EPISODES_PER_SHARD} episodes are queued",
        queued.evaluations.len()
    );

    let runtime = Runtime::new()?;
    let evaluations = Arc::new(Evaluations::of_shards(SHARDS));
    let (own, url) = (introduction(&server)?, nats.url());
    let mut stubs = Vec::new();
    for number in 0..settings.workers.max(FEW[FEW.len() - 1]) {
        let connecting = Stub::connect(
            number,
            &url,
            own.clone(),
            settings.recording_bytes,
            Arc::clone(&evaluations),
        );
        stubs.push(runtime.block_on(connecting)?);
    }
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    ensure!(resumed.status().is_success(), "{}", resumed.status());

    let few = few(&runtime, &mut stubs)?;
    let plan = Plan {
        sleep: settings.sleep,
        spread: SPREAD,
        share: Share::Common(AtomicI64::new(of_many.into())),
    };
    let processes = [server.process_id(), nats.process_id(), process::id()];
    let many = Many::measure(
        &runtime,
        (&mut stubs, settings.workers),
        plan,
        processes,
        || queued.are_over(&server),
    )?;
    report(&settings, &few, &many)
}

/// No slot of its own plays; all "machines" have the one address here, which is not what a rate is for.
fn configuration(nats: &Nats) -> String {
    format!(
        r#"
[evaluation]
episodes_per_task = {EPISODES_PER_TASK}
episodes_per_shard = {EPISODES_PER_SHARD}
day_deadline = "never"
[workers]
slots = 1
play = false
checked_episodes = 0
[nats]
url = "{}"
[rates]
address_per_s = 0
token_per_s = 0
[sandbox]
resident_bytes = 0
"#,
        nats.url()
    )
}

/// Evaluations that wait, and the paths at which they are seen.
struct Queued {
    evaluations: Vec<String>,
}

impl Queued {
    fn make(server: &Server, stages: u32) -> anyhow::Result<Self> {
        let admin = &server.admin_token;
        let archive = bundle::packed(&repository().join("agents/hold"));
        for number in 1..=TEAMS {
            let team = json!({ "name": format!("Team {number}") });
            let team = answer(server.post("/api/v1/teams", admin, &team))?;
            let token = text(&team["token"])?;
            let submission = answer(server.upload(&token, archive.clone()))?;
            let path = format!("/api/v1/submissions/{}", text(&submission["id"])?);
            let tried = server.poll(&path, &token, |told| told["state"] != "validating");
            ensure!(tried["state"] == "valid", "{tried:#}");
        }
        let pause = json!({ "reason": "Until all workers are there" });
        let paused = server.post("/api/v1/queue/pause", admin, &pause);
        ensure!(paused.status().is_success(), "{}", paused.status());
        let mut evaluations = Vec::new();
        for number in 1..=stages {
            let stage = if number == 1 {
                answer(server.get("/api/v1/stages", Some(admin)))?[0].take()
            } else {
                let stage = json!({ "name": format!("Stage {number}") });
                answer(server.post("/api/v1/stages", admin, &stage))?
            };
            let stage = json!({ "stage": stage["id"] });
            let day = answer(server.post("/api/v1/days", admin, &stage))?;
            for evaluation in day["created"].as_array().context("a day's evaluations")? {
                let id = text(&evaluation["id"])?;
                evaluations.push(format!("/api/v1/evaluations/{id}"));
            }
        }
        ensure!(evaluations.len() == (stages * TEAMS) as usize);
        Ok(Self { evaluations })
    }

    /// Waits until the server has stored all that was handed in: an evaluation ends with its last shard.
    fn are_over(&self, server: &Server) -> anyhow::Result<()> {
        for path in &self.evaluations {
            let over = server.poll(path, &server.admin_token, |told| {
                !["queued", "running"].contains(&told["state"].as_str().unwrap_or_default())
            });
            ensure!(over["state"] == "agent_failed", "{over:#}");
        }
        Ok(())
    }
}

fn answer(response: reqwest::blocking::Response) -> anyhow::Result<Value> {
    Ok(response.error_for_status()?.json()?)
}

fn text(value: &Value) -> anyhow::Result<String> {
    let text = value.as_str().context("the API told no text")?;
    Ok(text.to_owned())
}

/// As a worker with the server's program and runtimes tells of itself.
fn introduction(server: &Server) -> anyhow::Result<Introduction> {
    let found = answer(server.get("/api/v1/runtimes", None))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(program("faceoff"))?)?;
    // As text, so that what a worker need not say can be left out.
    Ok(serde_json::from_value(json!({
        "program": hasher.finalize().to_string(),
        "version": env!("CARGO_PKG_VERSION"),
        "runtimes": found["runtimes"],
        "slots": 1,
    }))?)
}

fn few(runtime: &Runtime, stubs: &mut Vec<Stub>) -> anyhow::Result<Vec<Phase>> {
    let play = |workers| {
        let plan = Plan {
            sleep: FEWS_SLEEP,
            spread: 0.0,
            share: Share::Each(ROUNDS),
        };
        runtime.block_on(phase(stubs, workers, plan))
    };
    FEW.into_iter().map(play).collect()
}

async fn phase(stubs: &mut Vec<Stub>, workers: usize, plan: Plan) -> anyhow::Result<Phase> {
    let plan = Arc::new(plan);
    let began = Instant::now();
    let mut working = JoinSet::new();
    for stub in stubs.drain(..workers) {
        working.spawn(stub.work(Arc::clone(&plan)));
    }
    let mut tally = Tally::default();
    while let Some(worked) = working.join_next().await {
        let (stub, own) = worked??;
        stubs.push(stub);
        tally.add(own);
    }
    Ok(Phase {
        workers,
        took: began.elapsed(),
        tally,
    })
}

/// All workers, and what was used meanwhile.
struct Many {
    phase: Phase,
    /// From the first request for work until the server had stored all of it.
    stored: Duration,
    /// Of server, NATS and this process: before and after.
    used: [(Usage, Usage); 3],
    /// CPU seconds of the server's threads.
    threads: BTreeMap<String, f64>,
}

impl Many {
    fn measure(
        runtime: &Runtime,
        (stubs, workers): (&mut Vec<Stub>, usize),
        plan: Plan,
        processes: [u32; 3],
        stored: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<Self> {
        let [server, _, _] = processes;
        let mut threads = Threads::default();
        threads.look(server)?;
        let before = (threads.clone(), usages(processes)?);
        let began = Instant::now();
        let phase = runtime.block_on(async {
            let mut playing = pin!(phase(stubs, workers, plan));
            let mut looks = tokio::time::interval(LOOK);
            loop {
                tokio::select! {
                    played = &mut playing => break played,
                    _ = looks.tick() => threads.look(server)?,
                }
            }
        })?;
        stored()?;
        let stored = began.elapsed();
        threads.look(server)?;
        let after = usages(processes)?;
        let [of_server, of_nats, of_stubs] = before.1;
        let [server_after, nats_after, stubs_after] = after;
        Ok(Self {
            phase,
            stored,
            used: [
                (of_server, server_after),
                (of_nats, nats_after),
                (of_stubs, stubs_after),
            ],
            threads: threads.since(&before.0),
        })
    }

    /// CPU seconds of the process at this place.
    fn cpu_s(&self, index: usize) -> f64 {
        let (before, after) = &self.used[index];
        after.cpu_s - before.cpu_s
    }

    /// CPU seconds of the database's threads: statements and reading and writing pages. Waiting for the disk is none.
    fn database_s(&self) -> f64 {
        let database = self.threads.iter();
        let database = database.filter(|(name, _)| name.starts_with(DATABASE));
        database.map(|(_, cpu_s)| cpu_s).sum()
    }
}

fn usages(processes: [u32; 3]) -> anyhow::Result<[Usage; 3]> {
    let [server, nats, own] = processes;
    Ok([Usage::of(server)?, Usage::of(nats)?, Usage::of(own)?])
}

const PROCESSES: [&str; 3] = ["server", "nats-server", "workers (this process)"];

fn report(settings: &Settings, few: &[Phase], many: &Many) -> anyhow::Result<()> {
    let shards = many.phase.shards() as f64;
    let cpus = thread::available_parallelism()?;
    println!(
        "\nFew workers, {} s a shard, on {cpus} CPUs",
        FEWS_SLEEP.as_secs()
    );
    println!("medians in ms: of a free slot's wait, of what follows\n");
    println!("| workers | shards | s | shards/s | efficiency | order | begin | files | hand in |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for phase in few.iter().chain([&many.phase]) {
        println!("{}", phase.line());
    }
    println!(
        "\nThe last line: {:.3} s a shard, {} bytes of recording, all stored after {:.1} s\n",
        settings.sleep.as_secs_f64(),
        settings.recording_bytes,
        many.stored.as_secs_f64()
    );
    println!("{}", many.phase.latencies());
    println!(
        "| process | CPU ms per shard | CPUs busy | MiB in use | MiB at most | KiB written per shard |"
    );
    println!("|---|---|---|---|---|---|");
    let mut processes = json!({});
    for (index, name) in PROCESSES.into_iter().enumerate() {
        let (before, after) = &many.used[index];
        let (per_shard, busy) = (
            many.cpu_s(index) / shards,
            many.cpu_s(index) / many.stored.as_secs_f64(),
        );
        let written = (after.written_bytes - before.written_bytes) as f64 / shards;
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        println!(
            "| {name} | {:.2} | {busy:.3} | {:.0} | {:.0} | {:.0} |",
            per_shard * 1000.0,
            mib(after.resident_bytes),
            mib(after.peak_bytes),
            written / 1024.0
        );
        processes[name] = json!({
            "cpu_s_per_shard": per_shard,
            "cpus_busy": busy,
            "resident_bytes": after.resident_bytes,
            "peak_resident_bytes": after.peak_bytes,
            "written_bytes_per_shard": written,
        });
    }
    println!("\n| the server's threads | CPU ms per shard |\n|---|---|");
    for (name, cpu_s) in &many.threads {
        println!("| {name} | {:.2} |", cpu_s / shards * 1000.0);
    }
    let share = many.database_s() / many.cpu_s(0);
    println!("\nthe database's threads: {share:.3} of the server's CPU time\n");
    let few: Vec<Value> = few.iter().map(Phase::json).collect();
    let all = json!({
        "cpus": cpus.get(),
        "sleep_s": settings.sleep.as_secs_f64(),
        "few_sleep_s": FEWS_SLEEP.as_secs_f64(),
        "recording_bytes": settings.recording_bytes,
        "episodes_per_shard": EPISODES_PER_SHARD,
        "few": few,
        "many": many.phase.json(),
        "stored_s": many.stored.as_secs_f64(),
        "processes": processes,
        "server_threads_cpu_s": many.threads,
        "database_share_of_cpu": share,
    });
    println!("{all}");
    Ok(())
}

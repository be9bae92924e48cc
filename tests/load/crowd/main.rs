//! Measures how many remote workers one server can serve: `make crowd`.
//!
//! Starts a real nats-server and a real `faceoff serve` without slots of its own, and queues evaluations of the default
//! size. An evaluation is split into shards, groups of episodes; each is a job for a slot of a worker. Workers in this
//! process ([`simulated_worker`]) use the protocol of `faceoff worker`, but sleep instead of running agents. So the
//! measurement shows what the server, NATS and SQLite need for a shard, and how long a free slot waits. The first phases
//! have a few workers, to see how the times grow with their number; the last phase has all of them.
//!
//! Recordings are meaningless bytes, which cannot be scored. So the last shard of each evaluation reports a fault of the
//! agent, which ends the evaluation without a score. The time for scoring is in the server's metric
//! `faceoff_unit_duration_seconds{work="finalise"}`. For the same reason no episode is simulated again to check it.
//!
//! All processes share the CPUs; the report has the CPU time of this process, too. The only assertion is that each
//! evaluation ends, since the times depend on the machine.

#![expect(clippy::print_stdout, reason = "the program prints its measurements")]

mod evaluations;
mod phase;
mod simulated_worker;
mod usage;

use anyhow::{Context as _, ensure};
use evaluations::Evaluations;
use faceoff_tests::{bundle, nats::Nats, program, repository, server::Server};
use faceoff_wire::remote::WorkerCapabilities;
use phase::Phase;
use serde_json::{Value, json};
use simulated_worker::{Measurements, Plan, SimulatedWorker, Workload};
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
use tokio::{runtime::Runtime, task::JoinSet};
use usage::{Threads, Usage};

/// The defaults of a stage, so that shards and their outcomes have the usual size.
const EPISODES_PER_TASK: u32 = 1000;
const EPISODES_PER_SHARD: u32 = 50;
const TASKS: u32 = 3;
/// Shards of one evaluation.
const SHARDS_PER_EVALUATION: u32 = TASKS * EPISODES_PER_TASK.div_ceil(EPISODES_PER_SHARD);
/// Teams. A stage has one cutoff a day, so further evaluations need further stages.
const TEAMS: u32 = 8;
/// Numbers of workers of the first phases.
const FEW_WORKERS: [usize; 5] = [1, 2, 4, 8, 16];
/// Shards of each worker in a phase with few workers.
const SHARDS_PER_WORKER: u32 = 10;
/// Duration of a shard in these phases, during which a worker sleeps.
const FEW_SLEEP: Duration = Duration::from_secs(2);
/// The largest relative deviation of a shard's duration. With equal durations all workers would always request jobs at the same
/// time.
const SPREAD: f64 = 0.5;
/// How often the CPU time of threads is read.
const SAMPLE_INTERVAL: Duration = Duration::from_secs(1);
/// The name of the database's threads, as the kernel truncates it.
const DATABASE_THREAD: &str = "sqlx-sqlite";

struct Settings {
    /// Shards of the phase with all workers, at least.
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
    let few_shards = FEW_WORKERS.iter().sum::<usize>() * SHARDS_PER_WORKER as usize;
    let few_shards = u32::try_from(few_shards)?;
    let stages = (settings.shards + few_shards).div_ceil(SHARDS_PER_EVALUATION * TEAMS);
    let queued_evaluations = QueuedEvaluations::create(&server, stages)?;
    let many_shards = stages * TEAMS * SHARDS_PER_EVALUATION - few_shards;
    println!(
        "{} evaluations of {SHARDS_PER_EVALUATION} shards of {EPISODES_PER_SHARD} episodes are queued",
        queued_evaluations.evaluations.len()
    );

    let runtime = Runtime::new()?;
    // Counts the shards of all evaluations, for all workers.
    let evaluations = Arc::new(Evaluations::new(SHARDS_PER_EVALUATION));
    let (capabilities, url) = (worker_capabilities(&server)?, nats.url());
    let mut simulated_workers = Vec::new();
    for number in 0..settings.workers.max(FEW_WORKERS[FEW_WORKERS.len() - 1]) {
        let connecting = SimulatedWorker::connect(
            number,
            &url,
            capabilities.clone(),
            settings.recording_bytes,
            Arc::clone(&evaluations),
        );
        simulated_workers.push(runtime.block_on(connecting)?);
    }
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    ensure!(resumed.status().is_success(), "{}", resumed.status());

    let few_worker_phases = run_few_worker_phases(&runtime, &mut simulated_workers)?;
    let plan = Plan {
        sleep: settings.sleep,
        spread: SPREAD,
        workload: Workload::Shared(AtomicI64::new(many_shards.into())),
    };
    let processes = [server.process_id(), nats.process_id(), process::id()];
    let full_phase = FullPhase::measure(
        &runtime,
        (&mut simulated_workers, settings.workers),
        plan,
        processes,
        || queued_evaluations.wait_for_end(&server),
    )?;
    report(&settings, &few_worker_phases, &full_phase)
}

/// The server runs no evaluations in its own slots. Rate limits are off, since all workers have the same address.
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
team_changes_per_day = 0
[sandbox]
resident_bytes = 0
"#,
        nats.url()
    )
}

/// Queued evaluations, as paths in the API.
struct QueuedEvaluations {
    evaluations: Vec<String>,
}

impl QueuedEvaluations {
    fn create(server: &Server, stages: u32) -> anyhow::Result<Self> {
        let admin = &server.admin_token;
        let archive = bundle::pack(&repository().join("agents/hold"));
        for number in 1..=TEAMS {
            let team = json!({ "name": format!("Team {number}") });
            let team = answer(server.post("/api/v1/teams", admin, &team))?;
            let token = string(&team["token"])?;
            let submission = answer(server.upload(&token, archive.clone()))?;
            let path = format!("/api/v1/submissions/{}", string(&submission["id"])?);
            let checked = server.poll(&path, &token, |view| view["state"] != "validating");
            ensure!(checked["state"] == "valid", "{checked:#}");
        }
        let pause = json!({ "reason": "Until all workers are connected" });
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
                let id = string(&evaluation["id"])?;
                evaluations.push(format!("/api/v1/evaluations/{id}"));
            }
        }
        ensure!(evaluations.len() == (stages * TEAMS) as usize);
        Ok(Self { evaluations })
    }

    /// Waits until the server has stored all results: an evaluation ends with its last shard.
    fn wait_for_end(&self, server: &Server) -> anyhow::Result<()> {
        for path in &self.evaluations {
            let ended = server.poll(path, &server.admin_token, |view| {
                !["queued", "running"].contains(&view["state"].as_str().unwrap_or_default())
            });
            ensure!(ended["state"] == "agent_failed", "{ended:#}");
        }
        Ok(())
    }
}

fn answer(response: reqwest::blocking::Response) -> anyhow::Result<Value> {
    Ok(response.error_for_status()?.json()?)
}

fn string(value: &Value) -> anyhow::Result<String> {
    let text = value.as_str().context("expected a string from the API")?;
    Ok(text.to_owned())
}

/// The capabilities that a worker with the server's program and runtimes reports.
fn worker_capabilities(server: &Server) -> anyhow::Result<WorkerCapabilities> {
    let found = answer(server.get("/api/v1/runtimes", None))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(program("faceoff"))?)?;
    // From JSON, so that optional fields can be left out.
    Ok(serde_json::from_value(json!({
        "program": hasher.finalize().to_string(),
        "version": env!("CARGO_PKG_VERSION"),
        "runtimes": found["runtimes"],
        "slots": 1,
    }))?)
}

/// The phases with few workers, one after the other.
fn run_few_worker_phases(
    runtime: &Runtime,
    simulated_workers: &mut Vec<SimulatedWorker>,
) -> anyhow::Result<Vec<Phase>> {
    let run = |workers| {
        let plan = Plan {
            sleep: FEW_SLEEP,
            spread: 0.0,
            workload: Workload::PerWorker(SHARDS_PER_WORKER),
        };
        runtime.block_on(run_phase(simulated_workers, workers, plan))
    };
    FEW_WORKERS.into_iter().map(run).collect()
}

async fn run_phase(
    simulated_workers: &mut Vec<SimulatedWorker>,
    workers: usize,
    plan: Plan,
) -> anyhow::Result<Phase> {
    let plan = Arc::new(plan);
    let started = Instant::now();
    let mut working = JoinSet::new();
    for worker in simulated_workers.drain(..workers) {
        working.spawn(worker.work(Arc::clone(&plan)));
    }
    let mut measurements = Measurements::default();
    while let Some(worked) = working.join_next().await {
        let (worker, own) = worked??;
        simulated_workers.push(worker);
        measurements.add(own);
    }
    Ok(Phase {
        workers,
        duration: started.elapsed(),
        measurements,
    })
}

/// The phase with all workers, and the resources used by each process.
struct FullPhase {
    phase: Phase,
    /// From the first request for a job until the server had stored all results.
    stored: Duration,
    /// Usage of server, NATS and this process, before and after the phase.
    used: [(Usage, Usage); 3],
    /// CPU seconds of the server's threads.
    threads: BTreeMap<String, f64>,
}

impl FullPhase {
    fn measure(
        runtime: &Runtime,
        (simulated_workers, workers): (&mut Vec<SimulatedWorker>, usize),
        plan: Plan,
        processes: [u32; 3],
        wait_until_stored: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<Self> {
        let [server, _, _] = processes;
        let mut threads = Threads::default();
        threads.sample(server)?;
        let before = (threads.clone(), usages(processes)?);
        let started = Instant::now();
        let phase = runtime.block_on(async {
            let mut running = pin!(run_phase(simulated_workers, workers, plan));
            let mut interval = tokio::time::interval(SAMPLE_INTERVAL);
            loop {
                tokio::select! {
                    phase = &mut running => break phase,
                    _ = interval.tick() => threads.sample(server)?,
                }
            }
        })?;
        wait_until_stored()?;
        let stored = started.elapsed();
        threads.sample(server)?;
        let after = usages(processes)?;
        let [server_before, nats_before, workers_before] = before.1;
        let [server_after, nats_after, workers_after] = after;
        Ok(Self {
            phase,
            stored,
            used: [
                (server_before, server_after),
                (nats_before, nats_after),
                (workers_before, workers_after),
            ],
            threads: threads.since(&before.0),
        })
    }

    /// CPU seconds of the process with this index.
    fn cpu_s(&self, index: usize) -> f64 {
        let (before, after) = &self.used[index];
        after.cpu_s - before.cpu_s
    }

    /// CPU seconds of the database's threads, for statements and pages. Waiting for the disk takes no CPU time.
    fn database_s(&self) -> f64 {
        let database = self.threads.iter();
        let database = database.filter(|(name, _)| name.starts_with(DATABASE_THREAD));
        database.map(|(_, cpu_s)| cpu_s).sum()
    }
}

fn usages(processes: [u32; 3]) -> anyhow::Result<[Usage; 3]> {
    let [server, nats, own] = processes;
    Ok([Usage::of(server)?, Usage::of(nats)?, Usage::of(own)?])
}

/// Names of the processes whose usage is measured, in this order.
const PROCESSES: [&str; 3] = ["server", "nats-server", "workers (this process)"];

fn report(settings: &Settings, few: &[Phase], many: &FullPhase) -> anyhow::Result<()> {
    let shards = many.phase.shards() as f64;
    let cpus = thread::available_parallelism()?;
    println!(
        "\nFew workers, {} s a shard, on {cpus} CPUs",
        FEW_SLEEP.as_secs()
    );
    println!("medians in ms: waiting for a job, starting it, storing files, sending the result\n");
    println!("| workers | shards | s | shards/s | efficiency | job | start | files | result |");
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
        "few_sleep_s": FEW_SLEEP.as_secs_f64(),
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

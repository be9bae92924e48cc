//! Compares file transfer by JetStream's object store with HTTP: `make objects`.
//!
//! A real nats-server and a plain HTTP server store the same bytes, sent over the same link: first without a delay, then with
//! a round trip of 200 ms, as to a distant worker. async-nats' `ObjectStore::put` sends a chunk only after the previous one was
//! acknowledged, so its time grows with latency times file size. That of HTTP does not. Larger chunks, which async-nats
//! offers, are measured as well. The only assertion is that the bytes come back unchanged.

#![expect(clippy::print_stdout, reason = "the program prints its measurements")]

mod http;
mod link;

use anyhow::{Context as _, ensure};
use async_nats::jetstream::{
    self,
    object_store::{self, ObjectMetadata, ObjectStore},
    stream::StorageType,
};
use axum::body::Bytes;
use faceoff_tests::nats::Nats;
use http::FileClient;
use serde_json::{Value, json};
use std::{
    fs,
    net::SocketAddr,
    path::Path,
    time::{Duration, Instant},
};
use tokio::{io::AsyncReadExt as _, runtime::Runtime, time::timeout};

/// One-way delays: a round trip takes twice as long.
const DELAYS: [Duration; 2] = [Duration::ZERO, Duration::from_millis(100)];
/// Sizes in MiB, each with the number of measured rounds: a small recording, one of a large shard, and a bundle.
const FILES: [(usize, usize); 3] = [(1, 3), (8, 3), (64, 1)];
/// The default chunk size of async-nats, and the largest that a nats-server accepts by default, less the subject.
const CHUNKS: [(&str, Option<usize>); 2] = [("default", None), ("large", Some(1_000_000))];
/// Time limit of one transfer; exceeding it ends the program.
const TRANSFER_TIMEOUT: Duration = Duration::from_secs(900);
/// Requests without a file, to measure the link.
const PINGS: usize = 5;

fn main() -> anyhow::Result<()> {
    let scratch = tempfile::tempdir()?;
    let nats = Nats::start(&scratch.path().join("nats"));
    let folder = scratch.path().join("http");
    fs::create_dir(&folder)?;
    Runtime::new()?.block_on(measure(&nats, &folder))
}

async fn measure(nats: &Nats, folder: &Path) -> anyhow::Result<()> {
    let http_server = http::serve(folder.to_owned()).await?;
    let mut links = Vec::new();
    for delay in DELAYS {
        links.push(measure_link(nats.address(), http_server, delay).await?);
    }
    println!(
        "{}",
        json!({ "in_flight_bytes": link::IN_FLIGHT_BYTES, "links": links })
    );
    Ok(())
}

/// Measures all files over links with this delay.
async fn measure_link(
    nats: SocketAddr,
    http_server: SocketAddr,
    delay: Duration,
) -> anyhow::Result<Value> {
    let files = FileClient::at(link::forward(http_server, delay).await?)?;
    let nats = link::forward(nats, delay).await?;
    let client = async_nats::connect(format!("nats://{nats}")).await?;
    let bucket = format!("delay-{}", delay.as_millis());
    let stream = format!("OBJ_{bucket}");
    let bucket = object_store::Config {
        bucket,
        storage: StorageType::File,
        num_replicas: 1,
        ..object_store::Config::default()
    };
    let jetstream = jetstream::new(client);
    let store = jetstream.create_object_store(bucket).await?;
    let (mut http_pings, mut nats_pings) = (Vec::new(), Vec::new());
    files.ping().await?;
    for _ in 0..PINGS {
        http_pings.push(measure_seconds(files.ping()).await?.1);
        let request = async { Ok(jetstream.get_stream(&stream).await?) };
        nats_pings.push(measure_seconds(request).await?.1);
    }
    let (http_pings, nats_pings) = (median(http_pings), median(nats_pings));
    println!(
        "\nA link with a round trip of {} ms: an empty request takes {:.1} ms by HTTP, {:.1} ms by NATS\n",
        2 * delay.as_millis(),
        1000.0 * http_pings,
        1000.0 * nats_pings
    );
    println!(
        "| MiB | chunks | bytes per chunk | put by NATS, s | by HTTP, s | ratio | get by NATS, s | by HTTP, s | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut results = Vec::new();
    for (mib, rounds) in FILES {
        for (chunks, bytes) in CHUNKS {
            let comparison = compare(&files, &store, mib, rounds, bytes).await;
            let comparison = comparison.with_context(|| format!("{mib} MiB in {chunks} chunks"))?;
            println!("{}", comparison.line(mib));
            results.push(comparison.json(mib, chunks));
        }
    }
    Ok(json!({
        "delay_s": delay.as_secs_f64(),
        "http_answer_s": http_pings,
        "nats_answer_s": nats_pings,
        "files": results,
    }))
}

/// The measurements of one file size, medians of all rounds.
struct Comparison {
    rounds: usize,
    chunks: usize,
    put: Timing,
    get: Timing,
}

#[derive(Clone, Copy)]
struct Timing {
    nats_s: f64,
    http_s: f64,
    ratio: f64,
}

impl Timing {
    fn of(rounds: Vec<(f64, f64)>) -> Self {
        let median_of = |value: fn(&(f64, f64)) -> f64| median(rounds.iter().map(value).collect());
        Self {
            nats_s: median_of(|(nats, _)| *nats),
            http_s: median_of(|(_, http)| *http),
            ratio: median_of(|(nats, http)| nats / http),
        }
    }

    fn json(self) -> Value {
        json!({ "nats_s": self.nats_s, "http_s": self.http_s, "ratio": self.ratio })
    }
}

impl Comparison {
    fn line(&self, mib: usize) -> String {
        let Self {
            chunks, put, get, ..
        } = self;
        format!(
            "| {mib} | {chunks} | {} | {:.3} | {:.3} | {:.1} | {:.3} | {:.3} | {:.1} |",
            (mib << 20) / chunks,
            put.nats_s,
            put.http_s,
            put.ratio,
            get.nats_s,
            get.http_s,
            get.ratio
        )
    }

    fn json(&self, mib: usize, kind: &str) -> Value {
        json!({
            "bytes": mib << 20,
            "rounds": self.rounds,
            "chunk_size": kind,
            "chunks": self.chunks,
            "put": self.put.json(),
            "get": self.get.json(),
        })
    }
}

/// Transfers the same bytes by NATS and HTTP in turn.
async fn compare(
    files: &FileClient,
    store: &ObjectStore,
    mib: usize,
    rounds: usize,
    chunk_size: Option<usize>,
) -> anyhow::Result<Comparison> {
    let (mut puts, mut gets, mut chunks) = (Vec::new(), Vec::new(), 0);
    for round in 0..rounds {
        let name = format!("{mib}-{round}");
        let bytes = random_bytes(mib << 20, &name);
        let object = ObjectMetadata {
            name: name.clone(),
            chunk_size,
            ..ObjectMetadata::default()
        };
        let put = async { Ok(store.put(object, &mut &bytes[..]).await?) };
        let (info, put_by_nats) = measure_seconds(put).await?;
        chunks = info.chunks;
        let ((), put_by_http) = measure_seconds(files.put(&name, bytes.clone())).await?;
        puts.push((put_by_nats, put_by_http));
        let get = async {
            let mut received = Vec::with_capacity(bytes.len());
            store.get(&name).await?.read_to_end(&mut received).await?;
            Ok(received)
        };
        let (received, get_by_nats) = measure_seconds(get).await?;
        ensure!(received == bytes, "NATS returned other bytes");
        let (received, get_by_http) = measure_seconds(files.get(&name)).await?;
        ensure!(received == bytes, "HTTP returned other bytes");
        gets.push((get_by_nats, get_by_http));
        // The next round must not find the object.
        store.delete(&name).await?;
    }
    Ok(Comparison {
        rounds,
        chunks,
        put: Timing::of(puts),
        get: Timing::of(gets),
    })
}

/// The result of a transfer, and its duration in seconds.
async fn measure_seconds<T>(
    work: impl Future<Output = anyhow::Result<T>>,
) -> anyhow::Result<(T, f64)> {
    let started = Instant::now();
    let done = timeout(TRANSFER_TIMEOUT, work)
        .await
        .context("the transfer exceeded its time limit")??;
    Ok((done, started.elapsed().as_secs_f64()))
}

/// Incompressible bytes, the same for the same name.
fn random_bytes(bytes: usize, name: &str) -> Bytes {
    let mut all = vec![0; bytes];
    let mut hasher = blake3::Hasher::new();
    hasher.update(name.as_bytes());
    hasher.finalize_xof().fill(&mut all);
    Bytes::from(all)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

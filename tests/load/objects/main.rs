//! What it would cost to pass files by JetStream's object store in place of HTTP: `make objects`.
//!
//! A real nats-server and a plain HTTP server store the same bytes, sent over the same link, which a worker far away has: first
//! without a delay, then with 200 ms from a question to its answer. async-nats' `ObjectStore::put` sends a chunk once the last has been
//! acknowledged, so its time grows with the link's length times the file's size; HTTP's does not. Larger chunks are measured as well,
//! since they are the way out that async-nats offers. Nothing is asserted but that what comes back is what was sent.

#![expect(clippy::print_stdout, reason = "it reports what it measured")]

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
use http::Files;
use serde_json::{Value, json};
use std::{
    fs,
    net::SocketAddr,
    path::Path,
    time::{Duration, Instant},
};
use tokio::{io::AsyncReadExt as _, runtime::Runtime, time::timeout};

/// One way: from a question to its answer it is twice that.
const DELAYS: [Duration; 2] = [Duration::ZERO, Duration::from_millis(100)];
/// A small recording, that of a large shard, and a bundle; each so many times.
const FILES: [(usize, usize); 3] = [(1, 3), (8, 3), (64, 1)];
/// async-nats' own chunks, and the largest that a nats-server takes unless it is told otherwise, less their subject.
const CHUNKS: [(&str, Option<usize>); 2] = [("own", None), ("large", Some(1_000_000))];
/// What takes longer is given up, and all with it.
const MOST: Duration = Duration::from_secs(900);
/// Questions without a file, by which the link is measured.
const QUESTIONS: usize = 5;

fn main() -> anyhow::Result<()> {
    let scratch = tempfile::tempdir()?;
    let nats = Nats::start(&scratch.path().join("nats"));
    let folder = scratch.path().join("http");
    fs::create_dir(&folder)?;
    Runtime::new()?.block_on(measure(&nats, &folder))
}

async fn measure(nats: &Nats, folder: &Path) -> anyhow::Result<()> {
    let served = http::serve(folder.to_owned()).await?;
    let mut measured = Vec::new();
    for delay in DELAYS {
        measured.push(over(nats.address(), served, delay).await?);
    }
    println!(
        "{}",
        json!({ "under_way_bytes": link::UNDER_WAY_BYTES, "links": measured })
    );
    Ok(())
}

/// All files, over links with this delay.
async fn over(nats: SocketAddr, served: SocketAddr, delay: Duration) -> anyhow::Result<Value> {
    let files = Files::at(link::to(served, delay).await?)?;
    let nats = link::to(nats, delay).await?;
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
    let (mut of_http, mut of_nats) = (Vec::new(), Vec::new());
    files.ask().await?;
    for _ in 0..QUESTIONS {
        of_http.push(seconds(files.ask()).await?.1);
        let asked = async { Ok(jetstream.get_stream(&stream).await?) };
        of_nats.push(seconds(asked).await?.1);
    }
    let (of_http, of_nats) = (median(of_http), median(of_nats));
    println!(
        "\nA link of {} ms there and back: an empty answer of HTTP takes {:.1} ms, one of NATS {:.1} ms\n",
        2 * delay.as_millis(),
        1000.0 * of_http,
        1000.0 * of_nats
    );
    println!(
        "| MiB | chunks | of bytes | put by NATS, s | by HTTP, s | ratio | get by NATS, s | by HTTP, s | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut lines = Vec::new();
    for (mib, rounds) in FILES {
        for (chunks, bytes) in CHUNKS {
            let found = compare(&files, &store, mib, rounds, bytes).await;
            let found = found.with_context(|| format!("{mib} MiB in {chunks} chunks"))?;
            println!("{}", found.line(mib));
            lines.push(found.json(mib, chunks));
        }
    }
    Ok(json!({
        "delay_s": delay.as_secs_f64(),
        "http_answer_s": of_http,
        "nats_answer_s": of_nats,
        "files": lines,
    }))
}

/// Seconds of one file, the medians of all rounds.
struct Found {
    rounds: usize,
    chunks: usize,
    put: Pair,
    get: Pair,
}

#[derive(Clone, Copy)]
struct Pair {
    nats_s: f64,
    http_s: f64,
    ratio: f64,
}

impl Pair {
    fn of(rounds: Vec<(f64, f64)>) -> Self {
        let of = |one: fn(&(f64, f64)) -> f64| median(rounds.iter().map(one).collect());
        Self {
            nats_s: of(|(nats, _)| *nats),
            http_s: of(|(_, http)| *http),
            ratio: of(|(nats, http)| nats / http),
        }
    }

    fn json(self) -> Value {
        json!({ "nats_s": self.nats_s, "http_s": self.http_s, "ratio": self.ratio })
    }
}

impl Found {
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

/// The same bytes by both, in turns.
async fn compare(
    files: &Files,
    store: &ObjectStore,
    mib: usize,
    rounds: usize,
    chunk_size: Option<usize>,
) -> anyhow::Result<Found> {
    let (mut puts, mut gets, mut chunks) = (Vec::new(), Vec::new(), 0);
    for round in 0..rounds {
        let name = format!("{mib}-{round}");
        let bytes = drawn(mib << 20, &name);
        let object = ObjectMetadata {
            name: name.clone(),
            chunk_size,
            ..ObjectMetadata::default()
        };
        let putting = async { Ok(store.put(object, &mut &bytes[..]).await?) };
        let (info, put_by_nats) = seconds(putting).await?;
        chunks = info.chunks;
        let ((), put_by_http) = seconds(files.put(&name, bytes.clone())).await?;
        puts.push((put_by_nats, put_by_http));
        let getting = async {
            let mut got = Vec::with_capacity(bytes.len());
            store.get(&name).await?.read_to_end(&mut got).await?;
            Ok(got)
        };
        let (got, got_by_nats) = seconds(getting).await?;
        ensure!(got == bytes, "NATS gives back something else");
        let (got, got_by_http) = seconds(files.get(&name)).await?;
        ensure!(got == bytes, "HTTP gives back something else");
        gets.push((got_by_nats, got_by_http));
        // The next one is not to find it.
        store.delete(&name).await?;
    }
    Ok(Found {
        rounds,
        chunks,
        put: Pair::of(puts),
        get: Pair::of(gets),
    })
}

async fn seconds<T>(work: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<(T, f64)> {
    let began = Instant::now();
    let done = timeout(MOST, work).await.context("it takes too long")??;
    Ok((done, began.elapsed().as_secs_f64()))
}

/// Bytes that nobody can make smaller, the same for the same name.
fn drawn(bytes: usize, name: &str) -> Bytes {
    let mut all = vec![0; bytes];
    let mut hasher = blake3::Hasher::new();
    hasher.update(name.as_bytes());
    hasher.finalize_xof().fill(&mut all);
    Bytes::from(all)
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of.get(of.len() / 2).copied().unwrap_or(f64::NAN)
}

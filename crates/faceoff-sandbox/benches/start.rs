//! Measures how long an agent takes from its start to its first line, and its end: as a plain process, and with all layers of the sandbox.
//! The difference is the cost of the sandbox for each agent.
#![expect(clippy::unwrap_used, reason = "a benchmark may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use faceoff_sandbox::{AgentProcess, Isolation, Limits, ReadLine, Runtime, SpawnSpec};
use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::PermissionsExt,
    time::{Duration, Instant},
};

/// A program without a shell or an interpreter.
const PROGRAM: &str = "/usr/bin/echo";
const TIMEOUT: Duration = Duration::from_secs(60);

fn bench_start(criterion: &mut Criterion) {
    let bundle = tempfile::tempdir().unwrap();
    fs::set_permissions(bundle.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let mut runtime = Runtime::native();
    runtime.read_only_paths.push(PROGRAM.into());
    let mut group = criterion.benchmark_group("start");
    group.sample_size(50);
    for (name, isolation) in [
        ("plain process", Isolation::None),
        (
            "all layers",
            Isolation::Sandboxed {
                disabled_layers: Vec::new(),
            },
        ),
    ] {
        let spec = SpawnSpec {
            bundle_dir: bundle.path().to_owned(),
            command: vec![PROGRAM.to_owned(), "ready".to_owned()],
            env: BTreeMap::new(),
            logs_output: false,
            runtime: runtime.clone(),
            limits: Limits::default(),
            isolation,
            cpus: Vec::new(),
        };
        group.bench_function(name, |bencher| bencher.iter(|| run_agent(&spec)));
    }
    group.finish();
}

fn run_agent(spec: &SpawnSpec) {
    let mut agent = AgentProcess::spawn(spec).unwrap();
    let line = agent.read_line(64, Instant::now() + TIMEOUT).unwrap();
    assert!(matches!(line, ReadLine::Line { .. }), "{line:?}");
    agent.finish(TIMEOUT).unwrap();
}

criterion_group!(benches, bench_start);
criterion_main!(benches);

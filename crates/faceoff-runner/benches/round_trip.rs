//! The overhead of the platform on an agent's time, and of recording on the simulator's:
//!
//! * `bare pipe`: the bytes of one question and one answer go to a compiled child process and back
//!   through two pipes, with blocking reads and writes and nothing else;
//! * `protocol`: the same bytes through the session (sandbox, deadlines, serialising, strict
//!   parsing) with a compiled agent that answers at once;
//! * `control step`: one step of the simulator alone;
//! * then the same shard with and without recording; the difference is the cost of recording.
//!
//! The agent is this program, started with `--agent` or `--echo`.
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on ends")]
#![expect(clippy::print_stdout, reason = "a benchmark reports to the terminal")]

mod instant;

use criterion::{BatchSize, Criterion};
use faceoff_airhockey::HIT;
use faceoff_airhockey::SimulationSetup;
use faceoff_episode::NullSink;
use faceoff_runner::{
    AgentEnvironment, KernelCounters, Observer, Session, ShardSpec, play_shard, run_shard,
};
use faceoff_sandbox::{Isolation, affinity};
use faceoff_sim::AirHockeyProfile;
use faceoff_sim::Interpolation;
use faceoff_types::{EpisodeOutcome, Seed};
use faceoff_wire::Message;
use instant::{ACTION, InstantAgent, environment, instant_agent};
use std::{
    fs,
    io::{Read, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::{Duration, Instant},
};

/// An arbitrary step number of two digits.
const STEP: u32 = 17;

/// An observation of arbitrary numbers with all digits.
fn observation() -> Vec<f64> {
    (0..23)
        .map(|i| (f64::from(i) * 0.7).sin() * 1.234_567)
        .collect()
}

/// Repetitions of the episodes without and with recording. Enough for a result within one or two percent on a host
/// whose speed varies by a tenth within seconds.
const RECORDING_ROUNDS: usize = 41;

fn main() {
    let mode = std::env::args().nth(1).unwrap_or_default();
    match mode.as_str() {
        "--agent" => instant_agent(),
        "--echo" => echo(),
        _ => {
            let mut criterion = Criterion::default()
                .configure_from_args()
                .measurement_time(Duration::from_secs(5))
                .warm_up_time(Duration::from_secs(1));
            bench_round_trips(&mut criterion);
            let cpus = affinity::allowed_cpus().unwrap();
            print_medians("one CPU", cpus[0], cpus[0]);
            if let [evaluator_cpu, agent_cpu, ..] = cpus[..] {
                print_medians("separate CPUs", evaluator_cpu, agent_cpu);
            }
            affinity::pin_current_thread(&cpus).unwrap();
            bench_control_steps(&mut criterion);
            criterion.final_summary();
        }
    }
}

/// The other end of the bare pipe: reads the question's bytes, writes the answer's.
fn echo() {
    let size = |index| {
        std::env::args()
            .nth(index)
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    let mut question = vec![0; size(2)];
    let answer = vec![b'x'; size(3)];
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    while input.read_exact(&mut question).is_ok() {
        output.write_all(&answer).unwrap();
        output.flush().unwrap();
    }
}

/// Measures the bare pipe and the protocol, with and without the sandbox.
fn bench_round_trips(criterion: &mut Criterion) {
    let observation = observation();
    let mut question = Vec::new();
    Message::step(STEP, &observation).write_line(&mut question);
    let mut group = criterion.benchmark_group("round trip");
    {
        let mut bare = BarePipe::new(&question);
        group.bench_function("bare pipe", |bencher| {
            bencher.iter(|| bare.round_trip(&question))
        });
    }
    let agent = InstantAgent::new();
    for (name, env) in [
        (
            "protocol, sandboxed",
            environment(Isolation::Sandboxed {
                disabled_layers: Vec::new(),
            }),
        ),
        ("protocol, no sandbox", environment(Isolation::None)),
    ] {
        let mut session = Session::start(&agent.bundle, &env, HIT.into())
            .map_err(|(error, _)| error)
            .unwrap();
        session.reset(0).unwrap();
        let mut step = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                session.step(step, &observation).unwrap();
                step += 1;
            });
        });
        // The computation time of the agent, by which its answers are judged: the clock stops with the last byte of the answer.
        let mut times_s: Vec<f64> = (0..5000)
            .map(|_| {
                step += 1;
                session.step(step, &observation).unwrap().computation_time_s
            })
            .collect();
        times_s.sort_by(f64::total_cmp);
        println!(
            "{name}: computation time p50 {:.1} us, p99 {:.1} us, max {:.1} us",
            1e6 * times_s[times_s.len() / 2],
            1e6 * times_s[times_s.len() * 99 / 100],
            1e6 * times_s[times_s.len() - 1]
        );
        session.finish().unwrap();
    }
    group.finish();
}

/// Prints the median of both kinds of round trip. They alternate, so that other load affects both in the same way. Both use
/// the same CPUs, because waking another CPU costs more than all the rest.
fn print_medians(placement: &str, evaluator_cpu: usize, agent_cpu: usize) {
    const ROUNDS: usize = 200;
    const PER_ROUND: usize = 100;
    let observation = observation();
    let mut question = Vec::new();
    Message::step(STEP, &observation).write_line(&mut question);
    pin(agent_cpu);
    let mut bare = BarePipe::new(&question);
    pin(evaluator_cpu);
    let agent = InstantAgent::new();
    let mut env = environment(Isolation::Sandboxed {
        disabled_layers: Vec::new(),
    });
    env.agent_cpus = vec![agent_cpu];
    let mut session = Session::start(&agent.bundle, &env, HIT.into())
        .map_err(|(error, _)| error)
        .unwrap();
    session.reset(0).unwrap();
    let (mut bare_s, mut protocol_s) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        for _ in 0..PER_ROUND {
            let started_at = Instant::now();
            bare.round_trip(&question);
            bare_s.push(started_at.elapsed().as_secs_f64());
        }
        for index in 0..PER_ROUND {
            let step = u32::try_from(round * PER_ROUND + index).unwrap();
            let started_at = Instant::now();
            session.step(step, &observation).unwrap();
            protocol_s.push(started_at.elapsed().as_secs_f64());
        }
    }
    session.finish().unwrap();
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        1e6 * times[times.len() / 2]
    };
    let (bare, protocol) = (median(&mut bare_s), median(&mut protocol_s));
    println!(
        "median round trip, {placement}: bare pipe {bare:.1} us, protocol {protocol:.1} us, ratio {:.2}",
        protocol / bare
    );
}

/// Pins this thread and the children that it starts from now on.
fn pin(cpu: usize) {
    affinity::pin_current_thread(&[cpu]).unwrap();
}

/// A child that reads as many bytes as the question has and writes as many as the answer.
struct BarePipe {
    child: Child,
    stdin: Option<ChildStdin>,
    stdout: ChildStdout,
    answer: Vec<u8>,
}

impl BarePipe {
    fn new(question: &[u8]) -> Self {
        let answer_len =
            format!("{{\"type\":\"act\",\"step\":{STEP},\"action\":{ACTION}}}\n").len();
        println!(
            "question {} bytes, answer {answer_len} bytes",
            question.len()
        );
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([
                "--echo",
                &question.len().to_string(),
                &answer_len.to_string(),
            ])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take().unwrap());
        Self {
            child,
            stdin,
            stdout,
            answer: vec![0; answer_len],
        }
    }

    fn round_trip(&mut self, question: &[u8]) {
        self.stdin.as_mut().unwrap().write_all(question).unwrap();
        self.stdout.read_exact(&mut self.answer).unwrap();
    }
}

impl Drop for BarePipe {
    fn drop(&mut self) {
        self.stdin = None;
        self.child.wait().unwrap();
    }
}

/// Measures a control step of the simulator alone, and a shard without and with recording.
fn bench_control_steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("control step");
    group.sample_size(20);
    let seed = Seed::from_number(1);
    let setup = SimulationSetup::new(AirHockeyProfile::Evaluation, seed, seed.model_mismatch());
    let world = || setup.episode(faceoff_sim::AirHockeyTask::Prepare, 0, Interpolation::Cubic);
    group.bench_function("simulator alone", |bencher| {
        bencher.iter_batched(
            || {
                let world = world();
                let mut action = world.state().q.to_vec();
                action.extend([0.0; 7]);
                (world, action)
            },
            |(mut world, action)| {
                for _ in 0..50 {
                    std::hint::black_box(world.step(&action));
                }
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();

    // Alternates the same episodes without and with recording, because the host's speed varies. The first round is a
    // warm-up.
    let agent = InstantAgent::new();
    let env = environment(Isolation::Sandboxed {
        disabled_layers: Vec::new(),
    });
    let out = tempfile::tempdir().unwrap();
    let spec = ShardSpec {
        ruleset: faceoff_airhockey::RULESET,
        platform_retries: 0,
        task: HIT,
        episodes: 0..20,
        profile: AirHockeyProfile::Evaluation.name(),
        seed,
        mismatch_seed: seed.model_mismatch(),
        max_faults: 0,
        perturbations: Default::default(),
    };
    let mut steps = 0;
    let mut rounds: Vec<(f64, f64)> = (0..=RECORDING_ROUNDS)
        .map(|_| {
            let cpu_time_before_s = cpu_time_s();
            steps = play_unrecorded(&agent, &env, &spec);
            let unrecorded_s = cpu_time_s() - cpu_time_before_s;
            let cpu_time_before_s = cpu_time_s();
            run_shard(&spec, &agent.bundle, &env, out.path(), &mut NullObserver).unwrap();
            (unrecorded_s, cpu_time_s() - cpu_time_before_s)
        })
        .skip(1)
        .collect();
    rounds.sort_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0)));
    let (unrecorded_s, recorded_s) = rounds[RECORDING_ROUNDS / 2];
    let bytes = fs::metadata(out.path().join("steps.parquet"))
        .unwrap()
        .len();
    println!(
        "{steps} steps: {:.1} us of CPU time per step without recording, {:.1} us with it \
         ({:+.1} %, median of {RECORDING_ROUNDS} rounds); {:.0} bytes per step",
        1e6 * unrecorded_s / f64::from(steps),
        1e6 * recorded_s / f64::from(steps),
        100.0 * (recorded_s / unrecorded_s - 1.0),
        bytes as f64 / f64::from(steps)
    );
}

/// CPU time of this thread, without other work on the host.
fn cpu_time_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Runs a shard without recording; returns the number of steps.
fn play_unrecorded(agent: &InstantAgent, env: &AgentEnvironment, spec: &ShardSpec) -> u32 {
    let mut sink = NullSink;
    let report = play_shard(
        spec,
        &agent.bundle,
        env,
        &mut sink,
        &mut NullObserver,
        &KernelCounters,
    );
    let outcomes = report.unwrap().outcomes;
    outcomes.iter().map(|outcome| outcome.steps).sum()
}

struct NullObserver;

impl Observer for NullObserver {
    fn on_episode_end(&mut self, _: &EpisodeOutcome) {}
    fn cancelled(&self) -> bool {
        false
    }
}

//! A whole recorded game of 45,000 control steps between two compiled agents that answer at once, each in its sandbox:
//! its duration, and the share of this thread. `STEPS=5000` runs a shorter game; `LIVE_FEED=1` adds the live feed, as on a
//! server with viewers.
//!
//! The agents are this program, started with `--agent`.
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on ends")]
#![expect(clippy::print_stdout, reason = "a benchmark reports to the terminal")]

mod instant;

use faceoff_airhockey::EVALUATION;
use faceoff_runner::{
    AgentEnvironment, GameObserver, GameSpec, LiveFeed, LiveFeedSink, POSITION_INTERVAL, run_game,
};
use faceoff_sandbox::{Isolation, affinity};
use faceoff_types::{GAME_WINDOWS, GameLimits, LiveEvent, LivePosition, Seed, WINDOW_STEPS};
use instant::{InstantAgent, environment, instant_agent};
use std::{fs, time::Instant};

struct NullObserver;

impl GameObserver for NullObserver {
    fn cancelled(&self) -> bool {
        false
    }
}

/// Keeps the received events, as the server does for viewers.
#[derive(Default)]
struct CollectingSink {
    events: Vec<LiveEvent>,
    positions: u32,
}

impl LiveFeedSink for CollectingSink {
    fn receive(&mut self, events: Vec<LiveEvent>, _: LivePosition) {
        self.events.extend(events);
        self.positions += 1;
    }

    fn cancelled(&self) -> bool {
        false
    }
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("--agent") {
        return instant_agent();
    }
    let steps = std::env::var("STEPS").map_or(GAME_WINDOWS * WINDOW_STEPS, |steps| {
        steps.parse().expect("STEPS is a number")
    });
    let agent = InstantAgent::new();
    let isolation = Isolation::Sandboxed {
        disabled_layers: Vec::new(),
    };
    let cpus = affinity::allowed_cpus().unwrap();
    let env = environment(isolation);
    // Separate CPUs for both agents and this thread, if there are three.
    let env_on_cpu = |index: usize| AgentEnvironment {
        agent_cpus: cpus
            .get(index)
            .filter(|_| cpus.len() > 2)
            .into_iter()
            .copied()
            .collect(),
        ..env.clone()
    };
    let envs = [env_on_cpu(1), env_on_cpu(2)];
    let seed = Seed::from_number(1);
    let spec = GameSpec {
        ruleset: faceoff_airhockey::RULESET,
        steps,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        limits: GameLimits::default(),
        platform_retries: 0,
        perturbations: Default::default(),
        forfeit_score: Default::default(),
    };
    let out = tempfile::tempdir().unwrap();
    let load_average = || fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!(
        "{} CPUs; load before: {}",
        cpus.len(),
        load_average().trim()
    );
    let (started_at, cpu_time_before_s) = (Instant::now(), cpu_time_s());
    let bundles = [&agent.bundle; 2];
    let mut sink = std::env::var_os("LIVE_FEED").map(|_| CollectingSink::default());
    let report = match &mut sink {
        Some(sink) => {
            let mut feed = LiveFeed::new(sink, POSITION_INTERVAL);
            run_game(&spec, bundles, envs.each_ref(), out.path(), &mut feed)
        }
        None => run_game(
            &spec,
            bundles,
            envs.each_ref(),
            out.path(),
            &mut NullObserver,
        ),
    }
    .unwrap();
    let (wall_s, cpu_s) = (
        started_at.elapsed().as_secs_f64(),
        cpu_time_s() - cpu_time_before_s,
    );
    let outcome = &report.archives.outcome;
    println!(
        "{} control steps, {} rallies, {}: {wall_s:.1} s, of which this thread ran {cpu_s:.1} s ({:.0} us per \
         step); game.zip {:.1} MB",
        outcome.steps,
        outcome.rallies,
        outcome.end.as_str(),
        1e6 * wall_s / f64::from(outcome.steps),
        report.archives.game.bytes as f64 / 1e6,
    );
    for (side, score) in outcome.sides.iter().zip(&report.archives.score.sides) {
        let times = score.computation_time_s;
        println!(
            "side: {} answers, {} late, computation time mean {:.1} us, p99 {:.1} us, max {:.1} ms",
            side.answers,
            side.late_answers,
            1e6 * times.mean,
            1e6 * times.p99,
            1e3 * times.max
        );
    }
    if let Some(sink) = sink {
        println!(
            "live feed: {} events, {} positions",
            sink.events.len(),
            sink.positions
        );
    }
    println!("load after: {}", load_average().trim());
}

/// CPU time of this thread, without other work on the host.
fn cpu_time_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

//! A whole game of 45,000 control steps between two compiled agents that answer at once, each in its sandbox,
//! recorded: how long it takes, and what of it is this thread's own. `STEPS=5000` plays a shorter one; `SHOWN=1` tells of
//! it, as a server does for those who watch.
//!
//! The agents are this very program, started with `--agent`.
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on ends")]
#![expect(clippy::print_stdout, reason = "a benchmark reports to the terminal")]

mod instant;

use faceoff_runner::{
    AgentEnvironment, Commentary, GameAudience, GameObserver, GameSpec, POSITION_EVERY, run_game,
};
use faceoff_sandbox::{Isolation, affinity};
use faceoff_types::{
    GAME_WINDOWS, GameLimits, LiveHappening, LivePosition, Profile, Ruleset, Seed, WINDOW_STEPS,
};
use instant::{InstantAgent, environment, instant_agent};
use std::{fs, time::Instant};

struct Nobody;

impl GameObserver for Nobody {
    fn cancelled(&self) -> bool {
        false
    }
}

/// Keeps what it hears, as the server's hub does.
#[derive(Default)]
struct Audience {
    happenings: Vec<LiveHappening>,
    positions: u32,
}

impl GameAudience for Audience {
    fn hear(&mut self, happenings: Vec<LiveHappening>, _: LivePosition) {
        self.happenings.extend(happenings);
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
        given_up: Vec::new(),
    };
    let cpus = affinity::allowed().unwrap();
    let env = environment(isolation);
    // A CPU for each, where there are three.
    let of = |agent: usize| AgentEnvironment {
        agent_cpus: cpus
            .get(agent)
            .filter(|_| cpus.len() > 2)
            .into_iter()
            .copied()
            .collect(),
        ..env.clone()
    };
    let envs = [of(1), of(2)];
    let seed = Seed::from_number(1);
    let spec = GameSpec {
        ruleset: Ruleset::CURRENT,
        steps,
        profile: Profile::Evaluation,
        seed,
        mismatch_seed: seed.model_mismatch(),
        limits: GameLimits::default(),
        platform_retries: 0,
        perturbations: Box::default(),
    };
    let out = tempfile::tempdir().unwrap();
    let load = || fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("{} CPUs; load before: {}", cpus.len(), load().trim());
    let (started, cpu_started_s) = (Instant::now(), cpu_time_s());
    let bundles = [&agent.bundle; 2];
    let mut audience = std::env::var_os("SHOWN").map(|_| Audience::default());
    let report = match &mut audience {
        Some(audience) => {
            let mut commentary = Commentary::new(audience, POSITION_EVERY);
            run_game(&spec, bundles, envs.each_ref(), out.path(), &mut commentary)
        }
        None => run_game(&spec, bundles, envs.each_ref(), out.path(), &mut Nobody),
    }
    .unwrap();
    let (wall_s, cpu_s) = (
        started.elapsed().as_secs_f64(),
        cpu_time_s() - cpu_started_s,
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
    if let Some(audience) = audience {
        println!(
            "shown: {} happenings, {} positions",
            audience.happenings.len(),
            audience.positions
        );
    }
    println!("load after: {}", load().trim());
}

/// CPU time of this thread: other work on the machine does not count.
fn cpu_time_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

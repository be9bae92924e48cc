//! Measures the agent: runs its episodes in this process, without pipes and sandbox. Prints success, penalty points by
//! kind, and how close to its limits the arm came. For development only.
//!
//! `cargo run -p striker --example measure -- hit,defend,prepare 100 [profile] [seasons] [first seed]`
//!
//! Each season is another draw of the arm's model mismatch. With `TRACE=SEASON:EPISODE` (two numbers) the steps of
//! that episode are printed, with `LIST=1` the episodes that failed or violated a constraint.

#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use std::time::Instant;

use anyhow::{Context, bail};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    AirHockeyProfile, Episode, EpisodeState, Interpolation, PerturbationSettings, Plant, env_info,
};
use faceoff_types::Seed;
use striker::{Agent, Policy};

#[path = "../tests/support/env.rs"]
mod env;

use env::env;

/// Distance of the robot's base from the table's centre, metres.
const BASE_DISTANCE_M: f64 = 1.51;
/// Desired height of the mallet above the base frame's origin, metres.
const MALLET_HEIGHT_M: f64 = 0.1645;
/// Control steps after which every episode must have ended.
const EPISODE_STEPS_MAX: u32 = 500;

/// Sums over the episodes of a task.
#[derive(Default)]
struct Tally {
    episodes: u32,
    successes: u32,
    steps: u32,
    /// Episodes with a violation: of the end effector's bounds, of the lowest height of elbow and wrist, of joint positions, and of
    /// joint velocities.
    ee: u32,
    link: u32,
    joint_pos: u32,
    joint_vel: u32,
    /// Largest deviation of the mallet from its desired height.
    worst_height_error_m: f64,
    /// Largest joint speed relative to its limit.
    worst_speed_share: f64,
    /// Computation times of the agent: the longest, and the sum.
    longest_act_ms: f64,
    total_act_ms: f64,
}

impl Tally {
    /// Penalty points without those for computation time.
    fn penalty(&self) -> f64 {
        f64::from(3 * self.ee + 3 * self.link + 2 * self.joint_pos + self.joint_vel)
    }
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, default: &str| {
        arguments
            .get(index)
            .map_or(default, String::as_str)
            .to_owned()
    };
    let tasks: Vec<AirHockeyTask> = argument(0, "hit,defend,prepare")
        .split(',')
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let episodes: u32 = argument(1, "50")
        .parse()
        .context("number of episodes per season")?;
    let profile: AirHockeyProfile = argument(2, "evaluation").parse()?;
    let seasons: u64 = argument(3, "2").parse().context("number of seasons")?;
    let first_season: u64 = argument(4, "1").parse().context("first season's seed")?;
    let traced_episode = std::env::var("TRACE").ok().and_then(|t| {
        let (season, episode) = t.split_once(':')?;
        Some((season.parse::<u64>().ok()?, episode.parse::<u32>().ok()?))
    });
    let lists_failures = std::env::var("LIST").is_ok();

    let settings = PerturbationSettings::default();
    for task in tasks {
        let mut tally = Tally::default();
        for season in first_season..first_season + seasons {
            let seed = Seed::from_number(season);
            let plant = Plant::for_perturbations(
                profile.active_perturbations(),
                &settings,
                seed.model_mismatch(),
            );
            let mut agent = new_agent(task)?;
            for index in 0..episodes {
                let mut episode = Episode::new(
                    task,
                    Interpolation::Cubic,
                    profile.active_perturbations(),
                    &settings,
                    &plant,
                    seed.episode(task, index),
                );
                play(
                    &mut agent,
                    &mut episode,
                    &mut tally,
                    traced_episode == Some((season, index)),
                )?;
                let v = episode.violations();
                if lists_failures
                    && (!episode.success() || v.ee || v.link || v.joint_pos || v.joint_vel)
                {
                    let puck = episode.state().puck;
                    println!(
                        "  {season}:{index} success {} steps {} puck {puck:.2?} {v:?}",
                        episode.success(),
                        episode.steps()
                    );
                }
            }
        }
        let n = f64::from(tally.episodes);
        println!(
            "{task:8} {:5.1} %  penalty {:.3}/episode (ee {} link {} pos {} vel {})  n {}  steps {:.0}  height ≤ {:.1} mm  speed ≤ {:.3}  act {:.2} ms, ≤ {:.1} ms",
            100.0 * f64::from(tally.successes) / n,
            tally.penalty() / n,
            tally.ee,
            tally.link,
            tally.joint_pos,
            tally.joint_vel,
            tally.episodes,
            f64::from(tally.steps) / n,
            1e3 * tally.worst_height_error_m,
            tally.worst_speed_share,
            tally.total_act_ms / f64::from(tally.steps),
            tally.longest_act_ms,
        );
    }
    Ok(())
}

fn play(
    agent: &mut Agent,
    episode: &mut Episode,
    tally: &mut Tally,
    is_traced: bool,
) -> anyhow::Result<()> {
    agent.reset();
    loop {
        let observation = episode.observation().to_vec();
        let start = Instant::now();
        let action = agent.act(&observation)?;
        let duration_ms = 1e3 * start.elapsed().as_secs_f64();
        tally.total_act_ms += duration_ms;
        tally.longest_act_ms = tally.longest_act_ms.max(duration_ms);
        let outcome = episode.step(action.as_flattened());
        let state = episode.state();
        tally.worst_height_error_m = tally
            .worst_height_error_m
            .max((state.ee[2] - MALLET_HEIGHT_M).abs());
        tally.worst_speed_share = tally.worst_speed_share.max(speed_share(&state));
        if is_traced {
            print_step(agent, episode, &state);
        }
        if outcome.end.is_some() {
            break;
        }
        if episode.steps() > EPISODE_STEPS_MAX {
            bail!("the episode does not end");
        }
    }
    let v = episode.violations();
    tally.episodes += 1;
    tally.successes += u32::from(episode.success());
    tally.steps += episode.steps();
    tally.ee += u32::from(v.ee);
    tally.link += u32::from(v.link);
    tally.joint_pos += u32::from(v.joint_pos);
    tally.joint_vel += u32::from(v.joint_vel);
    Ok(())
}

/// Largest filtered joint speed relative to its limit.
fn speed_share(state: &EpisodeState) -> f64 {
    speed_shares(state)
        .into_iter()
        .map(f64::abs)
        .fold(0.0, f64::max)
}

fn speed_shares(state: &EpisodeState) -> Vec<f64> {
    let limits = env_info(AirHockeyTask::Defend).joint_vel_limit[1];
    state
        .dq_filtered
        .iter()
        .zip(limits)
        .map(|(v, limit)| v / limit)
        .collect()
}

fn print_step(agent: &Agent, episode: &Episode, state: &EpisodeState) {
    let p = state.puck;
    println!(
        "{:3} puck {:+.3} {:+.3} v {:+.2} {:+.2} mallet {:+.3} {:+.3} z {:+.1} mm speed {:.2?} {:.150}",
        episode.steps(),
        p[0],
        p[1],
        p[3],
        p[4],
        state.ee[0] - BASE_DISTANCE_M,
        state.ee[1],
        1e3 * (state.ee[2] - MALLET_HEIGHT_M),
        speed_shares(state),
        agent.describe(),
    );
}

fn new_agent(task: AirHockeyTask) -> anyhow::Result<Agent> {
    let (robots, robot_index) = (1, 0);
    Ok(Agent::new(
        serde_json::from_str(&format!("{:?}", task.name().as_str()))?,
        &env(robots, robot_index),
    ))
}

//! Plays games between two agents in this process and prints scores. For development only; `faceoff play` runs real games.
//!
//! `cargo run --release -p striker --example game -- striker hold [steps] [profile] [games] [first seed]`
//!
//! A player is `striker`, `hold`, or the folder of a bundle whose actions are positions and velocities
//! (interpolation 3), which is started without a sandbox.
//!
//! With `TRACE=100:200` the control steps 100 to 199 of each game are printed. With `LIST=1` the end of each rally is printed, and the
//! first step in each window (500 steps) at which a constraint was violated.

#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use std::path::Path;

use anyhow::Context;
use faceoff_sim::{AirHockeyProfile, Game, GameStep};
use striker::Agent;

#[path = "../tests/support/mod.rs"]
mod support;

mod program;

use program::Program;
use support::game::{Player, ROBOT_1, ROBOT_2, new_game, play};

/// Distance of a robot's base from the table's centre, metres.
const BASE_DISTANCE_M: f64 = 1.51;
/// Whether a robot has violated each of its four constraints in the current window.
type Violated = [[bool; 4]; 2];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, default: &str| {
        arguments
            .get(index)
            .map_or(default, String::as_str)
            .to_owned()
    };
    let names = [argument(0, "striker"), argument(1, "hold")];
    let steps: u32 = argument(2, "45000")
        .parse()
        .context("number of control steps")?;
    let profile: AirHockeyProfile = argument(3, "evaluation").parse()?;
    let games: u64 = argument(4, "1").parse().context("number of games")?;
    let first_seed: u64 = argument(5, "1").parse().context("first game's seed")?;
    let traced_steps = std::env::var("TRACE").ok().and_then(|range| {
        let (from, to) = range.split_once(':')?;
        Some(from.parse::<u32>().ok()?..to.parse::<u32>().ok()?)
    });
    let lists_events = std::env::var("LIST").is_ok();
    for seed in first_seed..first_seed + games {
        let mut players = [player(&names[0], ROBOT_1)?, player(&names[1], ROBOT_2)?];
        let mut violated = [[false; 4]; 2];
        let tally = play(
            &mut new_game(profile, seed),
            &mut players,
            steps,
            |game, players, step| {
                if traced_steps
                    .as_ref()
                    .is_some_and(|range| range.contains(&game.steps()))
                {
                    print_step(game, players);
                }
                if lists_events {
                    print_events(game, step, &mut violated);
                }
            },
        );
        println!("seed {seed}: {tally:?}");
    }
    Ok(())
}

/// The player of a name on the command line.
fn player(name: &str, robot_index: usize) -> anyhow::Result<Player> {
    match name {
        "hold" => Ok(Player::hold()),
        "striker" => Ok(Player::agent(Agent::new, robot_index)),
        folder => Ok(Player::Agent(Box::new(Program::start(
            Path::new(folder),
            robot_index,
        )?))),
    }
}

fn print_events(game: &Game, step: &GameStep, violated: &mut Violated) {
    for (robot, values) in step.constraints.iter().enumerate() {
        let values = [values.ee, values.link, values.joint_pos, values.joint_vel];
        for (k, name) in ["ee", "link", "joint_pos", "joint_vel"]
            .into_iter()
            .enumerate()
        {
            if values[k] > 0.0 && !violated[robot][k] {
                violated[robot][k] = true;
                println!(
                    "  {} robot {} breaks {name} by {:.4}",
                    game.steps(),
                    robot + 1,
                    values[k]
                );
            }
        }
    }
    if step.window.is_some() {
        *violated = [[false; 4]; 2];
    }
    if let Some(end) = step.rally_end {
        println!("  {} rally ends: {end:?}", game.steps());
    }
}

fn print_step(game: &Game, players: &[Player; 2]) {
    let puck = game.world().puck();
    let ([x, y, _], [vx, vy, _]) = (puck.pose, puck.velocity);
    print!(
        "{:5} puck {x:+.3} {y:+.3} v {vx:+.2} {vy:+.2}",
        game.steps()
    );
    for robot in [0, 1] {
        // Each robot's mallet is what the other observes, in the other's frame.
        let seen = &game.observation(1 - robot)[20..22];
        let side = if robot == 0 { -1.0 } else { 1.0 };
        print!(
            " mallet {:+.3} {:+.3}",
            side * (seen[0] - BASE_DISTANCE_M),
            side * seen[1]
        );
    }
    for (robot, player) in players.iter().enumerate() {
        if let Player::Agent(agent) = player {
            print!(" | {}: {:.220}", robot + 1, agent.describe());
        }
    }
    println!();
}

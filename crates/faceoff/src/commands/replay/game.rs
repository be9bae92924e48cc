//! Draws a recorded game, and prints its result and events. A game is a sequence of *rallies*, each from a serve to its end.
//! `motion` is what the page's script animates, `clock` formats times of the game.

mod clock;
mod events;
mod motion;
mod page;
mod penalties;
mod recording;
mod table;

use super::{
    output::{Format, Output},
    video::{Sample, Scene},
};
use crate::commands::output::print;
use recording::RecordedGame;
use serde_json::json;
use std::path::Path;

/// Draws the game at `path`. `rally` is the rally of a picture, or the one at which a page begins.
pub fn draw(path: &Path, rally: Option<u32>, output: &Output) -> anyhow::Result<()> {
    let game = RecordedGame::read(path)?;
    let chosen = rally.map(|number| game.rally(number)).transpose()?;
    match &output.format {
        Format::Html => output.write(page::html(&game, chosen)?)?,
        Format::Svg => output.write(page::svg(&game, chosen)?)?,
        Format::Video(video) => {
            let scene = scene(&game);
            let shown_samples = chosen.map_or(scene.whole(), |rally| {
                [page::first_sample(rally), rally.end_step()].map(|sample| sample as usize)
            });
            video.write(&scene, shown_samples, &output.file)?;
        }
    }
    let events = events::list(&game);
    let score = &game.course.score;
    let summary = json!({
        "game": game.headline(),
        "result": game.result(),
        "agents": game.agents,
        "seed": game.course.seed,
        "steps": score.steps,
        "rallies": score.rallies,
        "sides": score.sides,
        "events": events,
        "penalties": penalties::list(&game),
        "file": output.file,
    });
    print(output.json, &summary, |_| {
        let mut lines = vec![game.headline(), game.result()];
        lines.extend(
            events
                .iter()
                .map(|event| format!("{:>8}  {}", clock::text(event.game_step), event.text)),
        );
        for (agent, side) in game.agents.iter().zip(&score.sides) {
            let counted = |count: u32, unit: &str| {
                format!("{count} {unit}{}", if count == 1 { "" } else { "s" })
            };
            lines.push(format!(
                "{agent}: {}, {}, {:.1} penalty points, {}",
                counted(side.goals, "goal"),
                counted(side.fouls, "foul"),
                side.penalty_points,
                counted(side.faults, "fault")
            ));
        }
        lines.push(output.file.display().to_string());
        lines.join("\n")
    })
}

/// The game as a video shows it.
fn scene(game: &RecordedGame) -> Scene {
    let [home, away] = &game.agents;
    let mut captions = vec![(0, format!("{home} 0 : 0 {away}"))];
    captions.extend(game.course.rallies.iter().map(|rally| {
        let [first, second] = rally.score;
        (
            rally.end_step() as usize,
            format!("{home} {first} : {second} {away}"),
        )
    }));
    let samples = game.samples.iter().map(|positions| Sample {
        puck: positions.puck,
        mallets: positions.mallets.map(Some),
    });
    let rallies = game.course.rallies.iter();
    Scene {
        underlay: String::new(),
        captions,
        rally_starts: rallies
            .map(|rally| page::first_sample(rally) as usize)
            .collect(),
        clock: |step| clock::text(u32::try_from(step).unwrap_or(u32::MAX)),
        samples: samples.collect(),
    }
}

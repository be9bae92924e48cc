//! Who had the puck, who shot from where and how fast, who broke limits where.

use super::live::{at, before};
use crate::{
    broken_places::Places,
    chart::{Bins, Histogram},
    episode_words::group_word,
    figures,
    table_drawing::{self, Place},
};
use faceoff_replay::{Breach, GameAnalysis, Group, Shot, model::CONTROL_STEP_S};

/// Shares of the time, each side's.
pub(super) struct Possession {
    /// That the puck lay on each side's half, in percent.
    pub(super) halves: [String; 2],
    /// That each side had touched it last in the rally.
    pub(super) touched: [String; 2],
    pub(super) untouched: String,
}

pub(super) struct Shots {
    pub(super) team: String,
    pub(super) count: usize,
    pub(super) goals: usize,
    /// m/s; none without a shot.
    pub(super) mean: Option<String>,
    pub(super) fastest: Option<String>,
    /// Where goals, and where other shots came from.
    pub(super) scored: String,
    pub(super) others: String,
    pub(super) rows: Vec<ShotRow>,
}

pub(super) struct ShotRow {
    pub(super) at: String,
    /// The replay a little before.
    pub(super) link: String,
    pub(super) place: String,
    pub(super) speed: String,
    pub(super) goal: bool,
}

/// How fast the shots of both sides were.
pub(super) struct Speeds {
    pub(super) charts: [Histogram; 2],
    /// From where to where, in m/s, and how many of each side's lay there.
    pub(super) rows: Vec<(String, [usize; 2])>,
}

/// A side's broken limits.
pub(super) struct Safety {
    pub(super) team: String,
    pub(super) count: usize,
    pub(super) places: Vec<Places>,
    pub(super) rows: Vec<BreachRow>,
}

pub(super) struct BreachRow {
    pub(super) at: String,
    pub(super) link: String,
    pub(super) word: &'static str,
    pub(super) duration_s: String,
    pub(super) worst: String,
    pub(super) place: String,
}

/// The width of a column of speeds, m/s.
const SPEED_STEP: f64 = 0.5;
/// The most rows of a table: a robot that shakes at a limit breaks it thousands of times.
const MOST_ROWS: usize = 500;

impl Possession {
    pub(super) fn of(analysis: &GameAnalysis) -> Self {
        let share =
            |steps: u32| figures::one(100.0 * f64::from(steps) / f64::from(analysis.steps.max(1)));
        Self {
            halves: analysis.halves.map(share),
            touched: analysis.touched.map(share),
            untouched: share(analysis.untouched),
        }
    }
}

impl Shots {
    pub(super) fn of(analysis: &GameAnalysis, side: usize, team: &str) -> Self {
        let shots = analysis.shots_of(side);
        let places = |goal: bool| -> Vec<Place> {
            let those = shots.iter().filter(|shot| shot.goal == goal);
            those.map(|shot| shot.at).collect()
        };
        let speeds = || shots.iter().map(|shot| shot.speed);
        let fastest = speeds().reduce(f64::max);
        let count = u32::try_from(shots.len()).unwrap_or(u32::MAX);
        Self {
            team: team.to_owned(),
            count: shots.len(),
            goals: shots.iter().filter(|shot| shot.goal).count(),
            mean: fastest.map(|_| figures::one(speeds().sum::<f64>() / f64::from(count))),
            fastest: fastest.map(figures::one),
            scored: table_drawing::dots(&places(true)),
            others: table_drawing::crosses(&places(false)),
            rows: shots.iter().take(MOST_ROWS).map(ShotRow::of).collect(),
        }
    }
}

impl Speeds {
    /// `None` without shots.
    pub(super) fn of(analysis: &GameAnalysis, teams: &[String; 2]) -> Option<Self> {
        let speeds = [0, 1].map(|side| -> Vec<f64> {
            let shots = analysis.shots_of(side).into_iter();
            shots.map(|shot| shot.speed).collect()
        });
        let all = || speeds.iter().flatten().copied();
        all().next()?;
        let bins = Bins::for_all(SPEED_STEP, all());
        let counts = speeds.each_ref().map(|speeds| bins.counts(speeds));
        let most = counts.iter().flatten().copied().max().unwrap_or_default();
        let in_column = |column: usize| counts.each_ref().map(|counts| counts[column]);
        Some(Self {
            charts: [0, 1].map(|side| {
                let title = format!("Shots of {}", teams[side]);
                Histogram::of(&title, "m/s", bins, &counts[side], most)
            }),
            rows: (0..bins.count)
                .map(|column| (bins.words(column), in_column(column)))
                .collect(),
        })
    }
}

impl ShotRow {
    fn of(shot: &Shot) -> Self {
        Self {
            at: at(step(shot.t)),
            link: before(step(shot.t)),
            place: place(shot.at),
            speed: figures::one(shot.speed),
            goal: shot.goal,
        }
    }
}

impl Safety {
    pub(super) fn of(analysis: &GameAnalysis, side: usize, team: &str) -> Self {
        let own: Vec<&Breach> = analysis
            .breaches
            .iter()
            .filter(|breach| breach.side == side)
            .collect();
        let of_group = |group: Group| {
            let those = own.iter().filter(|breach| breach.group == group);
            those.map(|breach| breach.at).collect()
        };
        Self {
            team: team.to_owned(),
            count: own.len(),
            places: Places::by_group(of_group),
            rows: own
                .iter()
                .take(MOST_ROWS)
                .map(|breach| BreachRow {
                    at: at(breach.from),
                    link: before(breach.from),
                    word: group_word(breach.group),
                    duration_s: format!(
                        "{:.2}",
                        f64::from(breach.to + 1 - breach.from) * CONTROL_STEP_S
                    ),
                    worst: worst(breach),
                    place: place(breach.at),
                })
                .collect(),
        }
    }
}

fn worst(breach: &Breach) -> String {
    match breach.group {
        Group::Ee | Group::Link => format!("{} mm", figures::one(1e3 * breach.worst)),
        Group::JointPos => format!("{:.3} rad", breach.worst),
        Group::JointVel => format!("{:.3} rad/s", breach.worst),
    }
}

fn place([x, y]: Place) -> String {
    format!("{x:.2}, {y:.2}")
}

/// The control step in which a moment lies.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a moment of a game"
)]
fn step(t: f64) -> u32 {
    (t / CONTROL_STEP_S).round() as u32
}

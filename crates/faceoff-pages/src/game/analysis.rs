//! Analysis of a game: possession, shots, speeds and violations.

use super::live::{game_clock, replay_link};
use crate::{
    chart::{Bins, Histogram},
    episode_text::constraint_label,
    format,
    table_drawing::{self, Position},
    violation_map::ViolationMarks,
};
use faceoff_replay::{Constraint, GameAnalysis, LocatedViolation, Shot, model::CONTROL_STEP_S};

/// Shares of the playing time in percent. In pairs the home side is first.
pub(super) struct Possession {
    /// While the puck was on the half of this side.
    pub(super) halves: [String; 2],
    /// While this side had touched the puck last.
    pub(super) touched: [String; 2],
    /// Before a side had touched the puck in the rally.
    pub(super) untouched: String,
}

/// Shots of a side: touches after which the puck crosses the middle before any mallet touches it again.
pub(super) struct Shots {
    pub(super) team: String,
    pub(super) count: usize,
    pub(super) goals: usize,
    /// m/s; `None` without shots.
    pub(super) mean_speed: Option<String>,
    pub(super) fastest_speed: Option<String>,
    /// Marks of the shots that led to a goal, and of the other shots; SVG path data.
    pub(super) scored: String,
    pub(super) others: String,
    pub(super) rows: Vec<ShotRow>,
}

pub(super) struct ShotRow {
    pub(super) time: String,
    /// The replay two seconds earlier.
    pub(super) link: String,
    pub(super) position: String,
    pub(super) speed: String,
    /// Did the shot lead to a goal?
    pub(super) goal: bool,
}

/// Distribution of the speeds of shots.
pub(super) struct Speeds {
    pub(super) charts: [Histogram; 2],
    /// Range of speeds in m/s, and the number of shots of each side.
    pub(super) rows: Vec<(String, [usize; 2])>,
}

/// Violations of a side.
pub(super) struct Violations {
    pub(super) team: String,
    pub(super) count: usize,
    pub(super) marks: Vec<ViolationMarks>,
    pub(super) rows: Vec<ViolationRow>,
}

pub(super) struct ViolationRow {
    pub(super) time: String,
    pub(super) link: String,
    pub(super) limit: &'static str,
    pub(super) duration_s: String,
    pub(super) max_excess: String,
    pub(super) position: String,
}

/// Width of a column of the histogram, m/s.
const SPEED_COLUMN_M_S: f64 = 0.5;
/// Largest number of rows of a table: a robot that oscillates at a limit violates it thousands of times.
const MAX_ROWS: usize = 500;

impl Possession {
    pub(super) fn new(analysis: &GameAnalysis) -> Self {
        let share = |steps: u32| {
            format::one_decimal(100.0 * f64::from(steps) / f64::from(analysis.steps.max(1)))
        };
        Self {
            halves: analysis.steps_in_half.map(share),
            touched: analysis.steps_after_touch.map(share),
            untouched: share(analysis.steps_before_touch),
        }
    }
}

impl Shots {
    pub(super) fn new(analysis: &GameAnalysis, side: usize, team: &str) -> Self {
        let shots = analysis.shots_of(side);
        let positions_by_success = |goal: bool| -> Vec<Position> {
            let matching = shots.iter().filter(|shot| shot.goal == goal);
            matching.map(|shot| shot.touch_position).collect()
        };
        let speeds = || shots.iter().map(|shot| shot.speed_m_s);
        let fastest = speeds().reduce(f64::max);
        let count = u32::try_from(shots.len()).unwrap_or(u32::MAX);
        Self {
            team: team.to_owned(),
            count: shots.len(),
            goals: shots.iter().filter(|shot| shot.goal).count(),
            mean_speed: fastest
                .map(|_| format::one_decimal(speeds().sum::<f64>() / f64::from(count))),
            fastest_speed: fastest.map(format::one_decimal),
            scored: table_drawing::dots(&positions_by_success(true)),
            others: table_drawing::crosses(&positions_by_success(false)),
            rows: shots.iter().take(MAX_ROWS).map(ShotRow::new).collect(),
        }
    }
}

impl Speeds {
    /// `None` without shots.
    pub(super) fn new(analysis: &GameAnalysis, teams: &[String; 2]) -> Option<Self> {
        let speeds = [0, 1].map(|side| -> Vec<f64> {
            let shots = analysis.shots_of(side).into_iter();
            shots.map(|shot| shot.speed_m_s).collect()
        });
        let all_speeds = || speeds.iter().flatten().copied();
        all_speeds().next()?;
        let bins = Bins::for_all(SPEED_COLUMN_M_S, all_speeds());
        let counts = speeds.each_ref().map(|speeds| bins.counts(speeds));
        let largest_count = counts.iter().flatten().copied().max().unwrap_or_default();
        let in_column = |column: usize| counts.each_ref().map(|counts| counts[column]);
        Some(Self {
            charts: [0, 1].map(|side| {
                let title = format!("Shots of {}", teams[side]);
                Histogram::new(&title, "m/s", bins, &counts[side], largest_count)
            }),
            rows: (0..bins.count)
                .map(|column| (bins.label(column), in_column(column)))
                .collect(),
        })
    }
}

impl ShotRow {
    fn new(shot: &Shot) -> Self {
        Self {
            time: game_clock(step(shot.touch_s)),
            link: replay_link(step(shot.touch_s)),
            position: position_text(shot.touch_position),
            speed: format::one_decimal(shot.speed_m_s),
            goal: shot.goal,
        }
    }
}

impl Violations {
    pub(super) fn new(analysis: &GameAnalysis, side: usize, team: &str) -> Self {
        let side_violations: Vec<&LocatedViolation> = analysis
            .violations
            .iter()
            .filter(|violation| violation.side == side)
            .collect();
        let constraint_positions = |constraint: Constraint| {
            let matching = side_violations
                .iter()
                .filter(|violation| violation.constraint == constraint);
            matching
                .map(|violation| violation.mallet_position)
                .collect()
        };
        Self {
            team: team.to_owned(),
            count: side_violations.len(),
            marks: ViolationMarks::by_constraint(constraint_positions),
            rows: side_violations
                .iter()
                .take(MAX_ROWS)
                .map(|violation| ViolationRow {
                    time: game_clock(violation.first_sample),
                    link: replay_link(violation.first_sample),
                    limit: constraint_label(violation.constraint),
                    duration_s: format!(
                        "{:.2}",
                        f64::from(violation.last_sample + 1 - violation.first_sample)
                            * CONTROL_STEP_S
                    ),
                    max_excess: max_excess(violation),
                    position: position_text(violation.mallet_position),
                })
                .collect(),
        }
    }
}

fn max_excess(violation: &LocatedViolation) -> String {
    match violation.constraint {
        Constraint::Ee | Constraint::Link => {
            format!("{} mm", format::one_decimal(1e3 * violation.max_excess))
        }
        Constraint::JointPos => format!("{:.3} rad", violation.max_excess),
        Constraint::JointVel => format!("{:.3} rad/s", violation.max_excess),
    }
}

fn position_text([x, y]: Position) -> String {
    format!("{x:.2}, {y:.2}")
}

/// The control step at a time in seconds.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the time is within a game"
)]
fn step(seconds: f64) -> u32 {
    (seconds / CONTROL_STEP_S).round() as u32
}

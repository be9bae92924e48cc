//! The causes of penalty points in a game. A game is divided into windows of 500 control steps, in each of which a cause counts once.

use super::{super::recording::CONSTRAINTS, clock, recording::RecordedGame};
use faceoff_airhockey::{EE, JOINT_POS, JOINT_VEL, LINK};
use faceoff_dataset::game::{SideCourse, Violation};
use faceoff_scoring::{
    COMPUTATION_TIME_LIMITS_S, COMPUTATION_TIME_MAX_POINTS, computation_time_penalty,
};
use faceoff_types::{Side, ViolationName, WINDOW_STEPS};
use serde::Serialize;

/// Penalty points of a side for one cause in one window.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Penalty {
    pub time_s: f64,
    /// Control steps of the game before the first violation, or before the window of the computation time.
    pub game_step: u32,
    /// Number of the penalised side, 1 or 2.
    pub side: u32,
    pub points: f64,
    pub text: String,
}

/// The penalties in the order of time. A side's own archive does not show those of the other side.
pub fn list(game: &RecordedGame) -> Vec<Penalty> {
    let mut penalties = Vec::new();
    for (side, course) in Side::BOTH.into_iter().zip(&game.course.sides) {
        let Some(course) = course else { continue };
        let agent = &game.agents[side.index()];
        for (window, start) in
            (0..course.outcome.windows.len()).zip((0..).step_by(WINDOW_STEPS as usize))
        {
            let causes = violations(course, start).chain(time_or_fault(course, window, start));
            penalties.extend(causes.map(|(game_step, points, cause)| Penalty {
                time_s: clock::seconds(game_step),
                game_step,
                side: side.number(),
                points,
                text: format!("{} for {agent}: {cause}", points_text(points)),
            }));
        }
    }
    penalties.sort_by_key(|penalty| penalty.game_step);
    penalties
}

/// The constraints violated in the window that begins at `start`: control step, points and cause.
fn violations(course: &SideCourse, start: u32) -> impl Iterator<Item = (u32, f64, String)> {
    // Sample k is the state after k control steps, so the window's samples begin at 1.
    let samples = start + 1..=start + WINDOW_STEPS;
    VIOLATION_NAMES
        .into_iter()
        .zip(CONSTRAINTS)
        .filter_map(move |(name, (title, points, unit))| {
            let in_window = || {
                course.violations.iter().filter(|violation| {
                    let Violation {
                        samples: [from, to],
                        ..
                    } = violation;
                    violation.name == name && from <= samples.end() && to >= samples.start()
                })
            };
            let first = in_window().next()?.samples[0].max(*samples.start());
            let steps: u32 = in_window()
                .map(|violation| {
                    let [from, to] = violation.samples;
                    to.min(*samples.end()) - from.max(*samples.start()) + 1
                })
                .sum();
            let max_excess = in_window()
                .map(|violation| violation.max_excess)
                .fold(0.0, f64::max);
            let cause = format!(
                "{title} limit violated in {steps} control steps of {}, by up to {max_excess:.4} {unit}",
                window_text(start)
            );
            Some((first, points, cause))
        })
}

fn points_text(points: f64) -> String {
    let is_one = (points - 1.0).abs() < f64::EPSILON;
    format!("{points} point{}", if is_one { "" } else { "s" })
}

fn window_text(start: u32) -> String {
    // Windows begin at whole seconds.
    let minutes = |step: u32| {
        let seconds = clock::seconds(step) as u32;
        format!("{}:{:02}", seconds / 60, seconds % 60)
    };
    format!("{} to {}", minutes(start), minutes(start + WINDOW_STEPS))
}

/// The violations of [`CONSTRAINTS`], in their order.
const VIOLATION_NAMES: [ViolationName; 4] = [JOINT_POS, JOINT_VEL, EE, LINK];

/// The points of a window for agent faults or for computation time, with control step and cause. Agent faults cost as much as the
/// worst computation times, so a window with an agent fault gets no points for computation time.
fn time_or_fault(course: &SideCourse, window: usize, start: u32) -> Option<(u32, f64, String)> {
    let window_outcome = &course.outcome.windows[window];
    if window_outcome.faults > 0 {
        let steps = start..start + WINDOW_STEPS;
        let first = course.outcome.faults.iter().map(|fault| fault.game_step);
        let step = first.filter(|step| steps.contains(step)).min();
        let cause = format!(
            "agent faults in {}: {}",
            window_text(start),
            window_outcome.faults
        );
        return Some((step.unwrap_or(start), COMPUTATION_TIME_MAX_POINTS, cause));
    }
    let time = &window_outcome.computation_time;
    let points = computation_time_penalty(time);
    (points > 0.0).then(|| {
        let cause = format!(
            "computation time in {} up to {:.1} ms and {:.1} ms on average, where up to {:.0} ms cost nothing",
            window_text(start),
            1e3 * time.max_s,
            1e3 * time.mean_s,
            1e3 * COMPUTATION_TIME_LIMITS_S[0]
        );
        (start, points, cause)
    })
}

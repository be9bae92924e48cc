//! The scores of all teams over the days of a board: as a sparkline in each row, and as a chart of all teams.

use crate::{chart::TeamsChart, format};
use faceoff_api::views::board::BoardView;
use faceoff_service::{app::AppState, problem::Problem, views::visibility::Visibility};
use faceoff_store::{BoardScope, DayScore};
use faceoff_types::TeamId;
use jiff::{ToSpan, civil::Date};
use std::collections::{BTreeMap, BTreeSet};

/// Calendar days before the board's own that are shown.
const DAYS: i64 = 59;
/// Size of the line in a row, in units of its drawing, and its margin.
const WIDTH: f64 = 72.0;
const HEIGHT: f64 = 20.0;
const MARGIN: f64 = 2.0;

/// The scores of each team on the days of the board.
#[derive(Default)]
pub(super) struct ScoreHistory {
    teams: BTreeMap<TeamId, Vec<(Date, f64)>>,
}

/// The line in a row.
pub(super) struct Sparkline {
    /// SVG path.
    pub(super) path: String,
    pub(super) end: [String; 2],
    /// Text alternative.
    pub(super) description: String,
}

impl ScoreHistory {
    /// `day`: the board's own; `None` before the first result. `is_live`: includes results after a freeze of the board.
    pub(super) async fn load(
        app: &AppState,
        visibility: &Visibility,
        board: &BoardView,
        (day, is_live): (Option<Date>, bool),
    ) -> Result<Self, Problem> {
        let mut score_history = Self::default();
        let Some(day) = day.filter(|_| !visibility.hides_scores(board.stage)) else {
            return Ok(score_history);
        };
        let frozen = board.frozen.as_ref().filter(|_| !is_live);
        let scope = BoardScope {
            finished_until: frozen.map(|frozen| frozen.at),
            last_day: Some(day),
            ..BoardScope::default()
        };
        let first_day = day.saturating_sub(DAYS.days());
        let scores =
            app.store
                .day_scores(board.stage, board.revision, &scope, (board.task, first_day));
        let shown: BTreeSet<TeamId> = board.rows.iter().map(|row| row.team_id).collect();
        for DayScore { team, day, score } in scores.await? {
            // A board of a division leaves teams out.
            if !shown.contains(&team) {
                continue;
            }
            score_history
                .teams
                .entry(team)
                .or_default()
                .push((day, score));
        }
        Ok(score_history)
    }

    /// First and last day of all teams, if there are several.
    fn span(&self) -> Option<(Date, Date)> {
        let days = self.teams.values().flatten().map(|(day, _)| *day);
        let first = days.clone().min()?;
        let last = days.max()?;
        (first < last).then_some((first, last))
    }

    /// `None` if the team has fewer than two days.
    pub(super) fn sparkline(&self, team: TeamId) -> Option<Sparkline> {
        let (first, last) = self.span()?;
        let scores = self.teams.get(&team).filter(|scores| scores.len() > 1)?;
        // All lines share both axes, so that rows can be compared.
        let all_scores = self.teams.values().flatten().map(|(_, score)| *score);
        let (low, high) = all_scores
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), score| {
                (low.min(score), high.max(score))
            });
        let range = (high - low).max(1.0);
        let position = |(day, score): &(Date, f64)| {
            let x = MARGIN + (WIDTH - 2.0 * MARGIN) * days(first, *day) / days(first, last);
            let y = HEIGHT - MARGIN - (HEIGHT - 2.0 * MARGIN) * (score - low) / range;
            [x, y].map(format::one_decimal)
        };
        let points: Vec<[String; 2]> = scores.iter().map(position).collect();
        let letters = std::iter::once('M').chain(std::iter::repeat('L'));
        let path = letters
            .zip(&points)
            .map(|(letter, [x, y])| format!("{letter}{x} {y}"))
            .collect();
        let texts = scores
            .iter()
            .map(|(day, score)| format!("{}: {score:.1}", day.strftime("%-d %B")));
        Some(Sparkline {
            path,
            end: points.last()?.clone(),
            description: texts.collect::<Vec<_>>().join(", "),
        })
    }

    /// The chart of the teams by rank, however the rows are sorted; `None` with fewer than two days.
    pub(super) fn chart(&self, board: &BoardView) -> Option<TeamsChart> {
        let span = self.span()?;
        let mut rows: Vec<_> = board.rows.iter().collect();
        rows.sort_by_key(|row| row.rank);
        let teams = rows.into_iter().filter_map(|row| {
            let scores = self.teams.get(&row.team_id)?;
            Some((row.team.as_str(), &scores[..]))
        });
        Some(TeamsChart::new(span, teams))
    }
}

fn days(from: Date, to: Date) -> f64 {
    f64::from((to - from).get_days())
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    fn score_history(scores: &[(u128, i8, f64)]) -> ScoreHistory {
        let mut score_history = ScoreHistory::default();
        for (team, day, score) in scores {
            let scores = score_history.teams.entry(team_id(*team)).or_default();
            scores.push((date(2026, 3, *day), *score));
        }
        score_history
    }

    fn team_id(number: u128) -> TeamId {
        let id = format!("00000000-0000-0000-0000-{number:012}");
        id.parse().unwrap()
    }

    #[test]
    fn sparklines_share_days_and_scores() {
        let score_history =
            score_history(&[(1, 1, 20.0), (1, 3, 60.0), (2, 2, 40.0), (2, 3, 40.0)]);
        let path = |team| score_history.sparkline(team_id(team)).unwrap().path;
        assert_eq!(path(1), "M2.0 18.0L70.0 2.0");
        assert_eq!(path(2), "M36.0 10.0L70.0 10.0");
        assert_eq!(
            score_history.sparkline(team_id(1)).unwrap().description,
            "1 March: 20.0, 3 March: 60.0"
        );
    }

    #[test]
    fn single_day_has_no_line() {
        assert!(
            score_history(&[(1, 1, 20.0)])
                .sparkline(team_id(1))
                .is_none()
        );
        let joined_late = score_history(&[(1, 1, 20.0), (1, 2, 20.0), (2, 2, 5.0)]);
        assert!(joined_late.sparkline(team_id(2)).is_none());
        assert!(joined_late.sparkline(team_id(1)).is_some());
    }
}

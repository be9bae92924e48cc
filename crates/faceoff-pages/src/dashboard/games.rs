//! The games of a team in tournaments.

use crate::game_row::{GameRow, ResultDisplay};
use faceoff_service::{
    app::AppState,
    problem::Problem,
    viewer::Viewer,
    views::{game, tournament::entered_tournaments, tournament_state::TournamentState},
};
use faceoff_types::{StageName, TeamId, TournamentId};

/// How many of the latest games of a tournament are listed.
const MAX_LISTED: usize = 5;

/// A tournament that the team has entered.
pub(super) struct TeamTournament {
    pub(super) id: TournamentId,
    pub(super) name: StageName,
    /// The team's latest games, in the order of play.
    pub(super) games: Vec<GameRow>,
}

/// The tournaments that the team has entered, the newest first.
pub(super) async fn of_team(
    app: &AppState,
    team: TeamId,
    results: ResultDisplay,
) -> Result<Vec<TeamTournament>, Problem> {
    let mut tournaments = Vec::new();
    for (id, name) in entered_tournaments(app, team).await?.into_iter().rev() {
        let state = TournamentState::without_standings(app, id).await?;
        let viewer = Viewer::Team(team);
        let round_games = game::round_games(&state, viewer, None)?;
        let rows = round_games
            .iter()
            .filter_map(|view| GameRow::new(view, results));
        let mut games: Vec<GameRow> = rows.filter(|row| row.team_ids.contains(&team)).collect();
        games.drain(..games.len().saturating_sub(MAX_LISTED));
        tournaments.push(TeamTournament { id, name, games });
    }
    Ok(tournaments)
}

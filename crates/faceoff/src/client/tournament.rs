//! Requests about tournaments. A *tournament* is a series of rounds of games between the teams' agents. A *replay* of it plays
//! all its games again with new seeds, to see how much the winner depended on chance.

use super::Client;
use faceoff_api::{
    requests::{
        Confirmation, Decision, GamesQuery, NewDeparture, NewEntrants, NewFriendlyGame,
        NewScheduleReplays, NewTestGames, NewTournament, Reason, TournamentChange,
    },
    views::{
        champion_shares::ChampionSharesView,
        game::{GameView, TestGamesView},
        tournament::{RoundView, TournamentSummary, TournamentView},
    },
};
use faceoff_scoring::tournament::{HeadToHead, rating::Ratings};
use faceoff_types::{RoundNumber, TeamName, TournamentId};
use reqwest::Method;

impl Client {
    /// All tournaments, the oldest first.
    pub async fn tournaments(&self) -> anyhow::Result<Vec<TournamentSummary>> {
        self.get("/tournaments").await
    }

    /// One tournament, with rules, teams, rounds and standings.
    pub async fn tournament(&self, id: TournamentId) -> anyhow::Result<TournamentView> {
        self.get(&tournament_path(id, "")).await
    }

    /// The games of all rounds or of one, in playing sequence.
    pub async fn games(
        &self,
        id: TournamentId,
        round: Option<RoundNumber>,
    ) -> anyhow::Result<Vec<GameView>> {
        let request = self.request(Method::GET, &tournament_path(id, "/games"));
        self.list(request.query(&GamesQuery { round })).await
    }

    /// Ratings of the submissions.
    pub async fn ratings(&self, id: TournamentId) -> anyhow::Result<Ratings> {
        self.get(&tournament_path(id, "/ratings")).await
    }

    /// The record of every pair of teams that have met.
    pub async fn head_to_head(&self, id: TournamentId) -> anyhow::Result<Vec<HeadToHead>> {
        self.get(&tournament_path(id, "/head-to-head")).await
    }

    /// How often each team won when the whole schedule was replayed.
    pub async fn champion_shares(&self, id: TournamentId) -> anyhow::Result<ChampionSharesView> {
        self.get(&tournament_path(id, "/certainty")).await
    }

    pub async fn open_tournament(&self, new: &NewTournament) -> anyhow::Result<TournamentView> {
        self.post("/tournaments", new).await
    }

    pub async fn change_tournament(
        &self,
        id: TournamentId,
        change: &TournamentChange,
    ) -> anyhow::Result<TournamentView> {
        self.call_with_body(Method::PATCH, &tournament_path(id, ""), change)
            .await
    }

    /// Organiser: enters teams.
    pub async fn enter_teams(
        &self,
        id: TournamentId,
        teams: Vec<TeamName>,
    ) -> anyhow::Result<TournamentView> {
        let path = tournament_path(id, "/entrants");
        self.post(&path, &NewEntrants { teams }).await
    }

    /// Organiser: removes a team from a tournament, as withdrawn or disqualified.
    pub async fn record_departure(
        &self,
        id: TournamentId,
        departure: &NewDeparture,
    ) -> anyhow::Result<TournamentView> {
        self.post(&tournament_path(id, "/departures"), departure)
            .await
    }

    pub async fn withdraw_from_tournament(
        &self,
        id: TournamentId,
        decision: &Decision,
    ) -> anyhow::Result<TournamentView> {
        self.post(&tournament_path(id, "/withdrawal"), decision)
            .await
    }

    /// Organiser: draws the next round and starts it.
    pub async fn start_round(&self, id: TournamentId) -> anyhow::Result<RoundView> {
        self.post_empty(&tournament_path(id, "/rounds")).await
    }

    /// Organiser: pauses a tournament: no further game starts.
    pub async fn pause_tournament(
        &self,
        id: TournamentId,
        reason: String,
    ) -> anyhow::Result<TournamentView> {
        self.post(&tournament_path(id, "/pause"), &Reason { reason })
            .await
    }

    pub async fn resume_tournament(&self, id: TournamentId) -> anyhow::Result<TournamentView> {
        self.post_empty(&tournament_path(id, "/resume")).await
    }

    /// Organiser: closes a tournament permanently; `confirm` is its name.
    pub async fn close_tournament(
        &self,
        id: TournamentId,
        confirm: Option<String>,
    ) -> anyhow::Result<TournamentView> {
        let path = tournament_path(id, "/close");
        self.post(&path, &Confirmation { confirm }).await
    }

    /// Team: requests a game of its agent against the baseline. Organiser: such games of `teams`, by default of all.
    pub async fn request_test_games(
        &self,
        id: TournamentId,
        teams: Option<Vec<TeamName>>,
    ) -> anyhow::Result<TestGamesView> {
        let path = tournament_path(id, "/test-games");
        self.post(&path, &NewTestGames { teams }).await
    }

    /// Team: requests a friendly game against another team.
    pub async fn request_friendly_game(
        &self,
        id: TournamentId,
        opponent: TeamName,
    ) -> anyhow::Result<GameView> {
        let path = tournament_path(id, "/friendly-games");
        self.post(&path, &NewFriendlyGame { opponent }).await
    }

    /// Team: its friendly and test games, which do not count, the newest first. Organiser: those of all teams.
    pub async fn uncounted_games(&self, id: TournamentId) -> anyhow::Result<Vec<GameView>> {
        self.list(self.request(Method::GET, &tournament_path(id, "/uncounted-games")))
            .await
    }

    /// Organiser: requests replays of the whole schedule.
    pub async fn request_schedule_replays(
        &self,
        id: TournamentId,
        times: u32,
    ) -> anyhow::Result<ChampionSharesView> {
        let path = tournament_path(id, "/replays");
        self.post(&path, &NewScheduleReplays { times }).await
    }

    /// Organiser: cancels the unfinished replays.
    pub async fn cancel_schedule_replays(
        &self,
        id: TournamentId,
    ) -> anyhow::Result<ChampionSharesView> {
        self.call(Method::DELETE, &tournament_path(id, "/replays"))
            .await
    }
}

fn tournament_path(id: TournamentId, suffix: &str) -> String {
    format!("/tournaments/{id}{suffix}")
}

//! What a client asks about tournaments.

use super::Client;
use faceoff_api::{
    requests::{
        Confirmation, Decision, GamesQuery, NewDeparture, NewEntrants, NewFriendlyGame, NewReplays,
        NewTestGames, NewTournament, Reason, TournamentChange,
    },
    views::{
        certainty::CertaintyView,
        game::{GameView, TestGamesView},
        tournament::{RoundView, TournamentHead, TournamentView},
    },
};
use faceoff_scoring::tournament::{HeadToHead, rating::Ratings};
use faceoff_types::{RoundNumber, TeamName, TournamentId};
use reqwest::Method;

impl Client {
    /// All tournaments, the first one first.
    pub async fn tournaments(&self) -> anyhow::Result<Vec<TournamentHead>> {
        self.get("/tournaments").await
    }

    /// One, with rules, teams, rounds and tables.
    pub async fn tournament(&self, id: TournamentId) -> anyhow::Result<TournamentView> {
        self.get(&of(id, "")).await
    }

    /// The games of its rounds, or of one of them, in the order of play.
    pub async fn games(
        &self,
        id: TournamentId,
        round: Option<RoundNumber>,
    ) -> anyhow::Result<Vec<GameView>> {
        let request = self.request(Method::GET, &of(id, "/games"));
        self.list(request.query(&GamesQuery { round })).await
    }

    /// Ratings of the submissions that played.
    pub async fn ratings(&self, id: TournamentId) -> anyhow::Result<Ratings> {
        self.get(&of(id, "/ratings")).await
    }

    /// The record of each two teams that met.
    pub async fn head_to_head(&self, id: TournamentId) -> anyhow::Result<Vec<HeadToHead>> {
        self.get(&of(id, "/head-to-head")).await
    }

    /// Who was champion how often when the schedule was played again.
    pub async fn certainty(&self, id: TournamentId) -> anyhow::Result<CertaintyView> {
        self.get(&of(id, "/certainty")).await
    }

    pub async fn open_tournament(&self, new: &NewTournament) -> anyhow::Result<TournamentView> {
        self.tell(Method::POST, "/tournaments", new).await
    }

    pub async fn change_tournament(
        &self,
        id: TournamentId,
        change: &TournamentChange,
    ) -> anyhow::Result<TournamentView> {
        self.tell(Method::PATCH, &of(id, ""), change).await
    }

    /// Organiser: enters teams.
    pub async fn enter_teams(
        &self,
        id: TournamentId,
        teams: Vec<TeamName>,
    ) -> anyhow::Result<TournamentView> {
        let path = of(id, "/entrants");
        self.tell(Method::POST, &path, &NewEntrants { teams }).await
    }

    /// Organiser: takes a team out.
    pub async fn depart(
        &self,
        id: TournamentId,
        departure: &NewDeparture,
    ) -> anyhow::Result<TournamentView> {
        self.tell(Method::POST, &of(id, "/departures"), departure)
            .await
    }

    pub async fn withdraw_from_tournament(
        &self,
        id: TournamentId,
        decision: &Decision,
    ) -> anyhow::Result<TournamentView> {
        self.tell(Method::POST, &of(id, "/withdrawal"), decision)
            .await
    }

    /// Organiser: draws the next round and starts it.
    pub async fn start_round(&self, id: TournamentId) -> anyhow::Result<RoundView> {
        self.act(Method::POST, &of(id, "/rounds")).await
    }

    /// Organiser: lets no game of it begin.
    pub async fn pause_tournament(
        &self,
        id: TournamentId,
        reason: String,
    ) -> anyhow::Result<TournamentView> {
        self.tell(Method::POST, &of(id, "/pause"), &Reason { reason })
            .await
    }

    /// Organiser: lets it go on.
    pub async fn resume_tournament(&self, id: TournamentId) -> anyhow::Result<TournamentView> {
        self.act(Method::POST, &of(id, "/resume")).await
    }

    /// Organiser: closes it for good; `confirm` is its name.
    pub async fn close_tournament(
        &self,
        id: TournamentId,
        confirm: Option<String>,
    ) -> anyhow::Result<TournamentView> {
        let path = of(id, "/close");
        self.tell(Method::POST, &path, &Confirmation { confirm })
            .await
    }

    /// Team: has its agent play the baseline. Organiser: these teams' agents, or everybody's.
    pub async fn order_test_games(
        &self,
        id: TournamentId,
        teams: Option<Vec<TeamName>>,
    ) -> anyhow::Result<TestGamesView> {
        let path = of(id, "/test-games");
        self.tell(Method::POST, &path, &NewTestGames { teams })
            .await
    }

    /// Team: plays another one without counting.
    pub async fn order_friendly_game(
        &self,
        id: TournamentId,
        opponent: TeamName,
    ) -> anyhow::Result<GameView> {
        let path = of(id, "/friendly-games");
        self.tell(Method::POST, &path, &NewFriendlyGame { opponent })
            .await
    }

    /// Team: its games that do not count, the newest first. Organiser: all.
    pub async fn free_games(&self, id: TournamentId) -> anyhow::Result<Vec<GameView>> {
        self.list(self.request(Method::GET, &of(id, "/free-games")))
            .await
    }

    /// Organiser: has the whole schedule played again so many times.
    pub async fn order_replays(
        &self,
        id: TournamentId,
        times: u32,
    ) -> anyhow::Result<CertaintyView> {
        let path = of(id, "/replays");
        self.tell(Method::POST, &path, &NewReplays { times }).await
    }

    /// Organiser: calls off the replays that are not over.
    pub async fn cancel_replays(&self, id: TournamentId) -> anyhow::Result<CertaintyView> {
        self.act(Method::DELETE, &of(id, "/replays")).await
    }
}

fn of(id: TournamentId, what: &str) -> String {
    format!("/tournaments/{id}{what}")
}

//! A site with a tournament named “Cup”, for tests: helpers that start rounds and run games.

use super::fake_worker::{self, GameOutcome};
use crate::site::{ADMIN, Answer, Site, TestTeam, string};
use faceoff_store::{Game, JobClaim};
use faceoff_types::Seed;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A site with a tournament, whose teams all have a valid submission.
pub struct TestTournament {
    pub site: Site,
    /// The teams by name.
    pub teams: BTreeMap<String, TestTeam>,
    /// Path of the tournament in the API.
    pub path: String,
}

impl TestTournament {
    /// Creates teams with valid submissions, and a tournament of them. `body` has the other fields of the request.
    pub async fn open(names: &[&str], body: Value) -> Self {
        Self::open_on(Site::start().await, names, body).await
    }

    /// A round robin of three teams whose first round has started. `publishes` says when recordings become public.
    pub async fn start_round_robin(publishes: &str) -> Self {
        let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
        let settings = json!({ "publishes": publishes });
        let body = json!({ "rules": rules, "settings": settings });
        let cup = Self::open(&["A", "B", "C"], body).await;
        cup.start_round().await;
        cup
    }

    /// As [`Self::open`], on a given site.
    pub async fn open_on(site: Site, names: &[&str], mut body: Value) -> Self {
        let mut teams = BTreeMap::new();
        for name in names {
            let team = site.team(name).await;
            site.valid_submission(&team, &format!("{name}-agent")).await;
            teams.insert((*name).to_owned(), team);
        }
        body["name"] = json!("Cup");
        if body.get("teams").is_none() {
            body["teams"] = json!(names);
        }
        let opened = site.post("/api/v1/tournaments", Some(ADMIN), &body).await;
        let location = opened.header("location").to_owned();
        opened.json(201);
        Self {
            site,
            teams,
            path: location,
        }
    }

    pub fn token(&self, team: &str) -> &str {
        &self.teams[team].token
    }

    /// A request of the organiser below the tournament's path.
    pub async fn post(&self, resource: &str, body: Value) -> Answer {
        let path = format!("{}/{resource}", self.path);
        self.site.post(&path, Some(ADMIN), &body).await
    }

    /// Changes the tournament as an organiser.
    pub async fn change(&self, body: Value) -> Answer {
        self.site.patch(&self.path, Some(ADMIN), &body).await
    }

    /// The tournament's public view.
    pub async fn view(&self) -> Value {
        self.site.get(&self.path, None).await.json(200)
    }

    /// The public list of games, all pages of it.
    pub async fn games(&self) -> Vec<Value> {
        let mut games = Vec::new();
        let mut page = format!("{}/games", self.path);
        loop {
            let answer = self.site.get(&page, None).await;
            games.extend(answer.json(200).as_array().unwrap().clone());
            let Some(next) = answer.headers.get("link") else {
                return games;
            };
            let next = next.to_str().unwrap().trim_start_matches('<');
            page = next.split('>').next().unwrap().to_owned();
        }
    }

    pub async fn start_round(&self) -> Value {
        self.post("rounds", json!({})).await.json(201)
    }

    /// Adds a team with a valid submission, without entering it in the tournament.
    pub async fn add_team(&mut self, name: &str) {
        let team = self.site.team(name).await;
        self.site
            .valid_submission(&team, &format!("{name}-agent"))
            .await;
        self.teams.insert(name.to_owned(), team);
    }

    /// Claims the next game as a slot does; `None` if no queued game may start.
    pub async fn claim(&self) -> Option<(JobClaim, Game, Seed)> {
        fake_worker::claim(&self.site).await
    }

    /// The names of both teams of a game.
    pub async fn names(&self, game: &Game) -> [String; 2] {
        fake_worker::names(&self.site, game).await
    }

    /// Commits the result of a game with its files.
    pub async fn commit(&self, claim: &JobClaim, game: &Game, seed: Seed, outcome: GameOutcome) {
        fake_worker::commit(&self.site, (claim, game, seed), outcome).await;
    }

    /// Plays the next game; `None` if no game is queued.
    pub async fn play_next(
        &self,
        outcome: impl Fn(&Game, [&str; 2]) -> GameOutcome,
    ) -> Option<Game> {
        fake_worker::play_next(&self.site, outcome).await
    }

    /// Plays all queued games. Returns their number.
    pub async fn play(&self, outcome: impl Fn(&Game, [&str; 2]) -> GameOutcome) -> u32 {
        let mut played = 0;
        while self.play_next(&outcome).await.is_some() {
            played += 1;
        }
        played
    }
}

/// The team whose name comes first wins 2 : 1.
pub fn first_by_name_wins(_: &Game, [home, away]: [&str; 2]) -> GameOutcome {
    if home < away {
        GameOutcome::goals(2, 1)
    } else {
        GameOutcome::goals(1, 2)
    }
}

/// The names of both teams, from the view of a game.
pub fn team_names(game: &Value) -> (String, String) {
    let name = |side: usize| string(&game["sides"][side]["team_name"]);
    (name(0), name(1))
}

//! A tournament on a site.

use super::slot::{self, Went};
use crate::site::{ADMIN, Answer, Site, TestTeam, text};
use faceoff_store::{Claim, Game};
use faceoff_types::Seed;
use reqwest::Method;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A tournament of teams that all have a valid agent.
pub struct Cup {
    pub site: Site,
    pub teams: BTreeMap<String, TestTeam>,
    pub path: String,
}

impl Cup {
    /// Teams with agents, and a tournament of them.
    pub async fn open(names: &[&str], body: Value) -> Self {
        Self::open_on(Site::start().await, names, body).await
    }

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

    /// What the organiser asks of the tournament.
    pub async fn post(&self, what: &str, body: Value) -> Answer {
        let path = format!("{}/{what}", self.path);
        self.site.post(&path, Some(ADMIN), &body).await
    }

    pub async fn change(&self, body: Value) -> Answer {
        let request = self.site.request(Method::PATCH, &self.path, Some(ADMIN));
        Answer::of(request.json(&body).send().await.unwrap()).await
    }

    /// As everybody sees it.
    pub async fn view(&self) -> Value {
        self.site.get(&self.path, None).await.json(200)
    }

    /// Its games, as everybody sees them.
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

    /// A team's newest upload becomes an agent of the season later.
    pub async fn late_team(&mut self, name: &str) {
        let team = self.site.team(name).await;
        self.site
            .valid_submission(&team, &format!("{name}-agent"))
            .await;
        self.teams.insert(name.to_owned(), team);
    }

    /// The next game, as a slot gets it; none: nothing is to be done.
    pub async fn claim(&self) -> Option<(Claim, Game, Seed)> {
        slot::claim(&self.site).await
    }

    /// The names of both sides.
    pub async fn names(&self, game: &Game) -> [String; 2] {
        slot::names(&self.site, game).await
    }

    /// Commits a result with its files.
    pub async fn commit(&self, claim: &Claim, game: &Game, seed: Seed, went: Went) {
        slot::commit(&self.site, (claim, game, seed), went).await;
    }

    /// Plays the next game; none: nothing is to be done.
    pub async fn play_next(&self, went: impl Fn(&Game, [&str; 2]) -> Went) -> Option<Game> {
        slot::play_next(&self.site, went).await
    }

    /// Plays until nothing is left; how many.
    pub async fn play(&self, went: impl Fn(&Game, [&str; 2]) -> Went) -> u32 {
        let mut played = 0;
        while self.play_next(&went).await.is_some() {
            played += 1;
        }
        played
    }
}

/// The team whose name comes first wins 2 : 1.
pub fn first_by_name_wins(_: &Game, [home, away]: [&str; 2]) -> Went {
    if home < away {
        Went::goals(2, 1)
    } else {
        Went::goals(1, 2)
    }
}

pub fn by_tournament(game: &Value) -> (String, String) {
    let name = |side: usize| text(&game["sides"][side]["team_name"]);
    (name(0), name(1))
}

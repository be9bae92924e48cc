//! The season's days: who joins and uploads in the morning, the cut and what is played of it in the evening, and the
//! night, in which the server tidies.

use super::stand_in::StandIn;
use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, text};
use faceoff_worker::{start_due, tidy};
use jiff::{SignedDuration, Timestamp, ToSpan, civil::Date, tz::TimeZone};
use reqwest::Method;
use serde_json::{Value, json};
use std::{
    fs,
    time::{Duration, Instant},
};

pub const DAYS: i32 = 90;
const TEAMS: usize = 40;
/// So many are there on the first day; of the others one joins each day.
const FIRST_TEAMS: usize = 30;
const DAYS_PER_SUBMISSION: usize = 10;
/// A tenth of a real stage's; so is the bound of the database.
const EPISODES: u32 = 100;
/// Of two tasks' episodes; a real stage cuts finer, which no row that stays depends on.
const EPISODES_PER_SHARD: u32 = EPISODES;
/// The clocks change on 2026-03-29 there.
const ZONE: &str = "Europe/Berlin";

pub struct SeasonTeam {
    pub team: TestTeam,
    pub name: String,
    /// It takes no part at present: disqualified, retired, or all of its agents withdrawn.
    pub rests: bool,
}

pub struct Season {
    pub site: Site,
    pub teams: Vec<SeasonTeam>,
    pub stand_in: StandIn,
    pub stages: Vec<Value>,
}

/// The first day, of which there is a number of nights to the `day`th.
pub fn date(day: i32) -> Date {
    jiff::civil::date(2026, 3, 1).saturating_add(day.days())
}

/// An instant of that day, by the season's clocks.
pub fn at(day: i32, hour: i8) -> Timestamp {
    let zone = TimeZone::get(ZONE).unwrap();
    date(day)
        .at(hour, 0, 0, 0)
        .to_zoned(zone)
        .unwrap()
        .timestamp()
}

impl Season {
    /// Three stages: two weeks of warm-up, two months whose best day counts, and two weeks that nobody sees the scores
    /// of.
    pub async fn start() -> Self {
        let site = Site::start().await;
        site.turn_to(at(0, 8));
        let mut season = Self {
            site,
            teams: Vec::new(),
            stand_in: StandIn::default(),
            stages: Vec::new(),
        };
        let first = season.site.stage().await;
        let warm_up = season
            .change(
                &first.to_string(),
                json!({
                    "name": "Warm-up", "closes_at": at(14, 12), "zone": ZONE, "schedule": { "daily": "18:00" },
                    "episodes_per_task": EPISODES, "episodes_per_shard": EPISODES_PER_SHARD, "max_faults": 10,
                    "confirm": "Qualifying",
                }),
            )
            .await;
        season.stages.push(warm_up);
        for (name, opens, closes, more) in [
            ("Qualifying", 14, 75, json!({ "standings": "best" })),
            (
                "Final",
                75,
                DAYS,
                json!({ "standings": { "mean_of_last": 5 }, "blind": true }),
            ),
        ] {
            let mut body = json!({
                "name": name, "opens_at": at(opens, 12), "closes_at": at(closes, 12), "zone": ZONE,
                "schedule": { "daily": "18:00" },
            });
            for (key, value) in more.as_object().unwrap() {
                body[key] = value.clone();
            }
            let stage = season.post("/stages", body).await.json(201);
            assert_eq!(stage["episodes_per_task"], EPISODES, "as in the open one");
            season.stages.push(stage);
        }
        season
    }

    pub async fn post(&self, path: &str, body: Value) -> Answer {
        self.site
            .post(&format!("/api/v1{path}"), Some(ADMIN), &body)
            .await
    }

    pub async fn get(&self, path: &str) -> Value {
        let answer = self.site.get(&format!("/api/v1{path}"), Some(ADMIN)).await;
        answer.json(200)
    }

    pub async fn change(&self, stage: &str, body: Value) -> Value {
        let path = format!("/api/v1/stages/{stage}");
        let request = self.site.request(Method::PATCH, &path, Some(ADMIN));
        Answer::of(request.json(&body).send().await.unwrap())
            .await
            .json(200)
    }

    /// The id of the stage that plays on this day.
    pub fn stage_of(&self, day: i32) -> String {
        let index = match day {
            ..14 => 0,
            14..75 => 1,
            _ => 2,
        };
        text(&self.stages[index]["id"])
    }

    /// Who joins does, and who has a new agent uploads it.
    pub async fn morning(&mut self, day: i32) {
        self.site.turn_to(at(day, 10));
        let number = usize::try_from(day).unwrap();
        let there = (FIRST_TEAMS + number).min(TEAMS);
        for index in self.teams.len()..there {
            let name = format!("Team {index}");
            let team = self.site.team(&name).await;
            self.teams.push(SeasonTeam {
                team,
                name,
                rests: false,
            });
            self.upload(index, 0).await;
        }
        for index in 0..there {
            if (number + index) % DAYS_PER_SUBMISSION == 0 && number > 0 && !self.teams[index].rests
            {
                self.upload(index, number).await;
            }
        }
        self.stand_in.check_uploads(&self.site).await;
    }

    pub async fn upload(&self, index: usize, version: usize) -> Value {
        let mut archive = GZIP.to_vec();
        archive.extend(format!("agent {index} of day {version}").bytes());
        let path = format!("/api/v1/submissions?file_name=agent-{index}-{version}.tar.gz");
        let request = self
            .site
            .request(Method::POST, &path, Some(&self.teams[index].team.token))
            .header("content-type", "application/octet-stream");
        Answer::of(request.body(archive).send().await.unwrap())
            .await
            .json(201)
    }

    /// How many teams play a day that starts now.
    pub fn playing(&self) -> usize {
        self.teams.iter().filter(|team| !team.rests).count()
    }

    /// The cut, not a millisecond before its time, and all that is played of it. Returns how many were scored.
    pub async fn evening(&mut self, day: i32) -> usize {
        let stage = self.stage_of(day);
        let shown = self.get(&format!("/stages/{stage}")).await;
        let cut: Timestamp = text(&shown["next_cut"]["at"]).parse().unwrap();
        assert_eq!(
            (cut, &shown["next_cut"]["day"]),
            (at(day, 18), &json!(date(day)))
        );
        self.site.turn_to(cut - SignedDuration::from_millis(1));
        start_due(&self.site.store, self.site.now()).await.unwrap();
        assert_eq!(self.evaluations(day).await.len(), 0, "day {day}");
        if super::organiser::is_down_at_the_cut(day) {
            return 0;
        }
        self.site.turn_to(cut);
        start_due(&self.site.store, cut).await.unwrap();
        let started = self.evaluations(day).await.len();
        assert_eq!(started, self.playing(), "day {day}");
        let before = self.stand_in.scored;
        self.site.later(1);
        let plays = super::organiser::fits(day).unwrap_or(usize::MAX / 2);
        self.stand_in.work(&self.site, plays).await;
        self.stand_in.scored - before
    }

    /// All evaluations of a day that are known to the organiser.
    pub async fn evaluations(&self, day: i32) -> Vec<Value> {
        let all = self.get(&format!("/evaluations?day={}", date(day))).await;
        all.as_array().unwrap().clone()
    }

    /// The server tidies, long after what was played two days ago.
    pub async fn night(&mut self) {
        self.site.later(9 * 3600);
        tidy(&self.site.store, self.site.now()).await;
    }

    /// Of all that SQLite keeps.
    pub fn database_bytes(&self) -> u64 {
        let bytes = |name: &str| {
            fs::metadata(self.site.folder.path().join(name)).map_or(0, |found| found.len())
        };
        bytes("faceoff.sqlite3") + bytes("faceoff.sqlite3-wal")
    }

    /// Each stage's boards, read a second time.
    pub async fn boards(&self) -> Vec<(String, Duration)> {
        let mut boards = Vec::new();
        for stage in &self.stages {
            for task in ["", "/hit"] {
                let path = format!("/api/v1/board{task}?stage={}", text(&stage["id"]));
                let first = self.site.get(&path, None).await.json(200);
                assert_eq!(first["rows"].as_array().unwrap().len(), TEAMS, "{path}");
                let asked = Instant::now();
                self.site.get(&path, None).await.json(200);
                let name = format!("the board{task} of {}", text(&stage["name"]));
                boards.push((name, asked.elapsed()));
            }
        }
        boards
    }
}

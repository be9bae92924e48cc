//! The days of the season: new teams and uploads in the morning, the cutoff and its evaluations in the evening, and the
//! server's clean-up at night.

use super::fake_worker::FakeWorker;
use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, string};
use faceoff_worker::{clean_up, start_due};
use jiff::{SignedDuration, Timestamp, ToSpan, civil::Date, tz::TimeZone};
use reqwest::Method;
use serde_json::{Value, json};
use std::{
    fs,
    time::{Duration, Instant},
};

pub const DAYS: i32 = 90;
const TEAMS: usize = 20;
/// The number of teams on the first day. Of the others, one joins each day.
const FIRST_TEAMS: usize = 12;
const DAYS_PER_SUBMISSION: usize = 10;
/// A tenth of a real stage's. The bound of the database is scaled by that, and by the number of teams (here 20, there 40).
const EPISODES: u32 = 100;
/// One shard per task. A real stage has smaller shards, but the rows that stay do not depend on that.
const EPISODES_PER_SHARD: u32 = EPISODES;
/// A time zone with a change to summer time on 2026-03-29.
const ZONE: &str = "Europe/Berlin";

pub struct SeasonTeam {
    pub team: TestTeam,
    pub name: String,
    /// The team has no evaluations at present: it is disqualified or retired, or all its submissions are withdrawn.
    pub is_inactive: bool,
}

pub struct Season {
    pub site: Site,
    pub teams: Vec<SeasonTeam>,
    pub worker: FakeWorker,
    pub stages: Vec<Value>,
}

/// The date of a day, counted from 0.
pub fn date(day: i32) -> Date {
    jiff::civil::date(2026, 3, 1).saturating_add(day.days())
}

/// The time at this hour of a day, in the season's time zone.
pub fn at(day: i32, hour: i8) -> Timestamp {
    let zone = TimeZone::get(ZONE).unwrap();
    date(day)
        .at(hour, 0, 0, 0)
        .to_zoned(zone)
        .unwrap()
        .timestamp()
}

impl Season {
    /// Three stages: two weeks of warm-up, two months whose best day counts, and two blind weeks.
    pub async fn start() -> Self {
        let site = Site::start().await;
        site.set_time(at(0, 8));
        let mut season = Self {
            site,
            teams: Vec::new(),
            worker: FakeWorker::default(),
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

    /// The id of the stage that is open on this day.
    pub fn stage_of(&self, day: i32) -> String {
        let index = match day {
            ..14 => 0,
            14..75 => 1,
            _ => 2,
        };
        string(&self.stages[index]["id"])
    }

    /// Adds the new teams of the day, and uploads new submissions.
    pub async fn morning(&mut self, day: i32) {
        self.site.set_time(at(day, 10));
        let number = usize::try_from(day).unwrap();
        let team_count = (FIRST_TEAMS + number).min(TEAMS);
        for index in self.teams.len()..team_count {
            let name = format!("Team {index}");
            let team = self.site.team(&name).await;
            self.teams.push(SeasonTeam {
                team,
                name,
                is_inactive: false,
            });
            self.upload(index, 0).await;
        }
        for index in 0..team_count {
            if (number + index) % DAYS_PER_SUBMISSION == 0
                && number > 0
                && !self.teams[index].is_inactive
            {
                self.upload(index, number).await;
            }
        }
        self.worker.perform_validations(&self.site).await;
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

    /// The number of teams with an evaluation on a day that starts now.
    pub fn active_teams(&self) -> usize {
        self.teams.iter().filter(|team| !team.is_inactive).count()
    }

    /// The cutoff, not a millisecond before its time, and the evaluations of the day. Returns the number of scored ones.
    pub async fn evening(&mut self, day: i32) -> usize {
        let stage = self.stage_of(day);
        let shown = self.get(&format!("/stages/{stage}")).await;
        let cutoff: Timestamp = string(&shown["next_cutoff"]["at"]).parse().unwrap();
        assert_eq!(
            (cutoff, &shown["next_cutoff"]["day"]),
            (at(day, 18), &json!(date(day)))
        );
        self.site.set_time(cutoff - SignedDuration::from_millis(1));
        start_due(&self.site.store, self.site.now()).await.unwrap();
        assert_eq!(self.evaluations(day).await.len(), 0, "day {day}");
        if super::organiser_actions::is_down_at_cutoff(day) {
            return 0;
        }
        self.site.set_time(cutoff);
        start_due(&self.site.store, cutoff).await.unwrap();
        let started = self.evaluations(day).await.len();
        assert_eq!(started, self.active_teams(), "day {day}");
        let before = self.worker.scored;
        self.site.advance(1);
        let evaluations =
            super::organiser_actions::finished_evaluations(day).unwrap_or(usize::MAX / 2);
        self.worker.work(&self.site, evaluations).await;
        self.worker.scored - before
    }

    /// All evaluations of a day, as the organiser sees them.
    pub async fn evaluations(&self, day: i32) -> Vec<Value> {
        let all = self.get(&format!("/evaluations?day={}", date(day))).await;
        all.as_array().unwrap().clone()
    }

    /// The server's clean-up.
    pub async fn night(&mut self) {
        self.site.advance(9 * 3600);
        clean_up(&self.site.store, self.site.now()).await;
    }

    /// The size of the SQLite files, in bytes.
    pub fn database_bytes(&self) -> u64 {
        let bytes = |name: &str| {
            fs::metadata(self.site.folder.path().join(name)).map_or(0, |found| found.len())
        };
        bytes("faceoff.sqlite3") + bytes("faceoff.sqlite3-wal")
    }

    /// Loads the boards of each stage twice. Returns the duration of the second request.
    pub async fn boards(&self) -> Vec<(String, Duration)> {
        let mut boards = Vec::new();
        for stage in &self.stages {
            for task in ["", "/hit"] {
                let path = format!("/api/v1/board{task}?stage={}", string(&stage["id"]));
                let first = self.site.get(&path, None).await.json(200);
                assert_eq!(first["rows"].as_array().unwrap().len(), TEAMS, "{path}");
                let started = Instant::now();
                self.site.get(&path, None).await.json(200);
                let name = format!("the board{task} of {}", string(&stage["name"]));
                boards.push((name, started.elapsed()));
            }
        }
        boards
    }
}

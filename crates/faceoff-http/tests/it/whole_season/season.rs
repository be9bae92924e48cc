//! The days of the tested season: new teams and uploads in the morning; the cutoff (the moment at which each team's active
//! submission is fixed) and its evaluations in the evening; and the server's clean-up at night.

use super::fake_worker::FakeWorker;
use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, string};
use faceoff_worker::{clean_up, update_due_days};
use jiff::{SignedDuration, Timestamp, ToSpan, civil::Date, tz::TimeZone};
use reqwest::Method;
use serde_json::{Value, json};
use std::{
    fs,
    time::{Duration, Instant},
};

pub const DAYS: i32 = 90;
/// A limit of evaluations that is never reached.
pub const ALL_EVALUATIONS: usize = usize::MAX / 2;
const TEAMS: usize = 20;
/// The number of teams on the first day. Of the others, one joins each day.
const FIRST_TEAMS: usize = 12;
const DAYS_PER_SUBMISSION: usize = 10;
/// Episodes per task: a tenth of a real stage's. The bound of the database's size is scaled by that, and by the number of
/// teams: here 20, in a real season 40.
const EPISODES: u32 = 100;
/// One shard (the episodes of a task that one job runs) per task. A real stage has smaller shards, but the rows that stay in the
/// database do not depend on that.
const EPISODES_PER_SHARD: u32 = EPISODES;
/// A time zone with a change to summer time on 2026-03-29.
const ZONE: &str = "Europe/Berlin";

pub struct SeasonTeam {
    pub team: TestTeam,
    pub name: String,
    /// Whether the team has no evaluations at present, because it is disqualified, or all its submissions are withdrawn.
    pub is_inactive: bool,
}

pub struct Season {
    pub site: Site,
    pub teams: Vec<SeasonTeam>,
    pub worker: FakeWorker,
    /// The stages as the API returned them at their creation.
    pub stages: Vec<Value>,
}

/// The date of a day, counted from 0.
pub fn date(day: i32) -> Date {
    jiff::civil::date(2026, 3, 1).saturating_add(day.days())
}

/// The time at this hour of a day, in the season's time zone.
pub fn local_time(day: i32, hour: i8) -> Timestamp {
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
        site.set_time(local_time(0, 8));
        let mut season = Self {
            site,
            teams: Vec::new(),
            worker: FakeWorker::default(),
            stages: Vec::new(),
        };
        let first_stage = season.site.stage().await;
        let warm_up = season
            .change_stage(
                &first_stage.to_string(),
                json!({
                    "name": "Warm-up", "closes_at": local_time(14, 12), "zone": ZONE, "schedule": { "daily": "18:00" },
                    "episodes_per_task": EPISODES, "episodes_per_shard": EPISODES_PER_SHARD, "max_faults": 10,
                    "confirm": "Qualifying",
                }),
            )
            .await;
        season.stages.push(warm_up);
        for (name, opening_day, closing_day, settings) in [
            ("Qualifying", 14, 75, json!({ "standings": "best" })),
            (
                "Final",
                75,
                DAYS,
                json!({ "standings": { "mean_of_last": 5 }, "blind": true }),
            ),
        ] {
            let mut body = json!({
                "name": name, "opens_at": local_time(opening_day, 12), "closes_at": local_time(closing_day, 12), "zone": ZONE,
                "schedule": { "daily": "18:00" },
            });
            for (key, value) in settings.as_object().unwrap() {
                body[key] = value.clone();
            }
            let stage = season.post("/stages", body).await.json(201);
            assert_eq!(
                stage["episodes_per_task"], EPISODES,
                "copied from the open stage"
            );
            season.stages.push(stage);
        }
        season
    }

    /// Posts as an organiser.
    pub async fn post(&self, path: &str, body: Value) -> Answer {
        self.site
            .post(&format!("/api/v1{path}"), Some(ADMIN), &body)
            .await
    }

    /// Reads a resource as an organiser.
    pub async fn get(&self, path: &str) -> Value {
        let answer = self.site.get(&format!("/api/v1{path}"), Some(ADMIN)).await;
        answer.json(200)
    }

    /// Changes a stage as an organiser.
    pub async fn change_stage(&self, stage: &str, body: Value) -> Value {
        self.site.change_stage(stage, body).await.json(200)
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
    pub async fn add_teams_and_submissions(&mut self, day: i32) {
        self.site.set_time(local_time(day, 10));
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

    /// Uploads a submission of the team with this index. Each version has another bundle.
    pub async fn upload(&self, index: usize, version: usize) -> Value {
        let mut bundle = GZIP.to_vec();
        bundle.extend(format!("agent {index} of day {version}").bytes());
        let path = format!("/api/v1/submissions?file_name=agent-{index}-{version}.tar.gz");
        let request = self
            .site
            .request(Method::POST, &path, Some(&self.teams[index].team.token))
            .header("content-type", "application/octet-stream");
        Answer::read(request.body(bundle).send().await.unwrap())
            .await
            .json(201)
    }

    /// The number of teams with an evaluation on a day that starts now.
    pub fn active_teams(&self) -> usize {
        self.teams.iter().filter(|team| !team.is_inactive).count()
    }

    /// Checks that the day starts at its cutoff and not a millisecond before, and runs its evaluations. Returns the number of
    /// scored evaluations.
    pub async fn run_evaluations(&mut self, day: i32) -> usize {
        let stage = self.stage_of(day);
        let view = self.get(&format!("/stages/{stage}")).await;
        let cutoff: Timestamp = string(&view["next_cutoff"]["at"]).parse().unwrap();
        assert_eq!(
            (cutoff, &view["next_cutoff"]["day"]),
            (local_time(day, 18), &json!(date(day)))
        );
        self.site.set_time(cutoff - SignedDuration::from_millis(1));
        update_due_days(
            &self.site.store,
            faceoff_airhockey::simulator().competition(),
            self.site.now(),
        )
        .await
        .unwrap();
        assert_eq!(self.evaluations(day).await.len(), 0, "day {day}");
        if super::organiser_actions::is_down_at_cutoff(day) {
            return 0;
        }
        self.site.set_time(cutoff);
        update_due_days(&self.site.store, &faceoff_airhockey::competition(), cutoff)
            .await
            .unwrap();
        let started = self.evaluations(day).await.len();
        assert_eq!(started, self.active_teams(), "day {day}");
        let scored_before = self.worker.scored;
        self.site.advance(1);
        let max_evaluations =
            super::organiser_actions::finished_evaluations(day).unwrap_or(ALL_EVALUATIONS);
        self.worker.work(&self.site, max_evaluations).await;
        self.worker.scored - scored_before
    }

    /// All evaluations of a day, as the organiser sees them.
    pub async fn evaluations(&self, day: i32) -> Vec<Value> {
        let evaluations = self.get(&format!("/evaluations?day={}", date(day))).await;
        evaluations.as_array().unwrap().clone()
    }

    /// The server's clean-up.
    pub async fn run_clean_up(&mut self) {
        self.site.advance(9 * 3600);
        clean_up(
            &self.site.store,
            faceoff_airhockey::simulator().competition(),
            &self.site.clock(),
        )
        .await;
    }

    /// The size of the SQLite files, in bytes.
    pub fn database_bytes(&self) -> u64 {
        let bytes = |name: &str| {
            fs::metadata(self.site.folder.path().join(name)).map_or(0, |found| found.len())
        };
        bytes("faceoff.sqlite3") + bytes("faceoff.sqlite3-wal")
    }

    /// Requests the boards of each stage twice. Returns their descriptions and the durations of the second requests.
    pub async fn time_boards(&self) -> Vec<(String, Duration)> {
        let mut durations = Vec::new();
        for stage in &self.stages {
            for task in ["", "/hit"] {
                let path = format!("/api/v1/board{task}?stage={}", string(&stage["id"]));
                let first = self.site.get(&path, None).await.json(200);
                assert_eq!(first["rows"].as_array().unwrap().len(), TEAMS, "{path}");
                let started_at = Instant::now();
                self.site.get(&path, None).await.json(200);
                let name = format!("the board{task} of {}", string(&stage["name"]));
                durations.push((name, started_at.elapsed()));
            }
        }
        durations
    }
}

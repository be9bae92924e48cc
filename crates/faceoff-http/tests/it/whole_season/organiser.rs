//! What the organiser and teams do on single days, and what the boards have to show of it.

use super::season::{DAYS, Season, at, date};
use crate::site::{ADMIN, Answer, text};
use faceoff_worker::start_due;
use reqwest::Method;
use serde_json::{Value, json};

const RETAINED: i32 = 18;
const VOIDED_EVALUATION: i32 = 20;
const VOIDED_DAY: i32 = 25;
const DISQUALIFIED: i32 = 30;
const REINSTATED: i32 = 37;
const OVERFLOWS: i32 = 40;
const FROZEN: i32 = 45;
const UNFROZEN: i32 = 48;
const OTHER_RULES: i32 = 52;
const DOWN: i32 = 60;
const EXTRA_TURN: i32 = 66;
const RETIRED: i32 = 80;

/// The server is down at this day's cut, and all evening.
pub fn is_down_at_the_cut(day: i32) -> bool {
    day == DOWN
}

/// How many evaluations of a day are played before its deadline, if not all.
pub fn fits(day: i32) -> Option<usize> {
    (day == OVERFLOWS).then_some(25)
}

fn reason(why: &str) -> Value {
    json!({ "reason": why })
}

impl Season {
    /// What is done before this day's cut.
    pub async fn organise(&mut self, day: i32) {
        match day {
            3 => self.rename().await,
            10 => self.withdraw().await,
            12 => self.pause().await,
            RETAINED => self.keep_the_last_five().await,
            _ if day == VOIDED_EVALUATION + 1 => self.void_evaluation().await,
            _ if day == VOIDED_DAY + 1 => self.void_day().await,
            DISQUALIFIED => self.disqualify().await,
            REINSTATED => self.reinstate().await,
            _ if day == OVERFLOWS + 1 => self.after_the_deadline().await,
            FROZEN => self.freeze().await,
            UNFROZEN => self.unfreeze().await,
            OTHER_RULES => self.other_rules().await,
            _ if day == DOWN + 1 => self.make_up_for_the_missed_day().await,
            EXTRA_TURN => self.give_an_extra_turn().await,
            RETIRED => self.retire_and_return().await,
            _ => {}
        }
    }

    /// The names on a stage's board, as everybody sees it.
    async fn board(&self, day: i32) -> Value {
        let path = format!("/api/v1/board?stage={}", self.stage_of(day));
        self.site.get(&path, None).await.json(200)
    }

    async fn on_board(&self, day: i32) -> Vec<String> {
        let board = self.board(day).await;
        let rows = board["rows"].as_array().unwrap();
        rows.iter().map(|row| text(&row["team"])).collect()
    }

    async fn rename(&mut self) {
        let team = &mut self.teams[2];
        let path = format!("/api/v1/teams/{}", team.team.id);
        let request = self.site.request(Method::PATCH, &path, Some(ADMIN));
        let body = json!({ "name": "The Mallets" });
        let renamed = Answer::of(request.json(&body).send().await.unwrap()).await;
        assert_eq!(renamed.json(200)["name"], "The Mallets");
        team.name = "The Mallets".into();
        let names = self.on_board(3).await;
        assert!(names.contains(&"The Mallets".to_owned()), "{names:?}");
        assert!(!names.contains(&"Team 2".to_owned()), "{names:?}");
    }

    /// Without an agent a team does not play; with the next upload it does.
    async fn withdraw(&mut self) {
        let token = self.teams[4].team.token.clone();
        let own = self.site.get("/api/v1/submissions", Some(&token)).await;
        for submission in own.json(200).as_array().unwrap() {
            let path = format!("/api/v1/submissions/{}/withdraw", text(&submission["id"]));
            self.site
                .post(&path, Some(&token), &json!({}))
                .await
                .json(200);
        }
        self.teams[4].rests = true;
    }

    async fn pause(&mut self) {
        self.upload(4, 12).await;
        self.teams[4].rests = false;
        let paused = self.post("/queue/pause", reason("a fan is changed")).await;
        assert_eq!(paused.status, 204, "{}", paused.body);
        let before = self.stand_in.scored;
        self.stand_in.work(&self.site, 1).await;
        let me = self
            .site
            .get("/api/v1/me", Some(&self.teams[4].team.token))
            .await;
        assert_eq!(before, self.stand_in.scored);
        assert_eq!(
            me.json(200)["active_submission"],
            json!(null),
            "nothing is begun"
        );
        let resumed = self.post("/queue/resume", json!({})).await;
        assert_eq!(resumed.status, 204, "{}", resumed.body);
        self.stand_in.work(&self.site, 1).await;
    }

    async fn keep_the_last_five(&mut self) {
        let stage = self.stage_of(RETAINED);
        let changed = self
            .change(&stage, json!({ "retention": { "last": 5 } }))
            .await;
        assert_eq!(changed["retention"], json!({ "last": 5 }));
        assert_eq!(changed["revision"], 1, "no score depends on it");
    }

    async fn void_evaluation(&mut self) {
        let of_day = self.evaluations(VOIDED_EVALUATION).await;
        let (id, name) = (text(&of_day[0]["id"]), text(&of_day[0]["team_name"]));
        let void = format!("/evaluations/{id}/void");
        let unconfirmed = self.post(&void, reason("the table was tilted")).await;
        unconfirmed.problem(409, "not-confirmed", &[&name]);
        let confirmed = json!({ "reason": "the table was tilted", "confirm": name });
        self.post(&void, confirmed).await.json(200);
        let again = self
            .post(&format!("/evaluations/{id}/rerun"), json!({}))
            .await;
        assert_eq!(again.json(201)["rerun_of"], json!(id));
        self.stand_in.work(&self.site, 1).await;
        let of_day = self.evaluations(VOIDED_EVALUATION).await;
        let counting = of_day.iter().filter(|one| one["voided"].is_null());
        assert_eq!(counting.count(), self.playing());
    }

    async fn void_day(&mut self) {
        let path = format!(
            "/stages/{}/days/{}/void",
            self.stage_of(VOIDED_DAY),
            date(VOIDED_DAY)
        );
        let day = date(VOIDED_DAY).to_string();
        let body = json!({ "reason": "a wrong puck", "confirm": day });
        self.post(&path, body).await.json(200);
        let of_day = self.evaluations(VOIDED_DAY).await;
        assert!(
            of_day
                .iter()
                .all(|one| one["voided"]["reason"] == "a wrong puck")
        );
        let board = self.board(VOIDED_DAY).await;
        let rows = board["rows"].as_array().unwrap();
        assert!(rows.iter().all(|row| row["day"] != json!(day)), "{board}");
    }

    async fn disqualify(&mut self) {
        let (id, name) = (self.teams[7].team.id.clone(), self.teams[7].name.clone());
        let body = json!({ "reason": "it read the table", "confirm": name });
        self.post(&format!("/teams/{id}/disqualify"), body)
            .await
            .json(200);
        self.teams[7].rests = true;
        let names = self.on_board(DISQUALIFIED).await;
        assert_eq!(names.len(), self.playing());
        assert!(!names.contains(&name), "{names:?}");
    }

    async fn reinstate(&mut self) {
        let id = self.teams[7].team.id.clone();
        let why = reason("it did not");
        self.post(&format!("/teams/{id}/reinstate"), why)
            .await
            .json(200);
        self.teams[7].rests = false;
        assert!(
            self.on_board(REINSTATED)
                .await
                .contains(&self.teams[7].name)
        );
    }

    /// The day before was not played to its end when the next cut came; that was our capacity, and takes no row away.
    async fn after_the_deadline(&mut self) {
        let day = OVERFLOWS;
        let states = async |season: &Self| {
            let of_day = season.evaluations(day).await;
            let of = |state: &str| of_day.iter().filter(|one| one["state"] == state).count();
            (of("finished"), of("not_played"), of_day.len())
        };
        let (finished, not_played, all) = states(self).await;
        assert_eq!(
            (finished, not_played),
            (25, 0),
            "it may go on until the next cut"
        );
        self.site
            .turn_to(at(day + 1, 18) - jiff::SignedDuration::from_millis(1));
        start_due(&self.site.store, self.site.now()).await.unwrap();
        assert_eq!(states(self).await, (25, 0, all));
        // The evening's cut ends it: this looks ahead by one, as the evening would.
        self.site.turn_to(at(day + 1, 10));
        assert_eq!(self.on_board(day).await.len(), self.playing());
    }

    async fn freeze(&mut self) {
        let stage = self.stage_of(FROZEN);
        let why = reason("the last days are a surprise");
        self.post(&format!("/stages/{stage}/freeze"), why)
            .await
            .json(200);
        let overdue = self.evaluations(OVERFLOWS).await;
        let not_played = overdue.iter().filter(|one| one["state"] == "not_played");
        assert_eq!(not_played.count(), overdue.len() - 25);
    }

    async fn unfreeze(&mut self) {
        let frozen = self.board(UNFROZEN).await;
        let stage = self.stage_of(UNFROZEN);
        let newest = |board: &Value| {
            let rows = board["rows"].as_array().unwrap().clone();
            rows.iter().map(|row| text(&row["day"])).max().unwrap()
        };
        assert!(newest(&frozen) < date(FROZEN).to_string(), "{frozen}");
        self.post(&format!("/stages/{stage}/unfreeze"), json!({}))
            .await
            .json(200);
    }

    /// Results by other rules are on another board.
    async fn other_rules(&mut self) {
        let stage = self.stage_of(OTHER_RULES);
        let changed = self
            .change(&stage, json!({ "max_faults": 5, "confirm": "Qualifying" }))
            .await;
        assert_eq!(changed["revision"], 2, "{changed}");
        assert_eq!(
            self.on_board(OTHER_RULES).await.len(),
            self.playing(),
            "the one before"
        );
    }

    async fn make_up_for_the_missed_day(&mut self) {
        let stage = self.stage_of(DOWN);
        assert_eq!(self.evaluations(DOWN).await.len(), 0);
        let body = json!({ "day": date(DOWN), "reason": "power failure" });
        let day = self
            .post(&format!("/stages/{stage}/days"), body)
            .await
            .json(200);
        assert_eq!(day["created"].as_array().unwrap().len(), self.playing());
        self.stand_in.work(&self.site, usize::MAX / 2).await;
    }

    async fn give_an_extra_turn(&mut self) {
        let (stage, day) = (self.stage_of(EXTRA_TURN), date(EXTRA_TURN - 1));
        let path = format!("/stages/{stage}/days/{day}/extra-turn");
        let team = &self.teams[9];
        let mut body = json!({ "team": team.team.id, "reason": "its cable was cut" });
        self.post(&path, body.clone())
            .await
            .problem(409, "not-confirmed", &[&team.name]);
        body["confirm"] = json!(team.name);
        self.post(&path, body).await.json(201);
        self.stand_in.work(&self.site, 1).await;
    }

    async fn retire_and_return(&mut self) {
        let (id, name) = (self.teams[11].team.id.clone(), self.teams[11].name.clone());
        self.post(&format!("/teams/{id}/retire"), json!({ "confirm": name }))
            .await
            .json(200);
        self.post(&format!("/teams/{id}/return"), json!({}))
            .await
            .json(200);
    }

    /// Of the first days, whose results stay, the datasets have gone.
    async fn what_is_kept(&self) {
        let days = [RETAINED, DAYS - 1].map(async |day| {
            let mut kept = 0;
            for one in self.evaluations(day).await {
                let path = format!("/api/v1/evaluations/{}/dataset", text(&one["id"]));
                let answer = self.site.get(&path, Some(ADMIN)).await;
                match answer.status.as_u16() {
                    200 => kept += 1,
                    _ => drop(answer.problem(410, "removed", &["the last 5 and the best"])),
                }
            }
            kept
        });
        let [first, last] = days;
        let (first, last) = (first.await, last.await);
        let best_of_theirs = self.playing() / 4;
        assert!(first < best_of_theirs, "{first} of day {RETAINED} are kept");
        assert_eq!(last, self.playing(), "of another stage");
    }

    /// After the last day: what was hidden is opened, each stage is signed off, and the season is closed.
    pub async fn sign_off(&mut self) {
        self.site.turn_to(at(DAYS + 1, 12));
        start_due(&self.site.store, self.site.now()).await.unwrap();
        let last = self.stage_of(DAYS - 1);
        let hidden = self.board(DAYS - 1).await;
        assert_eq!(
            (&hidden["blind"], &hidden["rows"]),
            (&json!(true), &json!([]))
        );
        let opened = self
            .change(&last, json!({ "blind": false, "confirm": "Final" }))
            .await;
        assert_eq!(opened["blind"], false);
        self.what_is_kept().await;
        for stage in self.stages.clone() {
            let path = format!("/stages/{}/finalise", text(&stage["id"]));
            let signed = self.post(&path, json!({ "confirm": stage["name"] })).await;
            assert_ne!(signed.json(200)["finalised"], json!(null));
        }
        self.post("/season/close", json!({ "confirm": "Test season" }))
            .await
            .json(200);
    }
}

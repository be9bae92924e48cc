//! Actions of the organiser and of teams on single days of the season, with checks of their effects.

use super::season::{ALL_EVALUATIONS, DAYS, Season, date, local_time};
use crate::site::{ADMIN, string};
use faceoff_worker::update_due_days;
use serde_json::{Value, json};

// The days of the actions, counted from 0. What is done about the evaluations of a day is done on the morning after it.
const RENAMING: i32 = 3;
const WITHDRAWAL: i32 = 10;
const PAUSE: i32 = 12;
const RETENTION_SET: i32 = 18;
const VOIDED_EVALUATION: i32 = 20;
const VOIDED_DAY: i32 = 25;
const DISQUALIFICATION: i32 = 30;
const REINSTATEMENT: i32 = 37;
const OVERFULL_DAY: i32 = 40;
/// How many evaluations of the overfull day finish before its deadline.
const FINISHED_BEFORE_DEADLINE: usize = 12;
const FREEZE: i32 = 45;
const UNFREEZE: i32 = 48;
const RULE_CHANGE: i32 = 52;
const OUTAGE: i32 = 60;
const EXTRA_EVALUATION: i32 = 66;
const RETIREMENT: i32 = 80;

/// Is the server down at the cutoff of this day, and for the whole evening? Then the day is missed.
pub fn is_down_at_cutoff(day: i32) -> bool {
    day == OUTAGE
}

/// The number of evaluations that finish before the deadline of the day; `None` if all do.
pub fn finished_evaluations(day: i32) -> Option<usize> {
    (day == OVERFULL_DAY).then_some(FINISHED_BEFORE_DEADLINE)
}

/// The body of a request with a reason.
fn reason(text: &str) -> Value {
    json!({ "reason": text })
}

impl Season {
    /// Takes the actions of this day, before its cutoff.
    pub async fn perform_actions(&mut self, day: i32) {
        match day {
            RENAMING => self.rename().await,
            WITHDRAWAL => self.withdraw().await,
            PAUSE => self.pause().await,
            RETENTION_SET => self.retain_last_five().await,
            _ if day == VOIDED_EVALUATION + 1 => self.void_evaluation().await,
            _ if day == VOIDED_DAY + 1 => self.void_day().await,
            DISQUALIFICATION => self.disqualify().await,
            REINSTATEMENT => self.reinstate().await,
            _ if day == OVERFULL_DAY + 1 => self.check_overfull_day().await,
            FREEZE => self.freeze().await,
            UNFREEZE => self.unfreeze().await,
            RULE_CHANGE => self.change_rules().await,
            _ if day == OUTAGE + 1 => self.evaluate_missed_day().await,
            EXTRA_EVALUATION => self.start_extra_evaluation().await,
            RETIREMENT => self.retire_and_return().await,
            _ => {}
        }
    }

    /// The public board of the stage of a day.
    async fn board(&self, day: i32) -> Value {
        let path = format!("/api/v1/board?stage={}", self.stage_of(day));
        self.site.get(&path, None).await.json(200)
    }

    async fn teams_on_board(&self, day: i32) -> Vec<String> {
        let board = self.board(day).await;
        let rows = board["rows"].as_array().unwrap();
        rows.iter().map(|row| string(&row["team"])).collect()
    }

    async fn rename(&mut self) {
        let team = &mut self.teams[2];
        let path = format!("/api/v1/teams/{}", team.team.id);
        let body = json!({ "name": "The Mallets" });
        let renamed = self.site.patch(&path, Some(ADMIN), &body).await;
        assert_eq!(renamed.json(200)["name"], "The Mallets");
        team.name = "The Mallets".into();
        let names = self.teams_on_board(RENAMING).await;
        assert!(names.contains(&"The Mallets".to_owned()), "{names:?}");
        assert!(!names.contains(&"Team 2".to_owned()), "{names:?}");
    }

    /// Withdraws all submissions of a team, which then has no evaluations before its next upload.
    async fn withdraw(&mut self) {
        let token = self.teams[4].team.token.clone();
        let submissions = self.site.get("/api/v1/submissions", Some(&token)).await;
        for submission in submissions.json(200).as_array().unwrap() {
            let path = format!("/api/v1/submissions/{}/withdraw", string(&submission["id"]));
            self.site
                .post(&path, Some(&token), &json!({}))
                .await
                .json(200);
        }
        self.teams[4].is_inactive = true;
    }

    /// Pauses the queue, checks that no job starts, and resumes it. The new submission of team 4 is the waiting job.
    async fn pause(&mut self) {
        self.upload(4, PAUSE as usize).await;
        self.teams[4].is_inactive = false;
        let paused = self.post("/queue/pause", reason("a fan is changed")).await;
        assert_eq!(paused.status, 204, "{}", paused.body);
        let scored_before = self.worker.scored;
        self.worker.work(&self.site, 1).await;
        let me = self
            .site
            .get("/api/v1/me", Some(&self.teams[4].team.token))
            .await;
        assert_eq!(scored_before, self.worker.scored);
        assert_eq!(
            me.json(200)["active_submission"],
            json!(null),
            "no job is started"
        );
        let resumed = self.post("/queue/resume", json!({})).await;
        assert_eq!(resumed.status, 204, "{}", resumed.body);
        self.worker.work(&self.site, 1).await;
    }

    async fn retain_last_five(&mut self) {
        let stage = self.stage_of(RETENTION_SET);
        let changed = self
            .change_stage(&stage, json!({ "retention": { "last": 5 } }))
            .await;
        assert_eq!(changed["retention"], json!({ "last": 5 }));
        assert_eq!(changed["revision"], 1, "retention is not a rule");
    }

    async fn void_evaluation(&mut self) {
        let evaluations = self.evaluations(VOIDED_EVALUATION).await;
        let (id, name) = (
            string(&evaluations[0]["id"]),
            string(&evaluations[0]["team_name"]),
        );
        let void = format!("/evaluations/{id}/void");
        let unconfirmed = self.post(&void, reason("the table was tilted")).await;
        unconfirmed.problem(409, "not-confirmed", &[&name]);
        let confirmed = json!({ "reason": "the table was tilted", "confirm": name });
        self.post(&void, confirmed).await.json(200);
        let rerun = self
            .post(&format!("/evaluations/{id}/rerun"), json!({}))
            .await;
        assert_eq!(rerun.json(201)["rerun_of"], json!(id));
        self.worker.work(&self.site, 1).await;
        let evaluations = self.evaluations(VOIDED_EVALUATION).await;
        let not_voided = evaluations
            .iter()
            .filter(|evaluation| evaluation["voided"].is_null());
        assert_eq!(not_voided.count(), self.active_teams());
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
        let evaluations = self.evaluations(VOIDED_DAY).await;
        assert!(
            evaluations
                .iter()
                .all(|evaluation| evaluation["voided"]["reason"] == "a wrong puck")
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
        self.teams[7].is_inactive = true;
        let names = self.teams_on_board(DISQUALIFICATION).await;
        assert_eq!(names.len(), self.active_teams());
        assert!(!names.contains(&name), "{names:?}");
    }

    async fn reinstate(&mut self) {
        let id = self.teams[7].team.id.clone();
        self.post(&format!("/teams/{id}/reinstate"), reason("it did not"))
            .await
            .json(200);
        self.teams[7].is_inactive = false;
        assert!(
            self.teams_on_board(REINSTATEMENT)
                .await
                .contains(&self.teams[7].name)
        );
    }

    /// Checks the overfull day on the morning after it: it stays open until the next cutoff, and the board keeps all its rows.
    async fn check_overfull_day(&mut self) {
        let day = OVERFULL_DAY;
        // The numbers of finished evaluations, of those that were not played, and of all.
        let states = async |season: &Self| {
            let evaluations = season.evaluations(day).await;
            let count = |state: &str| {
                evaluations
                    .iter()
                    .filter(|evaluation| evaluation["state"] == state)
                    .count()
            };
            (count("finished"), count("not_played"), evaluations.len())
        };
        let (finished, not_played, all) = states(self).await;
        assert_eq!(
            (finished, not_played),
            (FINISHED_BEFORE_DEADLINE, 0),
            "the day may continue until the next cutoff"
        );
        self.site
            .set_time(local_time(day + 1, 18) - jiff::SignedDuration::from_millis(1));
        update_due_days(
            &self.site.store,
            &faceoff_airhockey::competition(),
            self.site.now(),
        )
        .await
        .unwrap();
        assert_eq!(states(self).await, (FINISHED_BEFORE_DEADLINE, 0, all));
        // A millisecond before the cutoff nothing has changed. The clock goes back to the morning.
        self.site.set_time(local_time(day + 1, 10));
        assert_eq!(self.teams_on_board(day).await.len(), self.active_teams());
    }

    async fn freeze(&mut self) {
        let stage = self.stage_of(FREEZE);
        let body = reason("the last days are a surprise");
        self.post(&format!("/stages/{stage}/freeze"), body)
            .await
            .json(200);
        // The overfull day ended at its deadline, the next cutoff. Its other evaluations were not played.
        let evaluations = self.evaluations(OVERFULL_DAY).await;
        let not_played = evaluations
            .iter()
            .filter(|evaluation| evaluation["state"] == "not_played");
        assert_eq!(
            not_played.count(),
            evaluations.len() - FINISHED_BEFORE_DEADLINE
        );
    }

    async fn unfreeze(&mut self) {
        let frozen = self.board(UNFREEZE).await;
        let stage = self.stage_of(UNFREEZE);
        let newest_day = |board: &Value| {
            let rows = board["rows"].as_array().unwrap().clone();
            rows.iter().map(|row| string(&row["day"])).max().unwrap()
        };
        assert!(newest_day(&frozen) < date(FREEZE).to_string(), "{frozen}");
        self.post(&format!("/stages/{stage}/unfreeze"), json!({}))
            .await
            .json(200);
    }

    /// Changes the rules. Results by the new rules will be on another board.
    async fn change_rules(&mut self) {
        let stage = self.stage_of(RULE_CHANGE);
        let changed = self
            .change_stage(&stage, json!({ "max_faults": 5, "confirm": "Qualifying" }))
            .await;
        assert_eq!(changed["revision"], 2, "{changed}");
        assert_eq!(
            self.teams_on_board(RULE_CHANGE).await.len(),
            self.active_teams(),
            "the board of the old rules"
        );
    }

    async fn evaluate_missed_day(&mut self) {
        let stage = self.stage_of(OUTAGE);
        assert_eq!(self.evaluations(OUTAGE).await.len(), 0);
        let body = json!({ "day": date(OUTAGE), "reason": "power failure" });
        let day = self
            .post(&format!("/stages/{stage}/days"), body)
            .await
            .json(200);
        assert_eq!(
            day["created"].as_array().unwrap().len(),
            self.active_teams()
        );
        self.worker.work(&self.site, ALL_EVALUATIONS).await;
    }

    async fn start_extra_evaluation(&mut self) {
        let (stage, day) = (self.stage_of(EXTRA_EVALUATION), date(EXTRA_EVALUATION - 1));
        let path = format!("/stages/{stage}/days/{day}/extra-evaluation");
        let team = &self.teams[9];
        let mut body = json!({ "team": team.team.id, "reason": "its cable was cut" });
        self.post(&path, body.clone())
            .await
            .problem(409, "not-confirmed", &[&team.name]);
        body["confirm"] = json!(team.name);
        self.post(&path, body).await.json(201);
        self.worker.work(&self.site, 1).await;
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

    /// Checks that most datasets of an early day are removed: each team keeps those of its last five days and of its best one.
    async fn check_retention(&self) {
        let days = [RETENTION_SET, DAYS - 1].map(async |day| {
            let mut retained = 0;
            for evaluation in self.evaluations(day).await {
                let path = format!("/api/v1/evaluations/{}/dataset", string(&evaluation["id"]));
                let answer = self.site.get(&path, Some(ADMIN)).await;
                match answer.status.as_u16() {
                    200 => retained += 1,
                    _ => drop(answer.problem(410, "removed", &["the last 5 and the best"])),
                }
            }
            retained
        });
        let [early_day, last_day] = days;
        let (kept_early, kept_last) = (early_day.await, last_day.await);
        let max_retained = self.active_teams() / 4;
        assert!(
            kept_early < max_retained,
            "{kept_early} of day {RETENTION_SET} are kept"
        );
        assert_eq!(
            kept_last,
            self.active_teams(),
            "the last stage has no retention"
        );
    }

    /// After the last day: reveals the blind stage, signs off each stage, and closes the season.
    pub async fn sign_off(&mut self) {
        self.site.set_time(local_time(DAYS + 1, 12));
        update_due_days(
            &self.site.store,
            &faceoff_airhockey::competition(),
            self.site.now(),
        )
        .await
        .unwrap();
        let last_stage = self.stage_of(DAYS - 1);
        let hidden = self.board(DAYS - 1).await;
        assert_eq!(
            (&hidden["blind"], &hidden["rows"]),
            (&json!(true), &json!([]))
        );
        let opened = self
            .change_stage(&last_stage, json!({ "blind": false, "confirm": "Final" }))
            .await;
        assert_eq!(opened["blind"], false);
        self.check_retention().await;
        for stage in self.stages.clone() {
            let path = format!("/stages/{}/finalise", string(&stage["id"]));
            let signed_off = self.post(&path, json!({ "confirm": stage["name"] })).await;
            assert_ne!(signed_off.json(200)["finalised"], json!(null));
        }
        self.post("/season/close", json!({ "confirm": "Test season" }))
            .await
            .json(200);
    }
}

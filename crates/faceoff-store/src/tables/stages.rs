//! The table of stages: the parts of the season, each with its own rules, days and boards.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::Actor,
    tables::{run_plan::RunPlan, sign_offs::SignOff},
};
use faceoff_types::{
    DayDeadline, IanaTimeZone, SeedLabel, StageDay, StageId, StageName, StageRules, StageSettings,
    TeamId,
};
use jiff::{SignedDuration, Timestamp, civil::Date};
use sqlx::SqliteConnection;

/// A part of the season with its own days, rules and board.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Part of its URLs, and of its days' seeds.
    pub id: StageId,
    /// Unique regardless of case.
    pub name: StageName,
    /// From then on its days can start, and its rules are fixed.
    pub opens_at: Timestamp,
    /// From then on none of its days can start; `None`: no end is set.
    pub closes_at: Option<Timestamp>,
    /// Time zone of its dates.
    pub zone: IanaTimeZone,
    /// Everything that scores do not depend on.
    pub settings: StageSettings,
    /// Everything that scores depend on: the current revision.
    pub revision: Revision,
    /// False if its days began before there were stages; their seeds then derive from the date alone.
    pub seeds_derive_from_id: bool,
    /// Does it take its rules and settings from the server's configuration file?
    pub configured: bool,
    /// Set once the stage is signed off, so that it cannot be changed.
    pub sign_off: Option<SignOff>,
}

/// A revision of a stage's rules.
#[derive(Debug, Clone, PartialEq)]
pub struct Revision {
    /// From 1.
    pub number: u32,
    /// When it came into force.
    pub since: Timestamp,
    pub rules: StageRules,
}

/// Phase of a stage at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StagePhase {
    Upcoming,
    Open,
    Closed,
}

impl Stage {
    /// The stage's phase at `now`.
    #[must_use]
    pub fn phase(&self, now: Timestamp) -> StagePhase {
        if now < self.opens_at {
            StagePhase::Upcoming
        } else if self.closes_at.is_none_or(|closes_at| now < closes_at) {
            StagePhase::Open
        } else {
            StagePhase::Closed
        }
    }

    /// The stage's day at `now`.
    #[must_use]
    pub fn day(&self, now: Timestamp) -> StageDay {
        StageDay {
            stage: self.id,
            date: self.zone.date(now),
        }
    }

    /// The date of the stage's next day, if it has one, and its scheduled cutoff, which may be due already. `newest_day` is
    /// the date of the newest day so far. Without a schedule it is the earliest day that an organiser can start.
    #[must_use]
    pub fn next_cutoff(
        &self,
        newest_day: Option<Date>,
        now: Timestamp,
    ) -> Option<(Date, Option<Timestamp>)> {
        let earliest = self.zone.date(now.max(self.opens_at));
        let first_date = match newest_day {
            Some(newest) if newest >= earliest => newest.tomorrow().ok()?,
            _ => earliest,
        };
        let is_closed_at =
            |instant: Timestamp| self.closes_at.is_some_and(|closes_at| closes_at <= instant);
        if self.phase(now) == StagePhase::Closed {
            return None;
        }
        let Some(schedule) = &self.settings.schedule else {
            let midnight = first_date.to_zoned(self.zone.time_zone()).ok()?.timestamp();
            return (!is_closed_at(midnight)).then_some((first_date, None));
        };
        let (date, cutoff_at) = schedule.next(first_date, self.opens_at, &self.zone)?;
        (!is_closed_at(cutoff_at)).then_some((date, Some(cutoff_at)))
    }

    /// Deadline of the stage's day of this date with this cutoff; `None`: there is none. A day continues when the stage
    /// closes.
    #[must_use]
    pub fn deadline(&self, date: Date, cutoff_at: Timestamp) -> Option<Timestamp> {
        match self.settings.day_deadline {
            DayDeadline::Never => None,
            DayDeadline::Hours(hours) => cutoff_at
                .checked_add(SignedDuration::from_hours(hours.into()))
                .ok(),
            DayDeadline::NextCutoff => {
                let schedule = self.settings.schedule.as_ref()?;
                let next_date = date.tomorrow().ok()?;
                // A missed day may start at the same time at which another day is due.
                let earliest = cutoff_at.checked_add(SignedDuration::from_secs(1)).ok()?;
                schedule
                    .next(next_date, earliest, &self.zone)
                    .map(|(_, deadline_at)| deadline_at)
            }
        }
    }

    /// The plan of each team's run on a day, under the current rules.
    #[must_use]
    pub fn plan(&self) -> RunPlan {
        let rules = &self.revision.rules;
        RunPlan {
            profile: rules.profile,
            tasks: rules.tasks.clone(),
            episodes_per_task: rules.episodes_per_task,
            episodes_per_shard: self.settings.episodes_per_shard,
            max_faults: rules.max_faults,
            variation: rules.variation.clone(),
            limits: rules.limits.clone(),
        }
    }

    /// Label from which the seeds of the stage's evaluations on a date derive.
    #[must_use]
    pub const fn seed_label(&self, date: Date) -> SeedLabel {
        if self.seeds_derive_from_id {
            SeedLabel::StageDay(StageDay {
                stage: self.id,
                date,
            })
        } else {
            SeedLabel::Day(date)
        }
    }
}

struct StageRow {
    id: StageId,
    name: StageName,
    opens_at: Instant,
    closes_at: Option<Instant>,
    zone: IanaTimeZone,
    settings: Json<StageSettings>,
    names_seeds: bool,
    configured: bool,
    finalised_at: Option<Instant>,
    finalised_by: Option<Actor>,
    finalised_without: Option<Json<Vec<TeamId>>>,
    revision: u32,
    since: Instant,
    rules: Json<StageRules>,
}

impl From<StageRow> for Stage {
    fn from(row: StageRow) -> Self {
        Self {
            id: row.id,
            name: row.name,
            opens_at: row.opens_at.0,
            closes_at: row.closes_at.map(|at| at.0),
            zone: row.zone,
            settings: row.settings.0,
            revision: Revision {
                number: row.revision,
                since: row.since.0,
                rules: row.rules.0,
            },
            seeds_derive_from_id: row.names_seeds,
            configured: row.configured,
            sign_off: SignOff::from_columns(
                row.finalised_at,
                row.finalised_by,
                row.finalised_without,
            ),
        }
    }
}

/// All stages, by opening time. A stage without rules is left out: its creation is not complete.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Stage>> {
    let rows = sqlx::query_as!(
        StageRow,
        "SELECT s.id, s.name, s.opens_at, s.closes_at, s.zone, s.settings, s.names_seeds, s.configured,
                s.finalised_at, s.finalised_by, s.finalised_without, r.revision, r.since, r.rules
         FROM stages s JOIN stage_revisions r ON r.stage_id = s.id
         WHERE r.revision = (SELECT MAX(n.revision) FROM stage_revisions n WHERE n.stage_id = s.id)
         ORDER BY s.opens_at, s.id"
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Stage::from).collect())
}

/// The current stage at `now`: the open one that opened last; if none is open, the one that closed last; if none has closed,
/// the next to open.
pub(crate) fn current(stages: &[Stage], now: Timestamp) -> Option<&Stage> {
    let in_phase = |phase| stages.iter().filter(move |stage| stage.phase(now) == phase);
    in_phase(StagePhase::Open)
        .next_back()
        .or_else(|| in_phase(StagePhase::Closed).max_by_key(|stage| stage.closes_at))
        .or_else(|| in_phase(StagePhase::Upcoming).next())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: StageId) -> Result<Stage> {
    // There are only a few stages.
    let stages = all(connection).await?;
    let found = stages.into_iter().find(|stage| stage.id == id);
    found.ok_or(StoreError::NotFound("stage"))
}

/// All revisions of a stage's rules, the oldest first.
pub(crate) async fn revisions(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Vec<Revision>> {
    let rows = sqlx::query!(
        "SELECT revision, since, rules
         FROM stage_revisions WHERE stage_id = ? ORDER BY revision",
        stage
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| Revision {
            number: row.revision,
            since: row.since.0,
            rules: row.rules.0,
        })
        .collect())
}

/// The stage that takes its rules from the configuration, even if it has no rules yet.
pub(crate) async fn find_configured(connection: &mut SqliteConnection) -> Result<Option<StageId>> {
    let id = sqlx::query_scalar!("SELECT id FROM stages WHERE configured = 1")
        .fetch_optional(connection)
        .await?;
    Ok(id)
}

/// Adds a stage with its first rules. [`StoreError::StageNameTaken`] if another stage has its name.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    stage: &Stage,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO stages (id, name, opens_at, closes_at, zone, settings, names_seeds, configured, created_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        stage.id,
        stage.name.as_str(),
        Instant(stage.opens_at),
        stage.closes_at.map(Instant),
        &stage.zone,
        Json(&stage.settings),
        stage.seeds_derive_from_id,
        stage.configured,
        Instant(now),
    )
    .execute(&mut *connection)
    .await
    .map_err(name_error(&stage.name))?;
    insert_revision(connection, stage.id, &stage.revision).await
}

pub(crate) async fn insert_revision(
    connection: &mut SqliteConnection,
    stage: StageId,
    revision: &Revision,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO stage_revisions (stage_id, revision, since, rules) VALUES (?, ?, ?, ?)",
        stage,
        revision.number,
        Instant(revision.since),
        Json(&revision.rules),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Replaces rules under which no evaluation exists.
pub(crate) async fn replace_revision(
    connection: &mut SqliteConnection,
    stage: StageId,
    revision: &Revision,
) -> Result<()> {
    sqlx::query!(
        "UPDATE stage_revisions SET since = ?, rules = ? WHERE stage_id = ? AND revision = ?",
        Instant(revision.since),
        Json(&revision.rules),
        stage,
        revision.number,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores everything of a stage except its rules. [`StoreError::StageNameTaken`] if another stage has its name.
pub(crate) async fn update(connection: &mut SqliteConnection, stage: &Stage) -> Result<()> {
    sqlx::query!(
        "UPDATE stages SET name = ?, opens_at = ?, closes_at = ?, zone = ?, settings = ?, configured = ?
         WHERE id = ?",
        stage.name.as_str(),
        Instant(stage.opens_at),
        stage.closes_at.map(Instant),
        &stage.zone,
        Json(&stage.settings),
        stage.configured,
        stage.id,
    )
    .execute(connection)
    .await
    .map_err(name_error(&stage.name))?;
    Ok(())
}

fn name_error(name: &StageName) -> impl FnOnce(sqlx::Error) -> StoreError {
    StoreError::if_duplicate("stages.name", || {
        StoreError::StageNameTaken(name.to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_airhockey::TASKS;
    use faceoff_types::Schedule;
    use jiff::civil::date;

    fn time(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    /// A stage in Berlin (UTC+1) that is open from 2 March to 5 March.
    fn stage(schedule: Option<Schedule>) -> Stage {
        Stage {
            id: StageId::new(),
            name: "Final".parse().unwrap(),
            opens_at: time("2026-03-02T10:00:00Z"),
            closes_at: Some(time("2026-03-05T10:00:00Z")),
            zone: "Europe/Berlin".parse().unwrap(),
            settings: StageSettings {
                schedule,
                ..StageSettings::default()
            },
            revision: Revision {
                number: 1,
                since: time("2026-03-02T10:00:00Z"),
                rules: StageRules {
                    runtimes: None,
                    ruleset: faceoff_airhockey::RULESET,
                    profile: faceoff_airhockey::EVALUATION,
                    tasks: TASKS.to_vec(),
                    episodes_per_task: 1,
                    max_faults: 1,
                    variation: Default::default(),
                    limits: Default::default(),
                },
            },
            seeds_derive_from_id: true,
            configured: false,
            sign_off: None,
        }
    }

    #[test]
    fn next_cutoff_is_scheduled_between_opening_and_closing() {
        // 06:00 in Berlin is 05:00 UTC.
        let stage = stage(Some(Schedule::daily("06:00".parse().unwrap())));
        let next = |newest, now: &str| {
            let (date, cutoff_at) = stage.next_cutoff(newest, time(now))?;
            Some((date, cutoff_at.unwrap().to_string()))
        };
        let on_third = Some((date(2026, 3, 3), "2026-03-03T05:00:00Z".to_owned()));
        let on_fourth = Some((date(2026, 3, 4), "2026-03-04T05:00:00Z".to_owned()));
        assert_eq!(
            next(None, "2026-02-01T00:00:00Z"),
            on_third,
            "after it opens"
        );
        assert_eq!(next(None, "2026-03-02T12:00:00Z"), on_third);
        assert_eq!(next(None, "2026-03-03T09:00:00Z"), on_third, "it is due");
        assert_eq!(
            next(Some(date(2026, 3, 3)), "2026-03-03T09:00:00Z"),
            on_fourth
        );
        assert_eq!(next(Some(date(2026, 3, 5)), "2026-03-05T09:00:00Z"), None);
        assert_eq!(next(None, "2026-03-05T10:00:00Z"), None, "closed");
    }

    #[test]
    fn day_deadline_is_the_next_cutoff_or_the_configured_time() {
        let scheduled = stage(Some(Schedule::daily("06:00".parse().unwrap())));
        let deadline = |stage: &Stage, day: Date, cutoff_at: &str| {
            let deadline_at = stage.deadline(day, time(cutoff_at));
            deadline_at.map(|at| at.to_string())
        };
        let fourth_at_six = Some("2026-03-04T05:00:00Z".to_owned());
        let third = date(2026, 3, 3);
        assert_eq!(
            deadline(&scheduled, third, "2026-03-03T05:00:00Z"),
            fourth_at_six
        );
        // If an organiser starts the day, early or late, its deadline is still the cutoff of the next date.
        assert_eq!(
            deadline(&scheduled, third, "2026-03-03T00:00:00Z"),
            fourth_at_six
        );
        assert_eq!(
            deadline(&scheduled, third, "2026-03-03T22:00:00Z"),
            fourth_at_six
        );
        // The deadline of a missed day is the next cutoff; that of the last day is the cutoff that would follow.
        let missed = deadline(&scheduled, date(2026, 3, 1), "2026-03-03T05:00:00Z");
        assert_eq!(missed, fourth_at_six);
        let last = deadline(&scheduled, date(2026, 3, 5), "2026-03-05T05:00:00Z");
        assert_eq!(last, Some("2026-03-06T05:00:00Z".to_owned()));
        assert_eq!(deadline(&stage(None), third, "2026-03-03T05:00:00Z"), None);
        let with_deadline = |day_deadline| Stage {
            settings: StageSettings {
                day_deadline,
                ..scheduled.settings.clone()
            },
            ..scheduled.clone()
        };
        let never = with_deadline(DayDeadline::Never);
        assert_eq!(deadline(&never, third, "2026-03-03T05:00:00Z"), None);
        let after_30_hours = with_deadline(DayDeadline::Hours(30));
        let expected = Some("2026-03-04T11:00:00Z".to_owned());
        assert_eq!(
            deadline(&after_30_hours, third, "2026-03-03T05:00:00Z"),
            expected
        );
    }

    #[test]
    fn next_cutoff_without_schedule_is_the_next_free_date() {
        let stage = stage(None);
        let next = |newest, now: &str| stage.next_cutoff(newest, time(now)).map(|(date, _)| date);
        assert_eq!(next(None, "2026-02-01T00:00:00Z"), Some(date(2026, 3, 2)));
        let evaluated_day = Some(date(2026, 3, 2));
        assert_eq!(
            next(evaluated_day, "2026-03-02T22:59:00Z"),
            Some(date(2026, 3, 3))
        );
        assert_eq!(next(Some(date(2026, 3, 5)), "2026-03-05T09:00:00Z"), None);
    }
}

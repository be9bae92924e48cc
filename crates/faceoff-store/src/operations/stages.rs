//! Stages: the parts of a season, each with its own rules. Their creation, permitted changes, and synchronisation with the
//! configuration file.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{day_deadlines, retention},
    store::Store,
    tables::{
        days, season, sign_offs,
        stages::{self, Revision, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{IanaTimeZone, Retention, StageId, StageName, StageRules, StageSettings};
use jiff::Timestamp;

/// A stage to be created.
#[derive(Debug, Clone)]
pub struct NewStage {
    /// Unique, ignoring case.
    pub name: StageName,
    /// When its first day can start; a time in the past means now.
    pub opens_at: Timestamp,
    /// `None`: it has no end yet.
    pub closes_at: Option<Timestamp>,
    /// Time zone of its days' dates.
    pub zone: IanaTimeZone,
    /// Rules that scores depend on.
    pub rules: StageRules,
    /// Settings that scores do not depend on.
    pub settings: StageSettings,
}

/// Changes of a stage; `None` leaves a value unchanged.
#[derive(Debug, Clone, Default)]
pub struct StageChange {
    pub name: Option<StageName>,
    /// Only before the stage has opened.
    pub opens_at: Option<Timestamp>,
    /// Only before the stage has closed; `Some(None)`: it has no end yet.
    pub closes_at: Option<Option<Timestamp>>,
    /// Only before the cutoff of its first day.
    pub zone: Option<IanaTimeZone>,
    /// In an open stage this creates another revision.
    pub rules: Option<StageRules>,
    /// Settings that scores do not depend on.
    pub settings: Option<StageSettings>,
    /// Also after the stage is signed off or the season is over.
    pub retention: Option<Retention>,
}

impl StageChange {
    /// Does anything but the retention differ from `stage`?
    fn changes_more_than_retention(&self, stage: &Stage) -> bool {
        fn differs<T: PartialEq>(new: Option<&T>, current: &T) -> bool {
            new.is_some_and(|new| new != current)
        }
        differs(self.name.as_ref(), &stage.name)
            || differs(self.opens_at.as_ref(), &stage.opens_at)
            || differs(self.closes_at.as_ref(), &stage.closes_at)
            || differs(self.zone.as_ref(), &stage.zone)
            || differs(self.rules.as_ref(), &stage.revision.rules)
            || differs(self.settings.as_ref(), &stage.settings)
    }
}

/// The name of a season's first stage.
const FIRST_STAGE_NAME: &str = "Qualifying";

/// Truncated to milliseconds, the resolution of the database.
fn truncate(instant: Timestamp) -> Timestamp {
    Timestamp::from_millisecond(instant.as_millisecond()).unwrap_or(instant)
}

fn check_times(opens_at: Timestamp, closes_at: Option<Timestamp>, now: Timestamp) -> Result<()> {
    match closes_at {
        Some(at) if at <= opens_at => StoreError::conflict(format!(
            "closes_at: expected a time after the opening at {opens_at}, got {at}"
        )),
        Some(at) if at <= now => StoreError::conflict(format!(
            "closes_at: expected a time in the future, got {at}; the past cannot be changed"
        )),
        _ => Ok(()),
    }
}

fn check_rules(rules: &StageRules, settings: &StageSettings) -> Result<()> {
    let checked = rules.check().and_then(|()| settings.check());
    checked.map_err(|error| StoreError::Conflict(error.to_string()))
}

async fn create(tx: &mut Tx, stage: &Stage) -> Result<()> {
    let now = tx.now;
    stages::insert(tx, stage, now).await?;
    let event = Event::StageCreated {
        name: stage.name.clone(),
        opens_at: stage.opens_at,
        closes_at: stage.closes_at,
        zone: stage.zone.clone(),
        rules: stage.revision.rules.clone(),
        settings: stage.settings.clone(),
    };
    tx.record(Subject::Stage(stage.id), event);
    Ok(())
}

/// Does the change only reveal a blind stage (one with hidden scores), or publish datasets earlier?
fn only_increases_visibility(stage: &Stage, changed: &Stage) -> bool {
    let more_visible = Stage {
        settings: StageSettings {
            blind: changed.settings.blind,
            publishes: changed.settings.publishes,
            ..stage.settings.clone()
        },
        ..stage.clone()
    };
    *changed == more_visible
        && changed.settings.blind <= stage.settings.blind
        && changed.settings.publishes >= stage.settings.publishes
}

/// Origin of a change of a stage.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ChangeSource {
    Organiser,
    Configuration,
}

async fn change(
    tx: &mut Tx,
    stage: &Stage,
    change: StageChange,
    source: ChangeSource,
) -> Result<()> {
    let now = tx.now;
    let mut changed = Stage {
        name: change.name.unwrap_or_else(|| stage.name.clone()),
        opens_at: change.opens_at.unwrap_or(stage.opens_at),
        closes_at: change.closes_at.unwrap_or(stage.closes_at),
        zone: change.zone.unwrap_or_else(|| stage.zone.clone()),
        settings: change.settings.unwrap_or_else(|| stage.settings.clone()),
        ..stage.clone()
    };
    let phase = stage.phase(now);
    let rules = change.rules.unwrap_or_else(|| stage.revision.rules.clone());
    sign_offs::check_not_signed_off(tx, stage.id).await?;
    let increases_visibility =
        rules == stage.revision.rules && only_increases_visibility(stage, &changed);
    if phase == StagePhase::Closed && !increases_visibility {
        return StoreError::conflict(format!(
            "the stage {:?} closed at {}, and a closed stage cannot be changed, except to reveal a blind one or to publish \
             datasets earlier. Create another stage",
            stage.name.as_str(),
            stage.closes_at.unwrap_or(now)
        ));
    }
    if changed.opens_at != stage.opens_at && (phase == StagePhase::Open || changed.opens_at <= now)
    {
        return StoreError::conflict(format!(
            "opens_at: the stage {} at {}; the opening can be moved only before it has passed, and only to a time in the \
             future",
            if phase == StagePhase::Open {
                "opened"
            } else {
                "opens"
            },
            stage.opens_at
        ));
    }
    if (changed.opens_at, changed.closes_at) != (stage.opens_at, stage.closes_at) {
        check_times(changed.opens_at, changed.closes_at, now)?;
    }
    if changed.zone != stage.zone && days::newest(tx, stage.id).await?.is_some() {
        return StoreError::conflict(format!(
            "zone: the stage already has days, named by their date in {}; create another stage",
            stage.zone
        ));
    }
    if changed.settings.blind && !stage.settings.blind {
        let scored = sign_offs::count_scored(tx, stage.id).await?;
        if scored > 0 {
            return StoreError::conflict(format!(
                "blind: {scored} evaluations of the stage {:?} have a score that was visible; a stage can be made blind \
                 only before its first score",
                stage.name.as_str()
            ));
        }
    }
    check_rules(&rules, &changed.settings)?;
    // At the next start the configuration file must not revert an organiser's change.
    let new_values = (&rules, &changed.settings, &changed.zone);
    let is_manual = source == ChangeSource::Organiser
        && new_values != (&stage.revision.rules, &stage.settings, &stage.zone);
    if changed != *stage {
        let event = Event::StageChanged {
            name: changed.name.clone(),
            opens_at: changed.opens_at,
            closes_at: changed.closes_at,
            zone: changed.zone.clone(),
            settings: changed.settings.clone(),
        };
        tx.record(Subject::Stage(stage.id), event);
    }
    changed.configured = stage.configured && !is_manual;
    stages::update(tx, &changed).await?;
    if changed.settings != stage.settings {
        day_deadlines::update_deadlines(tx, &changed, source == ChangeSource::Configuration)
            .await?;
    }
    set_rules(tx, &changed, rules).await
}

/// Sets a stage's rules. Once the stage has opened, this creates another revision.
async fn set_rules(tx: &mut Tx, stage: &Stage, rules: StageRules) -> Result<()> {
    let is_upcoming = stage.phase(tx.now) == StagePhase::Upcoming;
    let is_new = rules != stage.revision.rules;
    let revision = Revision {
        number: stage.revision.number + u32::from(is_new && !is_upcoming),
        since: if is_upcoming { stage.opens_at } else { tx.now },
        rules,
    };
    if is_upcoming {
        stages::replace_revision(tx, stage.id, &revision).await?;
    } else if is_new {
        stages::insert_revision(tx, stage.id, &revision).await?;
    }
    if is_new {
        let event = Event::StageRulesChanged {
            revision: revision.number,
            rules: revision.rules,
        };
        tx.record(Subject::Stage(stage.id), event);
    }
    Ok(())
}

impl Store {
    /// Creates a stage. [`StoreError::StageNameTaken`] if another one has its name, [`StoreError::Conflict`] if its times
    /// or rules are invalid, [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn create_stage(&self, actor: Actor, new: NewStage, now: Timestamp) -> Result<Stage> {
        self.create_stage_with_retention(actor, new, Retention::default(), now)
            .await
    }

    /// [`create_stage`](Self::create_stage) with a retention for its files.
    #[boxed_future]
    pub async fn create_stage_with_retention(
        &self,
        actor: Actor,
        new: NewStage,
        retention: Retention,
        now: Timestamp,
    ) -> Result<Stage> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let opens_at = truncate(new.opens_at.max(now));
            check_times(opens_at, new.closes_at, now)?;
            check_rules(&new.rules, &new.settings)?;
            let stage = Stage {
                id: StageId::new(),
                name: new.name,
                opens_at,
                closes_at: new.closes_at,
                zone: new.zone,
                settings: new.settings,
                revision: Revision {
                    number: 1,
                    since: opens_at,
                    rules: new.rules,
                },
                seeds_derive_from_id: true,
                configured: false,
                sign_off: None,
            };
            create(tx, &stage).await?;
            retention::change(tx, stage.id, retention).await?;
            stages::find(tx, stage.id).await
        })
        .await
    }

    /// Changes a stage within the permitted limits; new rules of an open stage create another revision.
    /// [`StoreError::Conflict`] names the field that cannot be changed; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn change_stage(
        &self,
        actor: Actor,
        id: StageId,
        request: StageChange,
        now: Timestamp,
    ) -> Result<Stage> {
        self.write(actor, now, async |tx| {
            let stage = stages::find(tx, id).await?;
            if let Some(retention) = request.retention {
                retention::change(tx, id, retention).await?;
                if !request.changes_more_than_retention(&stage) {
                    return Ok(stage);
                }
            }
            season::check_open(tx).await?;
            change(tx, &stage, request, ChangeSource::Organiser).await?;
            stages::find(tx, id).await
        })
        .await
    }

    /// Creates the season's first stage from the configuration file, or updates the stage that follows this file; new rules
    /// create another revision. A stage that an organiser has changed, that has closed, or whose season is closed stays
    /// unchanged. [`StoreError::Conflict`] if the zone changes after the first day.
    #[boxed_future]
    pub async fn configure_stage(
        &self,
        rules: StageRules,
        settings: StageSettings,
        zone: IanaTimeZone,
        now: Timestamp,
    ) -> Result<()> {
        self.write(Actor::Operator, now, async |tx| {
            check_rules(&rules, &settings)?;
            let Some(id) = stages::find_configured(tx).await? else {
                if !stages::all(tx).await?.is_empty() {
                    return Ok(());
                }
                let first = Stage {
                    id: StageId::new(),
                    name: FIRST_STAGE_NAME.parse().map_err(|error| {
                        StoreError::Damaged(format!("{FIRST_STAGE_NAME}: {error}"))
                    })?,
                    opens_at: truncate(now),
                    closes_at: None,
                    zone,
                    settings,
                    revision: Revision {
                        number: 1,
                        since: truncate(now),
                        rules,
                    },
                    seeds_derive_from_id: true,
                    configured: true,
                    sign_off: None,
                };
                return create(tx, &first).await;
            };
            if stages::revisions(tx, id).await?.is_empty() {
                // A stage without revisions was created by the migration from a database without evaluations.
                let first = Revision {
                    number: 1,
                    since: now,
                    rules: rules.clone(),
                };
                stages::insert_revision(tx, id, &first).await?;
            }
            let stage = stages::find(tx, id).await?;
            let season_is_closed = season::read(tx).await?.closed_at.is_some();
            if season_is_closed || stage.phase(now) == StagePhase::Closed {
                return Ok(());
            }
            let request = StageChange {
                zone: Some(zone),
                rules: Some(rules),
                settings: Some(settings),
                ..StageChange::default()
            };
            change(tx, &stage, request, ChangeSource::Configuration).await
        })
        .await
    }
}

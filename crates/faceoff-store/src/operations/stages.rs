//! Stages: made, changed as far as they may be, and told by the configuration.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{deadlines, retention},
    store::Store,
    tables::{
        days, finalised, season,
        stages::{self, Revision, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{Retention, StageId, StageName, StageRules, StageSettings, Zone};
use jiff::Timestamp;

/// A stage to be made.
#[derive(Debug, Clone)]
pub struct NewStage {
    /// No two that differ only in case.
    pub name: StageName,
    /// From when on its days start; one that has passed is now.
    pub opens_at: Timestamp,
    /// Until when; `None`: it has no end yet.
    pub closes_at: Option<Timestamp>,
    /// Where its days are dates.
    pub zone: Zone,
    /// What scores depend on.
    pub rules: StageRules,
    /// What they do not depend on.
    pub settings: StageSettings,
}

/// What is to be another; `None` stays as it is.
#[derive(Debug, Clone, Default)]
pub struct StageChange {
    pub name: Option<StageName>,
    /// While it has not opened.
    pub opens_at: Option<Timestamp>,
    /// While it has not closed; `Some(None)`: it has no end yet.
    pub closes_at: Option<Option<Timestamp>>,
    /// While none of its days has had its cut.
    pub zone: Option<Zone>,
    /// Once it is open this makes another revision.
    pub rules: Option<StageRules>,
    /// What no score depends on.
    pub settings: Option<StageSettings>,
    /// What is kept of its files; also once it is signed off, and when the season is over.
    pub retention: Option<Retention>,
}

impl StageChange {
    /// Is anything to be another, beside what is kept?
    fn changes(&self, stage: &Stage) -> bool {
        fn other<T: PartialEq>(wanted: Option<&T>, is: &T) -> bool {
            wanted.is_some_and(|wanted| wanted != is)
        }
        other(self.name.as_ref(), &stage.name)
            || other(self.opens_at.as_ref(), &stage.opens_at)
            || other(self.closes_at.as_ref(), &stage.closes_at)
            || other(self.zone.as_ref(), &stage.zone)
            || other(self.rules.as_ref(), &stage.rules.rules)
            || other(self.settings.as_ref(), &stage.settings)
    }
}

/// The name of a season's first stage.
const FIRST: &str = "Qualifying";

fn conflict<T>(why: String) -> Result<T> {
    Err(StoreError::Conflict(why))
}

/// As the database has it, in milliseconds; never later than it is.
fn stored(at: Timestamp) -> Timestamp {
    Timestamp::from_millisecond(at.as_millisecond()).unwrap_or(at)
}

fn check_times(opens_at: Timestamp, closes_at: Option<Timestamp>, now: Timestamp) -> Result<()> {
    match closes_at {
        Some(at) if at <= opens_at => conflict(format!(
            "closes_at: expected a time after the opening at {opens_at}, got {at}"
        )),
        Some(at) if at <= now => conflict(format!(
            "closes_at: expected a time in the future, got {at}; what has passed is not changed"
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
        rules: stage.rules.rules.clone(),
        settings: stage.settings.clone(),
    };
    tx.record(Subject::Stage(stage.id), event);
    Ok(())
}

/// Is that all that is to be another: that a blind stage is opened, and datasets published sooner?
fn only_tells_more(stage: &Stage, changed: &Stage) -> bool {
    let told = Stage {
        settings: StageSettings {
            blind: changed.settings.blind,
            publishes: changed.settings.publishes,
            ..stage.settings.clone()
        },
        ..stage.clone()
    };
    *changed == told
        && changed.settings.blind <= stage.settings.blind
        && changed.settings.publishes >= stage.settings.publishes
}

/// Who changes a stage.
#[derive(Clone, Copy, PartialEq, Eq)]
enum By {
    Hand,
    Configuration,
}

async fn change(tx: &mut Tx, stage: &Stage, change: StageChange, by: By) -> Result<()> {
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
    let rules = change.rules.unwrap_or_else(|| stage.rules.rules.clone());
    finalised::check_not(tx, stage.id).await?;
    let tells_more = rules == stage.rules.rules && only_tells_more(stage, &changed);
    if phase == StagePhase::Closed && !tells_more {
        return conflict(format!(
            "the stage {:?} closed at {}, and what has closed stays as it was, but for what of it is told: a blind one can be opened, and \
             its datasets published sooner. Make another stage",
            stage.name.as_str(),
            stage.closes_at.unwrap_or(now)
        ));
    }
    if changed.opens_at != stage.opens_at && (phase == StagePhase::Open || changed.opens_at <= now)
    {
        return conflict(format!(
            "opens_at: the stage {} at {}; only the opening of one that is to come is moved, to a time in the future",
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
        return conflict(format!(
            "zone: days are named by their date in {}, and some have been; make another stage",
            stage.zone
        ));
    }
    if changed.settings.blind && !stage.settings.blind {
        let scored = finalised::count_scored(tx, stage.id).await?;
        if scored > 0 {
            return conflict(format!(
                "blind: {scored} evaluations of the stage {:?} have a score that everybody could read; a stage is \
                 made blind before that",
                stage.name.as_str()
            ));
        }
    }
    check_rules(&rules, &changed.settings)?;
    // What a person has changed is not changed back by the next start.
    let told = (&rules, &changed.settings, &changed.zone);
    let by_hand = by == By::Hand && told != (&stage.rules.rules, &stage.settings, &stage.zone);
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
    changed.configured = stage.configured && !by_hand;
    stages::update(tx, &changed).await?;
    if changed.settings != stage.settings {
        deadlines::follow(tx, &changed, by == By::Configuration).await?;
    }
    set_rules(tx, &changed, rules).await
}

/// Gives a stage other rules: another revision, unless it has not opened.
async fn set_rules(tx: &mut Tx, stage: &Stage, rules: StageRules) -> Result<()> {
    let is_upcoming = stage.phase(tx.now) == StagePhase::Upcoming;
    let is_new = rules != stage.rules.rules;
    let revision = Revision {
        number: stage.rules.number + u32::from(is_new && !is_upcoming),
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
    /// Makes a stage. [`StoreError::StageNameTaken`] if another has its name, [`StoreError::Conflict`] if its times
    /// or its rules cannot be, [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn create_stage(&self, actor: Actor, new: NewStage, now: Timestamp) -> Result<Stage> {
        self.create_stage_keeping(actor, new, Retention::default(), now)
            .await
    }

    /// The same of a stage that does not keep all of its files for ever.
    #[boxed]
    pub async fn create_stage_keeping(
        &self,
        actor: Actor,
        new: NewStage,
        retention: Retention,
        now: Timestamp,
    ) -> Result<Stage> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let opens_at = stored(new.opens_at.max(now));
            check_times(opens_at, new.closes_at, now)?;
            check_rules(&new.rules, &new.settings)?;
            let stage = Stage {
                id: StageId::new(),
                name: new.name,
                opens_at,
                closes_at: new.closes_at,
                zone: new.zone,
                settings: new.settings,
                rules: Revision {
                    number: 1,
                    since: opens_at,
                    rules: new.rules,
                },
                names_seeds: true,
                configured: false,
                finalised: None,
            };
            create(tx, &stage).await?;
            retention::change(tx, stage.id, retention).await?;
            stages::find(tx, stage.id).await
        })
        .await
    }

    /// Changes a stage as far as it may be; other rules of one that is open are another revision.
    /// [`StoreError::Conflict`] says what may not be changed; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn change_stage(
        &self,
        actor: Actor,
        id: StageId,
        wanted: StageChange,
        now: Timestamp,
    ) -> Result<Stage> {
        self.write(actor, now, async |tx| {
            let stage = stages::find(tx, id).await?;
            if let Some(retention) = wanted.retention {
                retention::change(tx, id, retention).await?;
                if !wanted.changes(&stage) {
                    return Ok(stage);
                }
            }
            season::check_open(tx).await?;
            change(tx, &stage, wanted, By::Hand).await?;
            stages::find(tx, id).await
        })
        .await
    }

    /// Gives the season its first stage, or the stage that follows the configuration what that says now: other rules
    /// are another revision. A stage that was changed by hand, has closed, or belongs to a closed season stays as it
    /// is. [`StoreError::Conflict`] if the zone is another than that of days that have been.
    #[boxed]
    pub async fn configure_stage(
        &self,
        rules: StageRules,
        settings: StageSettings,
        zone: Zone,
        now: Timestamp,
    ) -> Result<()> {
        self.write(Actor::Organiser, now, async |tx| {
            check_rules(&rules, &settings)?;
            let Some(id) = stages::configured(tx).await? else {
                if !stages::all(tx).await?.is_empty() {
                    return Ok(());
                }
                let first = Stage {
                    id: StageId::new(),
                    name: FIRST
                        .parse()
                        .map_err(|error| StoreError::Damaged(format!("{FIRST}: {error}")))?,
                    opens_at: stored(now),
                    closes_at: None,
                    zone,
                    settings,
                    rules: Revision {
                        number: 1,
                        since: stored(now),
                        rules,
                    },
                    names_seeds: true,
                    configured: true,
                    finalised: None,
                };
                return create(tx, &first).await;
            };
            if stages::revisions(tx, id).await?.is_empty() {
                // Nothing was played before there were stages.
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
            let wanted = StageChange {
                zone: Some(zone),
                rules: Some(rules),
                settings: Some(settings),
                ..StageChange::default()
            };
            change(tx, &stage, wanted, By::Configuration).await
        })
        .await
    }
}

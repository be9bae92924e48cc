//! Tournaments: their opening, changes and pauses.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    queue,
    store::Store,
    tables::{
        decision_records::DecisionRecord,
        entrants, games, rounds, season, stages,
        submissions::{self, SubmissionState},
        teams,
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{
    InvalidTournament, StageId, StageName, SubmissionId, TeamId, TournamentId, TournamentRules,
    TournamentSettings,
};
use jiff::Timestamp;

/// A tournament to be opened.
#[derive(Debug, Clone, PartialEq)]
pub struct NewTournament {
    /// Tournaments have the same type of name as stages.
    pub name: StageName,
    /// Stage whose results the entrants were selected by, if any.
    pub stage: Option<StageId>,
    /// Rules that results depend on.
    pub rules: TournamentRules,
    /// Settings that results do not depend on.
    pub settings: TournamentSettings,
    /// Initial entrants.
    pub entrants: Vec<TeamId>,
}

/// Changes of a tournament; `None` leaves a value unchanged.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TournamentChange {
    pub name: Option<StageName>,
    /// Rules that results depend on; fixed once a round has started.
    pub rules: Option<TournamentRules>,
    /// Settings that results do not depend on.
    pub settings: Option<TournamentSettings>,
    /// Submission that test games are played against; `Some(None)` removes it.
    pub baseline: Option<Option<SubmissionId>>,
}

#[expect(clippy::needless_pass_by_value, reason = "it is mapped over errors")]
fn invalid_tournament(error: InvalidTournament) -> StoreError {
    StoreError::Conflict(error.to_string())
}

async fn check_baseline(tx: &mut Tx, id: SubmissionId) -> Result<()> {
    let baseline = submissions::find(tx, id).await?;
    if baseline.state != SubmissionState::Valid || baseline.bundle_removed.is_some() {
        return StoreError::conflict(
            "baseline: expected a valid submission whose bundle is still stored",
        );
    }
    Ok(())
}

impl Store {
    /// Opens a tournament. Rules can be changed until the first round starts; test and friendly games are possible at
    /// once. [`StoreError::TournamentNameTaken`] if another one has its name, [`StoreError::NotFound`] for an unknown
    /// stage or team, [`StoreError::SeasonClosed`].
    #[boxed_future]
    pub async fn open_tournament(
        &self,
        actor: Actor,
        new: &NewTournament,
        now: Timestamp,
    ) -> Result<Tournament> {
        new.rules.check().map_err(invalid_tournament)?;
        new.settings.check().map_err(invalid_tournament)?;
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            if let Some(stage) = new.stage {
                stages::find(tx, stage).await?;
            }
            let tournament = Tournament {
                id: TournamentId::new(),
                number: tournaments::next_number(tx).await?,
                name: new.name.clone(),
                created_at: now,
                stage: new.stage,
                rules: new.rules.clone(),
                settings: new.settings.clone(),
                baseline: None,
                paused: None,
                closed_at: None,
            };
            tournaments::insert(tx, &tournament).await?;
            for team in &new.entrants {
                teams::find(tx, *team).await?;
                entrants::put(tx, tournament.id, *team, now).await?;
            }
            let event = Event::TournamentOpened {
                name: new.name.clone(),
                rules: Box::new(new.rules.clone()),
                settings: new.settings.clone(),
                teams: new.entrants.clone(),
            };
            tx.record(Subject::Tournament(tournament.id), event);
            Ok(tournament)
        })
        .await
    }

    /// Changes a tournament. [`StoreError::Conflict`] once it is closed; for rules, once a round has started.
    #[boxed_future]
    pub async fn change_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        change: &TournamentChange,
        now: Timestamp,
    ) -> Result<Tournament> {
        if let Some(rules) = &change.rules {
            rules.check().map_err(invalid_tournament)?;
        }
        if let Some(settings) = &change.settings {
            settings.check().map_err(invalid_tournament)?;
        }
        self.write(actor, now, async |tx| {
            let current = tournaments::find_open(tx, id).await?;
            let mut changed = current.clone();
            if let Some(name) = &change.name {
                changed.name = name.clone();
            }
            if let Some(rules) = &change.rules {
                changed.rules = rules.clone();
            }
            if let Some(settings) = &change.settings {
                changed.settings = settings.clone();
            }
            if let Some(baseline) = change.baseline {
                if let Some(baseline) = baseline {
                    check_baseline(tx, baseline).await?;
                }
                changed.baseline = baseline;
            }
            if changed == current {
                return Ok(current);
            }
            if changed.rules != current.rules && rounds::count(tx, id).await? > 0 {
                return StoreError::conflict(
                    "rules: a round has started, and all rounds must have the same rules: open another tournament",
                );
            }
            tournaments::update(tx, &changed).await?;
            let event = Event::TournamentChanged {
                name: changed.name.clone(),
                rules: Box::new(changed.rules.clone()),
                settings: changed.settings.clone(),
                baseline: changed.baseline,
            };
            tx.record(Subject::Tournament(id), event);
            Ok(changed)
        })
        .await
    }

    /// Pauses a tournament: no game starts, running games continue to their end. [`StoreError::Conflict`] if it is
    /// paused already, or closed.
    #[boxed_future]
    pub async fn pause_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Tournament> {
        self.write(actor, now, async |tx| {
            let mut tournament = tournaments::find_open(tx, id).await?;
            if tournament.paused.is_some() {
                return StoreError::conflict("the tournament is paused already: resume it first");
            }
            let reason = reason.to_owned();
            tournament.paused = Some(DecisionRecord {
                at: now,
                reason: reason.clone(),
            });
            tournaments::update(tx, &tournament).await?;
            tx.record(Subject::Tournament(id), Event::TournamentPaused { reason });
            Ok(tournament)
        })
        .await
    }

    /// Resumes a tournament. [`StoreError::Conflict`] if it is not paused.
    #[boxed_future]
    pub async fn resume_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        now: Timestamp,
    ) -> Result<Tournament> {
        self.write(actor, now, async |tx| {
            let mut tournament = tournaments::find_open(tx, id).await?;
            if tournament.paused.take().is_none() {
                return StoreError::conflict(
                    "the tournament is not paused: its games start as slots become free",
                );
            }
            tournaments::update(tx, &tournament).await?;
            for game in games::unfinished(tx, id).await? {
                let job = games::job_of(tx, game.id).await?;
                queue::unpark(tx, job).await?;
            }
            tx.record(Subject::Tournament(id), Event::TournamentResumed);
            Ok(tournament)
        })
        .await
    }
}

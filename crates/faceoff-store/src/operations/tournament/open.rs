use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    queue,
    store::Store,
    tables::{
        entrants, games, rounds,
        rulings::Ruling,
        season, stages,
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
    pub name: StageName,
    /// The stage whose tiers its entrants come from, if they do.
    pub stage: Option<StageId>,
    /// What results depend on.
    pub rules: TournamentRules,
    /// What they do not depend on.
    pub settings: TournamentSettings,
    /// Its first entrants.
    pub entrants: Vec<TeamId>,
}

/// What of a tournament is to be otherwise; what is none stays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TournamentChange {
    pub name: Option<StageName>,
    /// What results depend on; not once a round was started.
    pub rules: Option<TournamentRules>,
    /// What they do not depend on.
    pub settings: Option<TournamentSettings>,
    /// The organisers' agent: `Some(None)` for none.
    pub baseline: Option<Option<SubmissionId>>,
}

#[expect(clippy::needless_pass_by_value, reason = "it is mapped over errors")]
fn invalid(error: InvalidTournament) -> StoreError {
    StoreError::Conflict(error.to_string())
}

async fn check_baseline(tx: &mut Tx, id: SubmissionId) -> Result<()> {
    let baseline = submissions::find(tx, id).await?;
    if baseline.state != SubmissionState::Valid || baseline.archive_removed.is_some() {
        return Err(StoreError::Conflict(
            "baseline: only a valid submission whose archive is kept can be played against".into(),
        ));
    }
    Ok(())
}

impl Store {
    /// Opens a tournament: entrants can be changed and games that do not count played, until its first round fixes the
    /// former. [`StoreError::TournamentNameTaken`] if another has its name, [`StoreError::NotFound`] for stage and teams,
    /// [`StoreError::SeasonClosed`].
    #[boxed]
    pub async fn open_tournament(
        &self,
        actor: Actor,
        new: &NewTournament,
        now: Timestamp,
    ) -> Result<Tournament> {
        new.rules.check().map_err(invalid)?;
        new.settings.check().map_err(invalid)?;
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

    /// Changes a tournament. [`StoreError::Conflict`] once it is closed, and of rules once a round was started.
    #[boxed]
    pub async fn change_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        change: &TournamentChange,
        now: Timestamp,
    ) -> Result<Tournament> {
        if let Some(rules) = &change.rules {
            rules.check().map_err(invalid)?;
        }
        if let Some(settings) = &change.settings {
            settings.check().map_err(invalid)?;
        }
        self.write(actor, now, async |tx| {
            let before = tournaments::find_open(tx, id).await?;
            let mut after = before.clone();
            if let Some(name) = &change.name {
                after.name = name.clone();
            }
            if let Some(rules) = &change.rules {
                after.rules = rules.clone();
            }
            if let Some(settings) = &change.settings {
                after.settings = settings.clone();
            }
            if let Some(baseline) = change.baseline {
                if let Some(baseline) = baseline {
                    check_baseline(tx, baseline).await?;
                }
                after.baseline = baseline;
            }
            if after == before {
                return Ok(before);
            }
            if after.rules != before.rules && rounds::count(tx, id).await? > 0 {
                return Err(StoreError::Conflict(
                    "rules: a round was started, and all rounds are played by the same rules: open another tournament"
                        .into(),
                ));
            }
            tournaments::update(tx, &after).await?;
            let event = Event::TournamentChanged {
                name: after.name.clone(),
                rules: Box::new(after.rules.clone()),
                settings: after.settings.clone(),
                baseline: after.baseline,
            };
            tx.record(Subject::Tournament(id), event);
            Ok(after)
        })
        .await
    }

    /// No game of it begins from now on; what is played meanwhile goes on to its end. [`StoreError::Conflict`] if it is
    /// paused, or closed.
    #[boxed]
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
                return Err(StoreError::Conflict(
                    "the tournament is paused already: resume it first".into(),
                ));
            }
            let reason = reason.to_owned();
            tournament.paused = Some(Ruling {
                at: now,
                reason: reason.clone(),
            });
            tournaments::update(tx, &tournament).await?;
            tx.record(Subject::Tournament(id), Event::TournamentPaused { reason });
            Ok(tournament)
        })
        .await
    }

    /// Its games begin again. [`StoreError::Conflict`] if it is not paused.
    #[boxed]
    pub async fn resume_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        now: Timestamp,
    ) -> Result<Tournament> {
        self.write(actor, now, async |tx| {
            let mut tournament = tournaments::find_open(tx, id).await?;
            if tournament.paused.take().is_none() {
                return Err(StoreError::Conflict(
                    "the tournament is not paused: its games begin as slots are free".into(),
                ));
            }
            tournaments::update(tx, &tournament).await?;
            for game in games::open(tx, id).await? {
                let unit = games::unit_of(tx, game.id).await?;
                queue::unpark(tx, unit).await?;
            }
            tx.record(Subject::Tournament(id), Event::TournamentResumed);
            Ok(tournament)
        })
        .await
    }
}

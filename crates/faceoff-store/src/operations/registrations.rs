//! Teams that want to take part, and what the organisers say to it.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::invitations::{NewInvitation, add_team, check_terms, invite},
    store::Store,
    tables::{
        divisions,
        invitations::InvitedAs,
        registrations::{self, Registration, RegistrationState},
        season, teams,
        teams::{Team, TeamProfile},
    },
    write::Tx,
};
use faceoff_types::{DivisionName, RegistrationId, TeamName};
use jiff::Timestamp;

/// Registrations that wait at a time: anybody may send one, and each is read by a person.
pub const MAX_WAITING: i64 = 200;

/// A team that wants to take part; the code of its link is the caller's.
#[derive(Debug, Clone)]
pub struct NewRegistration {
    /// Of the code's text.
    pub code_hash: [u8; 32],
    /// What it wants to be called.
    pub team_name: TeamName,
    /// What it tells of itself.
    pub profile: TeamProfile,
    /// How the organisers reach it.
    pub contact: String,
    /// The version of the terms that it accepts.
    pub accepted_terms: Option<u32>,
}

/// A registration that nobody has decided about.
async fn waiting(tx: &mut Tx, id: RegistrationId) -> Result<Registration> {
    let registration = registrations::find(tx, id).await?;
    match registration.state {
        RegistrationState::Waiting => Ok(registration),
        RegistrationState::Approved { at, .. } => Err(StoreError::Conflict(format!(
            "the registration was approved at {at}"
        ))),
        RegistrationState::Refused { at, .. } => Err(StoreError::Conflict(format!(
            "the registration was refused at {at}; the team may send another one"
        ))),
    }
}

impl Store {
    /// A team registers. [`StoreError::Conflict`] if none is taken, too many wait, or something is missing that the
    /// text names; [`StoreError::TeamNameTaken`] if a team has the name, or one that waits.
    #[boxed]
    pub async fn register(&self, new: NewRegistration, now: Timestamp) -> Result<Registration> {
        self.write(Actor::Visitor, now, async |tx| {
            season::check_open(tx).await?;
            if !season::read(tx).await?.takes_registrations {
                return Err(StoreError::Conflict(
                    "registration is closed: teams come by invitation; ask the organisers for one".into(),
                ));
            }
            if registrations::count_waiting(tx).await? >= MAX_WAITING {
                return Err(StoreError::Conflict(format!(
                    "{MAX_WAITING} registrations wait for the organisers, and no more than that at a time; try again \
                     later"
                )));
            }
            check_terms(tx, new.accepted_terms).await?;
            let division = match &new.profile.division {
                Some(name) => Some(divisions::check(tx, name).await?),
                None => None,
            };
            let is_taken = teams::all(tx).await?.iter().any(|team| {
                team.name.as_str().to_lowercase() == new.team_name.as_str().to_lowercase()
            });
            if is_taken || registrations::waits(tx, &new.team_name).await? {
                return Err(StoreError::TeamNameTaken(new.team_name.to_string()));
            }
            let registration = Registration {
                id: RegistrationId::new(),
                team_name: new.team_name,
                affiliation: new.profile.affiliation,
                link: new.profile.link,
                division,
                contact: new.contact,
                accepted_terms: new.accepted_terms,
                created_at: now,
                state: RegistrationState::Waiting,
            };
            registrations::insert(tx, &registration, new.code_hash).await?;
            let (id, name) = (registration.id, registration.team_name);
            tx.record(Subject::Registration(id), Event::TeamRegistered { name });
            registrations::find(tx, id).await
        })
        .await
    }

    /// Lets a registered team take part: it exists from now on, and the code of its registration is an invitation of
    /// its first member's, until `expires_at`. [`StoreError::Conflict`] if it was decided about.
    #[boxed]
    pub async fn approve_registration(
        &self,
        actor: Actor,
        id: RegistrationId,
        expires_at: Timestamp,
        now: Timestamp,
    ) -> Result<(Registration, Team)> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let registration = waiting(tx, id).await?;
            let profile = TeamProfile {
                affiliation: registration.affiliation,
                link: registration.link,
                division: registration.division,
            };
            let team = add_team(tx, registration.team_name, profile).await?;
            let invitation = NewInvitation {
                code_hash: registrations::code_hash(tx, id).await?,
                invited_as: InvitedAs::Member(team),
                note: registration.contact,
                expires_at,
            };
            invite(tx, invitation).await?;
            registrations::set_approved(tx, id, team, now).await?;
            tx.record(
                Subject::Registration(id),
                Event::RegistrationApproved { team },
            );
            Ok((
                registrations::find(tx, id).await?,
                teams::find(tx, team).await?,
            ))
        })
        .await
    }

    /// Refuses a registration. [`StoreError::Conflict`] if it was decided about.
    #[boxed]
    pub async fn refuse_registration(
        &self,
        actor: Actor,
        id: RegistrationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Registration> {
        self.write(actor, now, async |tx| {
            waiting(tx, id).await?;
            registrations::set_refused(tx, id, reason, now).await?;
            let reason = reason.to_owned();
            tx.record(
                Subject::Registration(id),
                Event::RegistrationRefused { reason },
            );
            registrations::find(tx, id).await
        })
        .await
    }

    /// All registrations, the newest first.
    #[boxed]
    pub async fn registrations(&self) -> Result<Vec<Registration>> {
        registrations::all(&mut *self.database.read.acquire().await?).await
    }

    /// The divisions, in their order.
    #[boxed]
    pub async fn divisions(&self) -> Result<Vec<DivisionName>> {
        divisions::all(&mut *self.database.read.acquire().await?).await
    }

    /// Lets anybody register a team, or nobody, and sets the divisions; `None` stays as it is. [`StoreError::Conflict`]
    /// if a team is in a division that is left out, or one is there twice; [`StoreError::SeasonClosed`] once the season
    /// is over.
    #[boxed]
    pub async fn change_season(
        &self,
        actor: Actor,
        takes_registrations: Option<bool>,
        divisions: Option<&[DivisionName]>,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            if let Some(names) = divisions {
                set_divisions(tx, names).await?;
            }
            let takes_now = season::read(tx).await?.takes_registrations;
            if let Some(takes) = takes_registrations.filter(|takes| *takes != takes_now) {
                season::set_takes_registrations(tx, takes).await?;
                let event = match takes {
                    true => Event::RegistrationOpened,
                    false => Event::RegistrationClosed,
                };
                tx.record(Subject::Season, event);
            }
            Ok(())
        })
        .await
    }
}

async fn set_divisions(tx: &mut Tx, names: &[DivisionName]) -> Result<()> {
    let lower = |name: &DivisionName| name.as_str().to_lowercase();
    for (index, name) in names.iter().enumerate() {
        let is_twice = names[..index]
            .iter()
            .any(|other| lower(other) == lower(name));
        if is_twice {
            return Err(StoreError::Conflict(format!(
                "divisions: “{name}” is there twice"
            )));
        }
    }
    let before = divisions::all(tx).await?;
    for gone in &before {
        if names.iter().any(|name| lower(name) == lower(gone)) {
            continue;
        }
        let teams = divisions::teams_in(tx, gone).await?;
        if teams > 0 {
            return Err(StoreError::Conflict(format!(
                "divisions: teams are in “{gone}”, {teams} of them; put them into another one first (PATCH \
                 /api/v1/teams/ID)"
            )));
        }
        divisions::remove(tx, gone).await?;
    }
    for (position, name) in (0..).zip(names) {
        divisions::insert(tx, name, position).await?;
    }
    let after = divisions::all(tx).await?;
    if after != before {
        tx.record(Subject::Season, Event::DivisionsSet { divisions: after });
    }
    Ok(())
}

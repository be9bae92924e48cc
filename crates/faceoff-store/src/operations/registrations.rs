//! Registrations of new teams without an invitation, and the organisers' decisions on them.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        invitations::{NewInvitation, add_team, check_terms, invite},
        requester::Requester,
    },
    store::Store,
    tables::{
        divisions,
        invitations::InvitationRole,
        registrations::{self, Registration, RegistrationState},
        season, teams,
        teams::{Team, TeamProfile},
    },
    write::Tx,
};
use faceoff_types::{DivisionName, RegistrationId, TeamName, name_skeleton};
use jiff::Timestamp;

/// Maximum number of pending registrations: sending one needs no account, and an organiser reads each of them.
pub const MAX_PENDING_REGISTRATIONS: i64 = 200;

/// A registration to be added. The caller makes the code of its link.
#[derive(Debug, Clone)]
pub struct NewRegistration {
    /// Hash of the code's text.
    pub code_hash: [u8; 32],
    pub team_name: TeamName,
    pub profile: TeamProfile,
    /// How the organisers can reach the team, free text.
    pub contact: String,
    /// Version of the terms that the team accepts.
    pub accepted_terms: Option<u32>,
}

/// Finds a pending registration; [`StoreError::Conflict`] if it was decided.
async fn find_pending(tx: &mut Tx, id: RegistrationId) -> Result<Registration> {
    let registration = registrations::find(tx, id).await?;
    match registration.state {
        RegistrationState::Pending => Ok(registration),
        RegistrationState::Approved { at, .. } => {
            StoreError::conflict(format!("the registration was approved at {at}"))
        }
        RegistrationState::Refused { at, .. } => StoreError::conflict(format!(
            "the registration was refused at {at}; the team may register again"
        )),
    }
}

impl Store {
    /// Adds the registration of a team. [`StoreError::Conflict`] if registration is closed, [`MAX_PENDING_REGISTRATIONS`]
    /// are pending, or a field is missing; [`StoreError::TeamNameTaken`] if a team or a pending registration has the
    /// name, or one that looks like it.
    #[boxed_future]
    pub async fn register(&self, new: NewRegistration, now: Timestamp) -> Result<Registration> {
        self.write(Actor::Visitor, now, async |tx| {
            season::check_open(tx).await?;
            if !season::read(tx).await?.registration_open {
                return StoreError::conflict(
                    "registration is closed: teams join by invitation; ask the organisers for one",
                );
            }
            if registrations::count_pending(tx).await? >= MAX_PENDING_REGISTRATIONS {
                return StoreError::conflict(format!(
                    "{MAX_PENDING_REGISTRATIONS} registrations are pending, which is the limit: try again later"
                ));
            }
            check_terms(tx, new.accepted_terms).await?;
            let division = match &new.profile.division {
                Some(name) => Some(divisions::check(tx, name).await?),
                None => None,
            };
            teams::check_name(tx, None, &new.team_name).await?;
            // Names with the same skeleton look alike.
            let skeleton = name_skeleton(new.team_name.as_str());
            let pending = registrations::pending_names(tx).await?;
            if let Some(name) = pending
                .into_iter()
                .find(|name| name_skeleton(name.as_str()) == skeleton)
            {
                return Err(StoreError::TeamNameTaken(name.to_string()));
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
                state: RegistrationState::Pending,
            };
            registrations::insert(tx, &registration, new.code_hash).await?;
            let (id, name) = (registration.id, registration.team_name);
            tx.record(Subject::Registration(id), Event::TeamRegistered { name });
            registrations::find(tx, id).await
        })
        .await
    }

    /// Approves a registration: adds its team. The code of the registration becomes the invitation of the first member
    /// and is valid until `expires_at`. [`StoreError::Conflict`] if the registration was decided.
    #[boxed_future]
    pub async fn approve_registration(
        &self,
        actor: Actor,
        id: RegistrationId,
        expires_at: Timestamp,
        requester: Requester,
        now: Timestamp,
    ) -> Result<(Registration, Team)> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let registration = find_pending(tx, id).await?;
            let profile = TeamProfile {
                affiliation: registration.affiliation,
                link: registration.link,
                division: registration.division,
            };
            let team = add_team(tx, registration.team_name, profile).await?;
            let invitation = NewInvitation {
                code_hash: registrations::code_hash(tx, id).await?,
                role: InvitationRole::Member(team),
                note: registration.contact,
                // The organiser who approves it may have registered the team.
                requester,
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

    /// Refuses a registration. [`StoreError::Conflict`] if it was decided.
    #[boxed_future]
    pub async fn refuse_registration(
        &self,
        actor: Actor,
        id: RegistrationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Registration> {
        self.write(actor, now, async |tx| {
            find_pending(tx, id).await?;
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
    #[boxed_future]
    pub async fn registrations(&self) -> Result<Vec<Registration>> {
        registrations::all(&mut *self.database.read.acquire().await?).await
    }

    /// The divisions, in display order.
    #[boxed_future]
    pub async fn divisions(&self) -> Result<Vec<DivisionName>> {
        divisions::all(&mut *self.database.read.acquire().await?).await
    }

    /// Opens or closes registration, and sets the divisions; `None` leaves a setting unchanged.
    /// [`StoreError::Conflict`] if a division with teams is left out, or one is repeated;
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn change_season(
        &self,
        actor: Actor,
        registration_open: Option<bool>,
        divisions: Option<&[DivisionName]>,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            if let Some(names) = divisions {
                set_divisions(tx, names).await?;
            }
            let is_open = season::read(tx).await?.registration_open;
            if let Some(open) = registration_open.filter(|open| *open != is_open) {
                season::set_registration_open(tx, open).await?;
                let event = match open {
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
    let lowercase = |name: &DivisionName| name.as_str().to_lowercase();
    for (index, name) in names.iter().enumerate() {
        let is_repeated = names[..index]
            .iter()
            .any(|other| lowercase(other) == lowercase(name));
        if is_repeated {
            return StoreError::conflict(format!("divisions: “{name}” is listed twice"));
        }
    }
    let divisions_before = divisions::all(tx).await?;
    for removed in &divisions_before {
        if names
            .iter()
            .any(|name| lowercase(name) == lowercase(removed))
        {
            continue;
        }
        let teams = divisions::teams_in(tx, removed).await?;
        if teams > 0 {
            return StoreError::conflict(format!(
                "divisions: “{removed}” has {teams} teams; move them to another one first (PATCH /api/v1/teams/ID)"
            ));
        }
        divisions::remove(tx, removed).await?;
    }
    for (position, name) in (0..).zip(names) {
        divisions::insert(tx, name, position).await?;
    }
    let divisions = divisions::all(tx).await?;
    if divisions != divisions_before {
        tx.record(Subject::Season, Event::DivisionsSet { divisions });
    }
    Ok(())
}

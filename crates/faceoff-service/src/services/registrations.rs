//! Registrations: a visitor registers a new team, and the organisers approve or refuse it.

use super::{
    accounts::{checked_profile, default_expiry, join_link},
    decision_preview::checked_reason,
};
use crate::{app::AppState, boxed_future, problem::Problem, text, views::invitation};
use faceoff_api::{
    requests::{InvitedRole, RegistrationRequest},
    token::{Secret, SecretKind},
    views::invitation::NewRegistrationView,
};
use faceoff_store::{Actor, NewRegistration, Registration, Requester};
use faceoff_types::RegistrationId;

/// Longest contact of a team.
const MAX_CONTACT_CHARS: usize = 120;

/// Registers a team. The returned link lets the first member join once the organisers have approved the registration.
#[boxed_future]
pub async fn register(
    app: &AppState,
    request: RegistrationRequest,
) -> Result<NewRegistrationView, Problem> {
    let contact = text::single_line("contact", &request.contact, MAX_CONTACT_CHARS)?;
    let (team_name, profile) = checked_profile(request.team)?;
    let secret = Secret::generate(SecretKind::Invitation).map_err(Problem::internal)?;
    let new = NewRegistration {
        code_hash: secret.hash(),
        team_name,
        profile,
        contact,
        accepted_terms: request.accepted_terms,
    };
    let now = app.config.clock.now();
    let registration = app.store.register(new, now).await?;
    tracing::info!(registration = %registration.id, team = %registration.team_name, "registered");
    Ok(NewRegistrationView {
        registration: invitation::registration(registration),
        join_link: join_link(app, secret.as_str()),
        code: secret.as_str().to_owned(),
    })
}

/// Approves a registration and creates the team. `actor` is the cause of the change in the log; `requester` has user and token of the
/// request, which are checked again when the change is committed.
#[boxed_future]
pub async fn approve_registration(
    app: &AppState,
    actor: Actor,
    requester: Requester,
    id: RegistrationId,
) -> Result<Registration, Problem> {
    let now = app.config.clock.now();
    let (registration, team) = app
        .store
        .approve_registration(
            actor,
            id,
            default_expiry(InvitedRole::Member, now),
            requester,
            now,
        )
        .await?;
    tracing::info!(registration = %id, team = %team.name, "registration approved");
    Ok(registration)
}

/// Refuses a registration, with a reason that the team reads.
#[boxed_future]
pub async fn refuse_registration(
    app: &AppState,
    actor: Actor,
    id: RegistrationId,
    reason: &str,
) -> Result<Registration, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let registration = app
        .store
        .refuse_registration(actor, id, reason, now)
        .await?;
    tracing::info!(registration = %id, reason, "registration refused");
    Ok(registration)
}

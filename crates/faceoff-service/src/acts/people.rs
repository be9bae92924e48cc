//! What people do for themselves, and how they leave.

use crate::{
    app::AppState,
    auth::Caller,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{Person, StoreError, Who};
use faceoff_types::PersonId;

/// The people whom the caller may see: an organiser everybody, a team its members.
#[boxed]
pub async fn people(app: &AppState, caller: &Caller) -> Result<Vec<Person>, Problem> {
    let people = match caller.team() {
        Some(team) => app.store.members_of(team.id).await?,
        None => app.store.people().await?,
    };
    Ok(people)
}

/// The person, if the caller is an organiser or that person; a teammate is seen, and not acted for.
#[boxed]
pub async fn find(app: &AppState, caller: &Caller, id: PersonId) -> Result<Person, Problem> {
    let person = match app.store.person(id).await {
        Ok(person) => person,
        Err(StoreError::NotFound(_)) => return Err(Problem::not_found("person")),
        Err(error) => return Err(error.into()),
    };
    let is_self = caller.person().is_some_and(|own| own.id == id);
    if caller.is_organiser() || is_self {
        return Ok(person);
    }
    match (&caller.who, person.team) {
        (Who::Member(_, own) | Who::Team(own), Some(team)) if own.id == team => Err(Problem::new(
            ProblemKind::Forbidden,
            "only that person may do this, or an organiser",
        )),
        _ => Err(Problem::not_found("person")),
    }
}

/// Lets a person do nothing any more, once that is confirmed with their name.
#[boxed]
pub async fn remove_person(
    app: &AppState,
    caller: &Caller,
    id: PersonId,
    confirm: Option<&str>,
) -> Result<Person, Problem> {
    let person = find(app, caller, id).await?;
    let what = format!(
        "{} could do nothing any more, at once and for good: all tokens and sessions would be revoked; the name stays \
         with what was done",
        person.name
    );
    Problem::check_confirmed(confirm, person.name.as_str(), &what)?;
    let now = app.config.clock.now();
    let person = app.store.remove_person(caller.actor(), id, now).await?;
    tracing::info!(person = %id, actor = %caller.actor(), "person removed");
    Ok(person)
}

/// The calling person accepts the terms.
#[boxed]
pub async fn accept_terms(
    app: &AppState,
    caller: &Caller,
    version: u32,
) -> Result<Person, Problem> {
    let Some(person) = caller.person() else {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "people accept terms; this token is no person's. A member of the team does so with their own token",
        ));
    };
    let now = app.config.clock.now();
    let accepted = app
        .store
        .accept_terms(caller.actor(), person.id, version, now)
        .await?;
    Ok(accepted)
}

//! What organisers tell, and what teams ask.

use crate::{
    app::AppState,
    auth::{Caller, TeamCaller},
    boxed,
    problem::Problem,
    text,
    views::announcement,
};
use faceoff_api::{
    requests::{NewAnnouncement, NewAnswer, NewQuestion, NewTerms},
    views::announcement::{AnnouncementView, QuestionView, TermsView},
};
use faceoff_store::Actor;
use faceoff_types::QuestionId;

const TITLE_CHARS: usize = 120;
const TEXT_CHARS: usize = 5_000;
const QUESTION_CHARS: usize = 2_000;
const TERMS_CHARS: usize = 20_000;

/// Tells everybody; what was told stays.
#[boxed]
pub async fn announce(
    app: &AppState,
    actor: Actor,
    new: &NewAnnouncement,
) -> Result<AnnouncementView, Problem> {
    let title = text::line("title", &new.title, TITLE_CHARS)?;
    let body = text::lines("text", &new.text, TEXT_CHARS)?;
    let now = app.config.clock.now();
    let announced = app.store.announce(actor, &title, &body, now).await?;
    tracing::info!(announcement = %announced.id, "announced");
    Ok(announcement::of(announced))
}

/// Questions, the newest first: for everybody those with a public answer, for a team also its own, for organisers all.
#[boxed]
pub async fn questions(
    app: &AppState,
    caller: Option<&Caller>,
) -> Result<Vec<QuestionView>, Problem> {
    let questions = app.store.questions().await?.into_iter();
    let shown = questions.filter_map(|question| {
        let is_theirs = caller
            .zip(question.team)
            .is_some_and(|(caller, team)| caller.may_see(team));
        let is_public = question
            .answer
            .as_ref()
            .is_some_and(|answer| answer.is_public);
        (is_theirs || is_public).then(|| announcement::question(question, is_theirs))
    });
    Ok(shown.collect())
}

#[boxed]
pub async fn ask(
    app: &AppState,
    caller: &TeamCaller,
    new: &NewQuestion,
) -> Result<QuestionView, Problem> {
    let text = text::lines("text", &new.text, QUESTION_CHARS)?;
    let now = app.config.clock.now();
    let team = &caller.team;
    let question = app.store.ask(caller.actor(), team.id, &text, now).await?;
    tracing::info!(question = %question.id, team = %team.name, "asked");
    Ok(announcement::question(question, true))
}

/// Answers a question, or answers it anew.
#[boxed]
pub async fn answer(
    app: &AppState,
    actor: Actor,
    id: QuestionId,
    new: &NewAnswer,
) -> Result<QuestionView, Problem> {
    let text = text::lines("text", &new.text, TEXT_CHARS)?;
    let now = app.config.clock.now();
    let question = app.store.answer(actor, id, &text, new.public, now).await?;
    tracing::info!(question = %id, public = new.public, "answered");
    Ok(announcement::question(question, true))
}

/// Publishes other terms: teams upload and choose again once a member has accepted them.
#[boxed]
pub async fn publish_terms(
    app: &AppState,
    actor: Actor,
    new: &NewTerms,
) -> Result<TermsView, Problem> {
    let text = text::lines("text", &new.text, TERMS_CHARS)?;
    let now = app.config.clock.now();
    let terms = app.store.publish_terms(actor, &text, now).await?;
    tracing::info!(version = terms.version, "terms published");
    Ok(announcement::terms(terms))
}

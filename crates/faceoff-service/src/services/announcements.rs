//! Announcements of the organisers, questions of teams with their answers, and the season's terms of participation.

use crate::{
    app::AppState,
    auth::{Caller, TeamCaller},
    boxed_future,
    problem::Problem,
    text,
    views::announcement,
};
use faceoff_api::{
    requests::{NewAnnouncement, NewAnswer, NewQuestion, NewTerms},
    views::announcement::QuestionView,
};
use faceoff_store::{Actor, Announcement, Question, Terms};
use faceoff_types::{QuestionId, TeamId};

/// Longest title of an announcement.
const MAX_TITLE_CHARS: usize = 120;
/// Longest text of an announcement or an answer.
const MAX_TEXT_CHARS: usize = 5_000;
const MAX_QUESTION_CHARS: usize = 2_000;
const MAX_TERMS_CHARS: usize = 20_000;

/// Publishes an announcement. It cannot be changed.
#[boxed_future]
pub async fn announce(
    app: &AppState,
    actor: Actor,
    new: &NewAnnouncement,
) -> Result<Announcement, Problem> {
    let title = text::single_line("title", &new.title, MAX_TITLE_CHARS)?;
    let body = text::multi_line("text", &new.text, MAX_TEXT_CHARS)?;
    let now = app.config.clock.now();
    let announcement = app.store.announce(actor, &title, &body, now).await?;
    tracing::info!(announcement = %announcement.id, "announcement published");
    Ok(announcement)
}

/// Is this the newest announcement already? A form that is sent twice must not publish it twice.
#[boxed_future]
pub async fn is_newest(app: &AppState, new: &NewAnnouncement) -> Result<bool, Problem> {
    let title = text::single_line("title", &new.title, MAX_TITLE_CHARS)?;
    let body = text::multi_line("text", &new.text, MAX_TEXT_CHARS)?;
    let newest = app.store.announcements(1).await?;
    Ok(newest
        .first()
        .is_some_and(|newest| newest.title == title && newest.text == body))
}

/// Has the team asked this already, without an answer yet? A form that is sent twice must not ask it twice.
#[boxed_future]
pub async fn is_open_question(
    app: &AppState,
    team: TeamId,
    new: &NewQuestion,
) -> Result<bool, Problem> {
    let text = text::multi_line("text", &new.text, MAX_QUESTION_CHARS)?;
    let questions = app.store.questions().await?;
    Ok(questions.iter().any(|question| {
        question.team == Some(team) && question.answer.is_none() && question.text == text
    }))
}

/// Questions, newest first. Visitors see those with a public answer, teams also their own, organisers all.
#[boxed_future]
pub async fn questions(
    app: &AppState,
    caller: Option<&Caller>,
) -> Result<Vec<QuestionView>, Problem> {
    let questions = app.store.questions().await?.into_iter();
    let views = questions.filter_map(|question| {
        let may_see_team = caller
            .zip(question.team)
            .is_some_and(|(caller, team)| caller.may_see(team));
        let is_public = question
            .answer
            .as_ref()
            .is_some_and(|answer| answer.is_public);
        (may_see_team || is_public).then(|| announcement::question(question, may_see_team))
    });
    Ok(views.collect())
}

/// Stores a team's question to the organisers.
#[boxed_future]
pub async fn ask(
    app: &AppState,
    caller: &TeamCaller,
    new: &NewQuestion,
) -> Result<Question, Problem> {
    let text = text::multi_line("text", &new.text, MAX_QUESTION_CHARS)?;
    let now = app.config.clock.now();
    let team = &caller.team;
    let question = app.store.ask(caller.actor(), team.id, &text, now).await?;
    tracing::info!(question = %question.id, team = %team.name, "asked");
    Ok(question)
}

/// Answers a question, or replaces its answer.
#[boxed_future]
pub async fn answer(
    app: &AppState,
    actor: Actor,
    id: QuestionId,
    new: &NewAnswer,
) -> Result<Question, Problem> {
    let text = text::multi_line("text", &new.text, MAX_TEXT_CHARS)?;
    let now = app.config.clock.now();
    let question = app.store.answer(actor, id, &text, new.public, now).await?;
    tracing::info!(question = %id, public = new.public, "answered");
    Ok(question)
}

/// Publishes a new version of the terms. Teams can upload and activate submissions again once a member has accepted it.
#[boxed_future]
pub async fn publish_terms(app: &AppState, actor: Actor, new: &NewTerms) -> Result<Terms, Problem> {
    let text = text::multi_line("text", &new.text, MAX_TERMS_CHARS)?;
    let now = app.config.clock.now();
    let terms = app.store.publish_terms(actor, &text, now).await?;
    tracing::info!(version = terms.version, "terms published");
    Ok(terms)
}

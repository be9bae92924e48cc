//! Path parameters of URLs that identify an episode: one attempt of an agent at a task.

use crate::{
    app::App,
    extract::PathParams,
    problem::{Problem, ProblemKind},
};
use axum::{extract::FromRequestParts, http::request::Parts};
use faceoff_types::{EvaluationId, Profile, SubmissionId, Task};
use std::{fmt::Display, str::FromStr};

/// An episode of an evaluation: the parameters `{id}`, `{task}` and `{episode}` of the path.
#[derive(Debug, Clone, Copy)]
pub struct EpisodePath {
    pub id: EvaluationId,
    pub task: Task,
    /// Number of the episode, from 0.
    pub episode: u32,
}

impl FromRequestParts<App> for EpisodePath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let PathParams([id, task, episode]) =
            PathParams::<String, 3>::from_request_parts(parts, app).await?;
        Ok(Self {
            id: parse(&id, "evaluation")?,
            task: known_task(app, &task)?,
            episode: parse(&episode, "episode")?,
        })
    }
}

/// An episode of a submission's ablation, which runs the submission without perturbations, with each kind alone, and with
/// all: the parameters `{id}`, `{profile}`, `{task}` and `{episode}` of the path.
#[derive(Debug, Clone, Copy)]
pub struct AblationPath {
    pub submission: SubmissionId,
    /// The perturbations of this episode.
    pub profile: Profile,
    pub task: Task,
    /// Number of the episode, from 0.
    pub episode: u32,
}

impl FromRequestParts<App> for AblationPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let PathParams([id, profile, task, episode]) =
            PathParams::<String, 4>::from_request_parts(parts, app).await?;
        Ok(Self {
            submission: parse(&id, "submission")?,
            profile: known_profile(app, &profile)?,
            task: known_task(app, &task)?,
            episode: parse(&episode, "episode")?,
        })
    }
}

fn known_task(app: &App, name: &str) -> Result<Task, Problem> {
    let found = app.config.competition().find_task(name);
    found.map_err(|error| Problem::new(ProblemKind::NotFound, error.to_string()))
}

fn known_profile(app: &App, name: &str) -> Result<Profile, Problem> {
    let found = app.config.competition().find_profile(name);
    found.map_err(|error| Problem::new(ProblemKind::NotFound, format!("profile {name:?}: {error}")))
}

/// Parses a path parameter; `name` is for the message. A parameter that cannot be parsed gives 404, as an unknown id does.
fn parse<T: FromStr<Err: Display>>(text: &str, name: &str) -> Result<T, Problem> {
    text.parse().map_err(|error: T::Err| {
        Problem::new(ProblemKind::NotFound, format!("{name} {text:?}: {error}"))
    })
}

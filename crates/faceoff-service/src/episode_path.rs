//! An episode, as paths name it.

use crate::{
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
    /// Its number, from 0.
    pub episode: u32,
}

impl<S: Send + Sync> FromRequestParts<S> for EpisodePath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([id, task, episode]) =
            PathParams::<String, 3>::from_request_parts(parts, state).await?;
        Ok(Self {
            id: parsed(&id, "evaluation")?,
            task: parsed(&task, "task")?,
            episode: parsed(&episode, "episode")?,
        })
    }
}

/// An episode of a submission's ablation: the parameters `{id}`, `{profile}`, `{task}` and `{episode}` of the path.
#[derive(Debug, Clone, Copy)]
pub struct AblationPath {
    pub submission: SubmissionId,
    /// Of which of the ablation's profiles.
    pub profile: Profile,
    pub task: Task,
    /// Its number, from 0.
    pub episode: u32,
}

impl<S: Send + Sync> FromRequestParts<S> for AblationPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([id, profile, task, episode]) =
            PathParams::<String, 4>::from_request_parts(parts, state).await?;
        Ok(Self {
            submission: parsed(&id, "submission")?,
            profile: parsed(&profile, "profile")?,
            task: parsed(&task, "task")?,
            episode: parsed(&episode, "episode")?,
        })
    }
}

/// What cannot be one is none.
fn parsed<T: FromStr<Err: Display>>(text: &str, what: &str) -> Result<T, Problem> {
    text.parse().map_err(|error: T::Err| {
        Problem::new(ProblemKind::NotFound, format!("{what} {text:?}: {error}"))
    })
}

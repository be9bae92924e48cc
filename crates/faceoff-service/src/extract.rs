//! Extractors: they parse bodies, forms, queries and path parameters of requests. A refused request gets a problem response
//! that names the wrong field.

use crate::{
    boxed_future,
    problem::{Problem, ProblemKind},
    session,
};
use axum::{
    Form,
    body::Bytes,
    extract::{
        FromRequest, FromRequestParts, Query, RawPathParams, Request, rejection::BytesRejection,
    },
    http::{StatusCode, header, request::Parts},
};
use faceoff_api::objects_only;
use faceoff_types::StageDay;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::{fmt::Display, str::FromStr};

/// Largest JSON body; the largest legitimate one has a few hundred bytes.
pub const MAX_JSON_BYTES: usize = 64 * 1024;

/// A JSON body.
#[derive(Debug)]
pub struct Json<T>(pub T);

impl<S, T> FromRequest<S> for Json<T>
where
    S: Send + Sync,
    T: DeserializeOwned,
{
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        parse_json(read_body(request).await?).map(Self)
    }
}

/// A JSON body that may be empty.
#[derive(Debug)]
pub struct OptionalJson<T>(pub T);

impl<S, T> FromRequest<S> for OptionalJson<T>
where
    S: Send + Sync,
    T: DeserializeOwned + Default,
{
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        let (is_json, bytes) = read_body(request).await?;
        if bytes.is_empty() {
            return Ok(Self(T::default()));
        }
        parse_json((is_json, bytes)).map(Self)
    }
}

/// Whether the media type of the body is JSON, and the body.
#[boxed_future]
async fn read_body(request: Request) -> Result<(bool, Bytes), Problem> {
    let is_json = request
        .headers()
        .get(header::CONTENT_TYPE)
        .and_then(|value| value.to_str().ok())
        .and_then(|value| value.split(';').next())
        .is_some_and(|media_type| media_type.trim().eq_ignore_ascii_case("application/json"));
    let bytes = Bytes::from_request(request, &())
        .await
        .map_err(|rejection| body_problem(&rejection))?;
    Ok((is_json, bytes))
}

fn body_problem(rejection: &BytesRejection) -> Problem {
    if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
        Problem::new(
            ProblemKind::TooLarge,
            format!(
                "expected at most {MAX_JSON_BYTES} bytes of JSON, got more; send a smaller body"
            ),
        )
        .with("limit_bytes", MAX_JSON_BYTES)
    } else {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "the body could not be read to its end: {}; send it again",
                rejection.body_text()
            ),
        )
    }
}

fn parse_json<T: DeserializeOwned>((is_json, bytes): (bool, Bytes)) -> Result<T, Problem> {
    if !is_json {
        return Err(Problem::new(
            ProblemKind::UnsupportedMediaType,
            "expected a JSON body; send it with the header “Content-Type: application/json”",
        ));
    }
    let invalid_content = |error| {
        Problem::new(
            ProblemKind::InvalidContent,
            format!("the JSON does not fit: {error}"),
        )
    };
    let mut deserializer = serde_json::Deserializer::from_slice(&bytes);
    // The error messages of some types do not name the field, so the path to it is recorded.
    let parsed = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        if error.inner().is_data() {
            invalid_content(error)
        } else {
            Problem::new(
                ProblemKind::InvalidRequest,
                format!("the body is not valid JSON: {}", error.inner()),
            )
        }
    })?;
    // Text after the JSON value is an error, too.
    let end = deserializer.end();
    let value = end.and_then(|()| serde_json::from_slice::<Value>(&bytes));
    let value = value.map_err(|error| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!("the body is not valid JSON: {error}"),
        )
    })?;
    // Serde would also accept an array of the fields in place of an object.
    objects_only::check::<T>(&value).map_err(invalid_content)?;
    Ok(parsed)
}

/// A form submitted by a page of this server.
#[derive(Debug)]
pub struct PageForm<T>(pub T);

impl<S, T> FromRequest<S> for PageForm<T>
where
    S: Send + Sync,
    T: DeserializeOwned,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        session::check_same_origin(request.headers())?;
        let Form(form) = Form::from_request(request, state)
            .await
            .map_err(|rejection| {
                let detail = format!("the form is malformed: {}", rejection.body_text());
                Problem::new(ProblemKind::InvalidRequest, detail)
            })?;
        Ok(Self(form))
    }
}

/// The `N` path parameters, in order.
#[derive(Debug)]
pub struct PathParams<T, const N: usize>(pub [T; N]);

impl<S, T, const N: usize> FromRequestParts<S> for PathParams<T, N>
where
    S: Send + Sync,
    T: FromStr<Err: Display>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let params = path_params(parts).await?;
        let params = params.iter().map(|text| parse_path_param(text));
        let params: Vec<T> = params.collect::<Result<_, _>>()?;
        params.try_into().map(Self).map_err(|params: Vec<T>| {
            Problem::internal(format_args!(
                "a path of {N} parameters has {}",
                params.len()
            ))
        })
    }
}

#[boxed_future]
async fn path_params(parts: &mut Parts) -> Result<Vec<String>, Problem> {
    let params = RawPathParams::from_request_parts(parts, &())
        .await
        .map_err(|rejection| no_such_path(&rejection.body_text()))?;
    Ok(params.iter().map(|(_, text)| text.to_owned()).collect())
}

/// Parses one of the path parameters of a path that has different types of them.
///
/// # Errors
/// `NotFound`, as for an unknown id.
pub fn parse_path_param<T: FromStr<Err: Display>>(text: &str) -> Result<T, Problem> {
    text.parse().map_err(|error: T::Err| no_such_path(&error))
}

/// The problem of a path parameter that cannot be parsed: 404, as for an unknown id.
fn no_such_path(error: &dyn Display) -> Problem {
    Problem::new(ProblemKind::NotFound, error.to_string())
}

/// The path parameter of a route with exactly one.
#[derive(Debug)]
pub struct PathParam<T>(pub T);

impl<S, T> FromRequestParts<S> for PathParam<T>
where
    S: Send + Sync,
    T: FromStr<Err: Display>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([param]) = PathParams::from_request_parts(parts, state).await?;
        Ok(Self(param))
    }
}

/// The path parameters of an evaluation day: a stage's id and a date.
#[derive(Debug)]
pub struct StageDayPath(pub StageDay);

impl<S: Send + Sync> FromRequestParts<S> for StageDayPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([stage, date]) =
            PathParams::<String, 2>::from_request_parts(parts, state).await?;
        match (stage.parse(), date.parse()) {
            (Ok(stage), Ok(date)) => Ok(Self(StageDay { stage, date })),
            _ => Err(Problem::not_found("day")),
        }
    }
}

/// The query parameters.
#[derive(Debug)]
pub struct QueryParams<T>(pub T);

impl<S, T> FromRequestParts<S> for QueryParams<T>
where
    S: Send + Sync,
    T: DeserializeOwned,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        Query::from_request_parts(parts, state)
            .await
            .map(|Query(query)| Self(query))
            .map_err(|rejection| Problem::new(ProblemKind::InvalidRequest, rejection.body_text()))
    }
}

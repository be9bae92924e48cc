//! How commands name submissions and evaluations: by an id, by a part of one, by `latest`, or by a team and a day.

use crate::client::{Client, is_refused_with};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::requests::{BoardBy, BoardQuery};
use faceoff_types::{EvaluationId, SubmissionId};
use jiff::civil::Date;
use reqwest::StatusCode;
use std::{collections::BTreeSet, fmt::Display, iter, str::FromStr};

/// Number of the team's newest evaluations among which a part of an id is looked up.
const NEWEST_EVALUATIONS: usize = 200;
/// Shortest part of an id, in characters.
const MIN_PART_CHARS: usize = 4;

/// A submission on the command line.
#[derive(Debug, Args)]
pub(super) struct SubmissionArg {
    /// The submission: its id, the beginning or end of one of your team's ids, or `latest`
    #[arg(value_name = "SUBMISSION")]
    submission: String,
}

/// An evaluation on the command line.
#[derive(Debug, Args)]
pub(super) struct EvaluationArg {
    /// The evaluation: its id, the beginning or end of one of your team's ids, `latest`, or a team and a day (my-team
    /// 2026-11-21)
    #[arg(value_name = "EVALUATION", num_args = 1..=2, required = true)]
    evaluation: Vec<String>,
}

/// A reference to something with an id.
#[derive(Debug, PartialEq, Eq)]
enum Reference<Id> {
    Id(Id),
    Latest,
    /// The beginning or end of an id.
    Part(String),
    /// Anything else.
    Other,
}

impl<Id: FromStr> Reference<Id> {
    fn parse(text: &str) -> Self {
        let is_part = text.len() >= MIN_PART_CHARS
            && text
                .bytes()
                .all(|byte| byte.is_ascii_hexdigit() || byte == b'-');
        match text.parse() {
            Ok(id) => Self::Id(id),
            Err(_) if text == "latest" => Self::Latest,
            Err(_) if is_part => Self::Part(text.to_ascii_lowercase()),
            Err(_) => Self::Other,
        }
    }
}

/// The only one of these ids, the newest first, that begins or ends with `part`.
fn find_part<Id: Display + Copy>(ids: &[Id], part: &str, kind: &str) -> anyhow::Result<Id> {
    let is_named = |id: &&Id| {
        let id = id.to_string();
        id.starts_with(part) || id.ends_with(part)
    };
    let found: Vec<Id> = ids.iter().filter(is_named).copied().collect();
    match found[..] {
        [id] => Ok(id),
        [] => bail!("your team has no {kind} whose id begins or ends with {part}"),
        _ => bail!(
            "{} of your team's {kind}s have an id that begins or ends with {part}; give more characters, such as the last 8",
            found.len()
        ),
    }
}

impl SubmissionArg {
    /// The submission's id; asks the server if the argument is not an id.
    pub(super) async fn find(&self, client: &Client) -> anyhow::Result<SubmissionId> {
        find_submission(client, &self.submission).await
    }
}

/// The submission that a text names.
pub(super) async fn find_submission(client: &Client, text: &str) -> anyhow::Result<SubmissionId> {
    let reference = Reference::parse(text);
    if let Reference::Id(id) = reference {
        return Ok(id);
    }
    if reference == Reference::Other {
        bail!(
            "{text:?}: expected the id of a submission, a part of at least {MIN_PART_CHARS} characters of it, or `latest`"
        );
    }
    let submissions = client.submissions().await?;
    let ids: Vec<SubmissionId> = submissions.iter().map(|submission| submission.id).collect();
    match &reference {
        Reference::Part(part) => find_part(&ids, part, "submission"),
        _ => ids
            .first()
            .copied()
            .context("your team has no submission yet; upload one with faceoff submit BUNDLE"),
    }
}

impl EvaluationArg {
    /// The evaluation's id; asks the server if the argument is not an id.
    pub(super) async fn find(&self, client: &Client) -> anyhow::Result<EvaluationId> {
        find_evaluation(client, &self.evaluation.join(" ")).await
    }
}

/// The evaluation that a text names.
pub(super) async fn find_evaluation(client: &Client, text: &str) -> anyhow::Result<EvaluationId> {
    match Reference::parse(text) {
        Reference::Id(id) => Ok(id),
        Reference::Latest => {
            let newest = client.newest_evaluations(1).await?;
            let newest = newest.first().map(|evaluation| evaluation.id);
            newest.context("your team has no evaluation yet")
        }
        Reference::Part(part) => {
            let evaluations = client.newest_evaluations(NEWEST_EVALUATIONS).await?;
            let ids: Vec<EvaluationId> = evaluations.iter().map(|found| found.id).collect();
            find_part(&ids, &part, "evaluation")
        }
        Reference::Other => match text
            .rsplit_once(' ')
            .and_then(|(team, day)| Some((team.trim(), day.parse().ok()?)))
        {
            Some((team, day)) => find_by_day(client, team, day).await,
            None => bail!(
                "{text:?}: expected the id of an evaluation, a part of at least {MIN_PART_CHARS} characters of it, `latest`, or a team \
                 and a day, such as my-team 2026-11-21"
            ),
        },
    }
}

/// The evaluation of a team on a day. First it is looked for among those that the caller may see by a token, even before their release.
/// Then follow the public boards of that day, that of the current stage first.
async fn find_by_day(client: &Client, team: &str, day: Date) -> anyhow::Result<EvaluationId> {
    let visible = none_on_expected_error(client.evaluations(Some(day)).await, is_access_refused)?
        .unwrap_or_default();
    let has_name = |name: &str| name.to_lowercase() == team.to_lowercase();
    if let Some(evaluation) = visible
        .iter()
        .find(|found| has_name(found.team_name.as_str()))
    {
        return Ok(evaluation.id);
    }
    let mut teams_with_results = BTreeSet::new();
    let stages =
        none_on_expected_error(client.stages().await, is_access_refused)?.unwrap_or_default();
    let other_stages = stages.iter().map(|stage| Some(stage.id));
    for stage in iter::once(None).chain(other_stages) {
        // With `Latest` the board has each team's newest result up to the day, so its day may be an earlier one.
        let query = BoardQuery {
            stage,
            day: Some(day),
            by: Some(BoardBy::Latest),
            ..BoardQuery::default()
        };
        let has_no_board = |error: &anyhow::Error| {
            is_access_refused(error) || is_refused_with(error, StatusCode::NOT_FOUND)
        };
        let board = none_on_expected_error(client.board(None, &query).await, has_no_board)?;
        for row in board.into_iter().flat_map(|board| board.rows) {
            if row.day == day && has_name(row.team.as_str()) {
                return Ok(row.evaluation);
            }
            if row.day == day {
                teams_with_results.insert(row.team.to_string());
            }
        }
    }
    if teams_with_results.is_empty() {
        bail!("no results of {day} are public");
    }
    let names: Vec<String> = teams_with_results.into_iter().collect();
    bail!(
        "{team:?} has no public result of {day}; these teams have one: {}",
        names.join(", ")
    )
}

/// Whether the server refused the request because the caller may not see the data.
fn is_access_refused(error: &anyhow::Error) -> bool {
    [StatusCode::UNAUTHORIZED, StatusCode::FORBIDDEN]
        .into_iter()
        .any(|status| is_refused_with(error, status))
}

/// The response; `None` if it is an error for which `is_expected` is true.
fn none_on_expected_error<T>(
    response: anyhow::Result<T>,
    is_expected: impl Fn(&anyhow::Error) -> bool,
) -> anyhow::Result<Option<T>> {
    match response {
        Ok(found) => Ok(Some(found)),
        Err(error) if is_expected(&error) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_are_parsed() {
        let id = EvaluationId::new();
        let parse = Reference::<EvaluationId>::parse;
        assert_eq!(parse(&id.to_string()), Reference::Id(id));
        assert_eq!(parse("latest"), Reference::Latest);
        assert_eq!(parse("01AF-9"), Reference::Part("01af-9".to_owned()));
        for text in ["abc", "my-team 2026-11-21", "newest", ""] {
            assert_eq!(parse(text), Reference::Other, "{text}");
        }
    }

    #[test]
    fn part_of_an_id_names_the_only_match() {
        let ids: Vec<EvaluationId> = (1..=3)
            .map(|n| format!("01900000-0000-7000-8000-{n:012}").parse().unwrap())
            .collect();
        let find =
            |part: &str| find_part(&ids, part, "evaluation").map_err(|error| error.to_string());
        assert_eq!(find("0002"), Ok(ids[1]));
        assert_eq!(find("8000-000000000003"), Ok(ids[2]));
        assert!(
            find("0190")
                .unwrap_err()
                .starts_with("3 of your team's evaluations")
        );
        assert!(
            find("beef")
                .unwrap_err()
                .starts_with("your team has no evaluation")
        );
    }

    #[test]
    fn only_hidden_evaluations_are_no_error() {
        let refused = |status: u16| -> anyhow::Result<()> {
            Err(crate::client::ApiError {
                status: StatusCode::from_u16(status).unwrap(),
                kind: String::new(),
                title: String::new(),
                detail: String::new(),
            }
            .into())
        };
        for status in [401, 403] {
            assert_eq!(
                none_on_expected_error(refused(status), is_access_refused).unwrap(),
                None
            );
        }
        for status in [404, 429, 500] {
            assert!(
                none_on_expected_error(refused(status), is_access_refused).is_err(),
                "{status}"
            );
        }
    }
}

//! Exit statuses of the commands; docs/cli.md has the same table.

use crate::client::{ApiError, Unreachable};
use reqwest::StatusCode;
use std::process::ExitCode;

/// The exit status of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// The command succeeded.
    Done = 0,
    /// The command failed or found a problem: an invalid agent, faults, a difference, a host with missing features.
    Failed = 1,
    /// The command line is invalid, or `faceoff verify` cannot read or simulate the recording.
    Misused = 2,
    /// The server refused the request, with a reason.
    Refused = 3,
    /// The server did not answer, or not as expected.
    Unreachable = 4,
    /// The caller is not signed in, the token is invalid, or its account lacks the permission.
    NotAllowed = 5,
}

/// A token is needed, but there is none.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotSignedIn(pub String);

impl Exit {
    /// The exit status of an error.
    pub fn of(error: &anyhow::Error) -> Self {
        if error.downcast_ref::<NotSignedIn>().is_some() {
            return Self::NotAllowed;
        }
        // A `reqwest::Error` means that the response was interrupted.
        if error.downcast_ref::<Unreachable>().is_some()
            || error.chain().any(|cause| cause.is::<reqwest::Error>())
        {
            return Self::Unreachable;
        }
        match error.downcast_ref::<ApiError>().map(|error| error.status) {
            Some(StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN) => Self::NotAllowed,
            Some(status) if status.is_server_error() => Self::Unreachable,
            Some(_) => Self::Refused,
            None => Self::Failed,
        }
    }

    /// The exit status of a command; prints an error with its causes to standard error.
    pub fn from_outcome(outcome: anyhow::Result<()>) -> Self {
        match outcome {
            Ok(()) => Self::Done,
            // The reader of the output has closed the pipe, as in `faceoff sim trace | head`; that is no error.
            Err(error) if Self::of(&error) == Self::Failed && is_broken_pipe(&error) => Self::Done,
            Err(error) => {
                eprintln!("error: {error:#}");
                Self::of(&error)
            }
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    const ALL: [Exit; 6] = [
        Exit::Done,
        Exit::Failed,
        Exit::Misused,
        Exit::Refused,
        Exit::Unreachable,
        Exit::NotAllowed,
    ];

    /// The name as words: `NotAllowed` becomes `not allowed`.
    fn words(exit: Exit) -> String {
        let mut words = String::new();
        for letter in format!("{exit:?}").chars() {
            if letter.is_uppercase() && !words.is_empty() {
                words.push(' ');
            }
            words.push(letter.to_ascii_lowercase());
        }
        words
    }

    #[test]
    fn documented_statuses_match() {
        let documented = include_str!("../../../docs/cli.md");
        let (_, table) = documented.split_once("## Exit status").unwrap();
        let rows: Vec<_> = table
            .lines()
            .skip_while(|line| !line.starts_with("|---"))
            .skip(1)
            .take_while(|line| line.starts_with('|'))
            .collect();
        assert_eq!(rows.len(), ALL.len(), "{rows:?}");
        for (row, exit) in rows.iter().zip(ALL) {
            let expected = format!("| {} | {}", exit as u8, words(exit));
            assert!(
                row.starts_with(&expected),
                "{row:?} does not begin with {expected:?}"
            );
        }
    }

    #[test]
    fn closed_pipe_is_no_failure_but_a_lost_server_is() {
        let broken_pipe = || std::io::Error::from(std::io::ErrorKind::BrokenPipe);
        let output = anyhow::Error::from(broken_pipe()).context("writing");
        assert_eq!(Exit::from_outcome(Err(output)), Exit::Done);
        let connection =
            anyhow::Error::from(broken_pipe()).context(Unreachable("the server hung up".into()));
        assert_eq!(Exit::from_outcome(Err(connection)), Exit::Unreachable);
    }

    /// The exit status after a response with this HTTP status.
    fn exit_after(status: u16) -> Exit {
        let error = ApiError {
            status: StatusCode::from_u16(status).unwrap(),
            kind: String::new(),
            title: "Title".into(),
            detail: "detail".into(),
        };
        Exit::of(&anyhow::Error::from(error).context("requesting"))
    }

    #[test]
    fn api_errors_have_distinct_statuses() {
        for (status, exit) in [
            (401, Exit::NotAllowed),
            (403, Exit::NotAllowed),
            (404, Exit::Refused),
            (409, Exit::Refused),
            (429, Exit::Refused),
            (500, Exit::Unreachable),
            (503, Exit::Unreachable),
        ] {
            assert_eq!(exit_after(status), exit, "{status}");
        }
        let unreachable: anyhow::Result<()> =
            Err(anyhow!("connection refused").context(Unreachable("x".into())));
        assert_eq!(
            Exit::of(&unreachable.context("requesting").unwrap_err()),
            Exit::Unreachable
        );
        assert_eq!(
            Exit::of(&NotSignedIn("no token".into()).into()),
            Exit::NotAllowed
        );
        assert_eq!(Exit::of(&anyhow!("no such file")), Exit::Failed);
        let pipe = std::io::Error::from(std::io::ErrorKind::BrokenPipe);
        assert_eq!(Exit::from_outcome(Err(pipe.into())), Exit::Done);
    }
}

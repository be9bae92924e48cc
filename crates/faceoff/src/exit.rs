//! The statuses that commands end with; docs/cli.md has the same table.

use crate::client::{ApiError, Unreachable};
use reqwest::StatusCode;
use std::process::ExitCode;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// It did what was asked.
    Done = 0,
    /// It did not, or what it looked at is not well: an invalid agent, faults, a difference, a host that lacks something.
    Failed = 1,
    /// What was given cannot be used: the command line is not understood, or there is nothing to verify.
    Misused = 2,
    /// The server refused, with a reason.
    Refused = 3,
    /// The server did not answer, or not as it should.
    Unreachable = 4,
    /// The server does not know who is asking, or that is not for them.
    NotAllowed = 5,
}

/// There is no token where one is needed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotSignedIn(pub String);

impl Exit {
    /// What an error comes to.
    pub fn of(error: &anyhow::Error) -> Self {
        if error.downcast_ref::<NotSignedIn>().is_some() {
            return Self::NotAllowed;
        }
        // The second: an answer that broke off.
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

    /// Of a command: done, or the error with its causes on standard error.
    pub fn from_outcome(outcome: anyhow::Result<()>) -> Self {
        match outcome {
            Ok(()) => Self::Done,
            // The reader of our output went away, as in `faceoff sim trace | head`: nothing to report.
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

    /// In a sentence: `NotAllowed` is `not allowed`.
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
    fn the_documented_statuses_are_these() {
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
    fn a_reader_that_went_away_is_no_failure_and_a_server_that_did_is() {
        let gone = || std::io::Error::from(std::io::ErrorKind::BrokenPipe);
        let ours = anyhow::Error::from(gone()).context("writing");
        assert_eq!(Exit::from_outcome(Err(ours)), Exit::Done);
        let theirs = anyhow::Error::from(gone()).context(Unreachable("the server hung up".into()));
        assert_eq!(Exit::from_outcome(Err(theirs)), Exit::Unreachable);
    }

    fn refused(status: u16) -> Exit {
        let error = ApiError {
            status: StatusCode::from_u16(status).unwrap(),
            title: "Title".into(),
            detail: "detail".into(),
        };
        Exit::of(&anyhow::Error::from(error).context("asking"))
    }

    #[test]
    fn a_refusal_a_silence_and_a_stranger_are_told_apart() {
        for (status, exit) in [
            (401, Exit::NotAllowed),
            (403, Exit::NotAllowed),
            (404, Exit::Refused),
            (409, Exit::Refused),
            (429, Exit::Refused),
            (500, Exit::Unreachable),
            (503, Exit::Unreachable),
        ] {
            assert_eq!(refused(status), exit, "{status}");
        }
        let silent: anyhow::Result<()> =
            Err(anyhow!("connection refused").context(Unreachable("x".into())));
        assert_eq!(
            Exit::of(&silent.context("asking").unwrap_err()),
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

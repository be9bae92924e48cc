//! [`Actor`]: the person, client or process that caused an event.

use super::parse_error::ParseEventError;
use faceoff_types::{TeamId, UserId};
use std::{fmt, str::FromStr};

/// The cause of a change.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Actor {
    /// An organiser without a user account: by the operator's token, or by the server's configuration.
    Operator,
    /// A client with a token of the team itself.
    Team(TeamId),
    /// A user, organiser or member.
    User(UserId),
    /// A person without an account.
    Visitor,
    /// The server's schedule, which starts and ends evaluation days.
    Schedule,
    /// A worker's slot, by the name under which it claims jobs.
    Worker(String),
    /// Automatic work of the server: clean-up, derived data.
    Server,
}

impl fmt::Display for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Operator => f.write_str("organiser"),
            Self::Team(id) => write!(f, "team:{id}"),
            Self::User(id) => write!(f, "person:{id}"),
            Self::Visitor => f.write_str("visitor"),
            Self::Schedule => f.write_str("schedule"),
            Self::Worker(name) => write!(f, "worker:{name}"),
            Self::Server => f.write_str("server"),
        }
    }
}

impl FromStr for Actor {
    type Err = ParseEventError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let unknown = || ParseEventError(s.to_owned());
        Ok(match s.split_once(':') {
            None if s == "organiser" => Self::Operator,
            None if s == "schedule" => Self::Schedule,
            None if s == "server" => Self::Server,
            None if s == "visitor" => Self::Visitor,
            Some(("person", id)) => Self::User(id.parse().map_err(|_| unknown())?),
            Some(("team", id)) => Self::Team(id.parse().map_err(|_| unknown())?),
            Some(("worker", name)) => Self::Worker(name.to_owned()),
            _ => return Err(unknown()),
        })
    }
}

faceoff_types::sqlite_text!(Actor);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actor_parses_back_from_its_text() {
        let actors = [
            Actor::Operator,
            Actor::Team(TeamId::new()),
            Actor::User(UserId::new()),
            Actor::Visitor,
            Actor::Schedule,
            Actor::Worker("host:1/slot-0".into()),
            Actor::Server,
        ];
        for actor in actors {
            assert_eq!(actor.to_string().parse(), Ok(actor));
        }
        assert!("team:none".parse::<Actor>().is_err());
    }
}

use super::parse::ParseEventError;
use faceoff_types::{PersonId, TeamId};
use std::{fmt, str::FromStr};

/// Who caused a change.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Actor {
    /// Whoever holds the host's token, or the server's configuration.
    Organiser,
    /// Whoever holds a token of the team's own.
    Team(TeamId),
    /// A person, whatever their role.
    Person(PersonId),
    /// Somebody without an account.
    Visitor,
    Schedule,
    /// A worker's slot, by the name under which it claims.
    Worker(String),
    /// What the server does by itself: tidying, derived data.
    Server,
}

impl fmt::Display for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Organiser => f.write_str("organiser"),
            Self::Team(id) => write!(f, "team:{id}"),
            Self::Person(id) => write!(f, "person:{id}"),
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
            None if s == "organiser" => Self::Organiser,
            None if s == "schedule" => Self::Schedule,
            None if s == "server" => Self::Server,
            None if s == "visitor" => Self::Visitor,
            Some(("person", id)) => Self::Person(id.parse().map_err(|_| unknown())?),
            Some(("team", id)) => Self::Team(id.parse().map_err(|_| unknown())?),
            Some(("worker", name)) => Self::Worker(name.to_owned()),
            _ => return Err(unknown()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actors_read_back_as_they_are_written() {
        let actors = [
            Actor::Organiser,
            Actor::Team(TeamId::new()),
            Actor::Person(PersonId::new()),
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

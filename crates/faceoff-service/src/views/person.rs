//! People, and who the caller is.

use crate::views::team;
use faceoff_api::views::{
    person::{PersonView, WhoView},
    token::TokenView,
};
use faceoff_store::{Person, Who};

pub fn of(person: Person) -> PersonView {
    PersonView {
        id: person.id,
        name: person.name,
        role: match person.team {
            Some(_) => "member".into(),
            None => "organiser".into(),
        },
        team: person.team,
        joined_at: person.joined_at,
        left_at: person.left_at,
        accepted_terms: person.accepted_terms,
    }
}

/// Who calls, with what.
pub fn who(who: Who, token: TokenView) -> WhoView {
    let (role, person, team) = match who {
        Who::Host => ("host", None, None),
        Who::Organiser(person) => ("organiser", Some(person), None),
        Who::Team(team) => ("team", None, Some(team)),
        Who::Member(person, team) => ("member", Some(person), Some(team)),
    };
    WhoView {
        role: role.into(),
        person: person.map(of),
        team: team.map(team::of),
        token,
    }
}

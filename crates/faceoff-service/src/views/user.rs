//! Users (organisers and members of teams), and the caller of a request.

use crate::views::team;
use faceoff_api::views::{
    token::TokenView,
    user::{CallerView, UserView},
};
use faceoff_store::{Principal, User};

pub fn view(user: User) -> UserView {
    UserView {
        id: user.id,
        name: user.name,
        role: match user.team {
            Some(_) => "member".into(),
            None => "organiser".into(),
        },
        team: user.team,
        joined_at: user.joined_at,
        left_at: user.left_at,
        accepted_terms: user.accepted_terms,
    }
}

/// The caller of a request.
pub fn caller(principal: Principal, token: TokenView) -> CallerView {
    let (role, user, team) = match principal {
        Principal::Operator => ("host", None, None),
        Principal::Organiser(user) => ("organiser", Some(user), None),
        Principal::Team(team) => ("team", None, Some(team)),
        Principal::Member(user, team) => ("member", Some(user), Some(team)),
    };
    CallerView {
        role: role.into(),
        person: user.map(view),
        team: team.map(team::view),
        token,
    }
}

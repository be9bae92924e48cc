//! Tokens of API clients and sessions of browsers, without their secrets.

use faceoff_api::views::token::TokenView;
use faceoff_store::{Token, TokenKind, TokenOwner};

pub fn view(token: Token) -> TokenView {
    let (team, person) = match token.owner {
        TokenOwner::Operator => (None, None),
        TokenOwner::Team(id) => (Some(id), None),
        TokenOwner::User(id) => (None, Some(id)),
    };
    TokenView {
        id: token.id,
        name: token.name,
        kind: match token.kind {
            TokenKind::ApiToken => "key".into(),
            TokenKind::Session => "session".into(),
        },
        team,
        person,
        made_by: token.creator.user,
        created_at: token.created_at,
        expires_at: token.expires_at,
        last_used_at: token.last_used_at,
        revoked_at: token.revoked_at,
    }
}

//! Links that download a file without a token.

use super::Client;
use faceoff_api::{requests::NewLink, views::link::LinkView};
use faceoff_types::{EvaluationId, GameId, Side, SubmissionId};
use reqwest::Method;

/// What a link downloads.
#[derive(Debug, Clone, Copy)]
pub enum Linked {
    Dataset(EvaluationId),
    /// As it was uploaded.
    Submission(SubmissionId),
    /// A side's own file of a game.
    Side(GameId, Side),
    /// Both sides' recording of a game.
    Recording(GameId),
}

impl Client {
    /// Makes a link, which comes this once; whole, also where the server does not know its own address.
    pub async fn link(&self, to: Linked, wanted: NewLink) -> anyhow::Result<LinkView> {
        let path = match to {
            Linked::Dataset(id) => format!("/evaluations/{id}/dataset/link"),
            Linked::Submission(id) => format!("/submissions/{id}/archive/link"),
            Linked::Side(id, side) => format!("/games/{id}/sides/{}/link", side.number()),
            Linked::Recording(id) => format!("/games/{id}/recording/link"),
        };
        let mut made: LinkView = self.tell(Method::POST, &path, &wanted).await?;
        if made.url.starts_with('/') {
            made.url.insert_str(0, &self.address.base);
        }
        Ok(made)
    }
}

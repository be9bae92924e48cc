//! Download links: URLs that download one file without a token, for a limited time.

use super::Client;
use faceoff_api::{requests::NewLink, views::link::LinkView};
use faceoff_types::{EvaluationId, GameId, Side, SubmissionId};

/// The file that a link downloads.
#[derive(Debug, Clone, Copy)]
pub enum LinkTarget {
    Dataset(EvaluationId),
    /// The bundle as it was uploaded.
    Submission(SubmissionId),
    /// The dataset of one side of a game.
    Side(GameId, Side),
    /// The recording of a game, with both sides.
    Recording(GameId),
}

impl Client {
    /// Creates a link; only this response contains it. A server without a public address sends a relative URL, which
    /// is made absolute here.
    pub async fn create_link(&self, target: LinkTarget, new: NewLink) -> anyhow::Result<LinkView> {
        let path = match target {
            LinkTarget::Dataset(id) => format!("/evaluations/{id}/dataset/link"),
            LinkTarget::Submission(id) => format!("/submissions/{id}/bundle/link"),
            LinkTarget::Side(id, side) => format!("/games/{id}/sides/{}/link", side.number()),
            LinkTarget::Recording(id) => format!("/games/{id}/recording/link"),
        };
        let mut link: LinkView = self.post(&path, &new).await?;
        self.make_absolute(&mut link.url);
        Ok(link)
    }

    /// Completes a link of a server without a public address: this client's address leads to it.
    pub(super) fn make_absolute(&self, url: &mut String) {
        if url.starts_with('/') {
            url.insert_str(0, &self.address.base);
        }
    }
}

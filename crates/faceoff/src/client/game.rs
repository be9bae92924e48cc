//! Requests about single games. A *game* is a match of two agents, one on each *side* of the table; an *attempt* is one run of
//! a game by a worker's slot, repeated after a fault of the platform.

use super::{
    Client,
    download::DownloadedFile,
    read_text,
    sse::{self, ServerEvent},
};
use anyhow::Context;
use faceoff_api::{
    requests::Decision,
    views::{attempt::GameAttemptView, game::GameView},
};
use faceoff_types::{GameId, Side};
use futures::{Stream, StreamExt};
use indicatif::ProgressBar;
use reqwest::{Method, header};
use std::path::Path;

impl Client {
    pub async fn game(&self, id: GameId) -> anyhow::Result<GameView> {
        self.get(&format!("/games/{id}")).await
    }

    /// Team or organiser: cancels a game that does not count.
    pub async fn cancel_game(&self, id: GameId) -> anyhow::Result<GameView> {
        self.call(Method::DELETE, &format!("/games/{id}")).await
    }

    /// Organiser: every attempt to run the game.
    pub async fn attempts(&self, id: GameId) -> anyhow::Result<Vec<GameAttemptView>> {
        self.get(&format!("/games/{id}/attempts")).await
    }

    /// Organiser: voids the result of a game; `confirm` is `HOME - AWAY`, the names of the two teams.
    pub async fn void_game(&self, id: GameId, decision: &Decision) -> anyhow::Result<GameView> {
        let path = format!("/games/{id}/void");
        self.post(&path, decision).await
    }

    /// Organiser: repeats a game.
    pub async fn rerun_game(&self, id: GameId) -> anyhow::Result<GameView> {
        self.post_empty(&format!("/games/{id}/rerun")).await
    }

    /// Downloads the dataset of one side: what its agent observed and did.
    pub async fn download_side(
        &self,
        id: GameId,
        side: Side,
        file: &Path,
        bar: &ProgressBar,
    ) -> anyhow::Result<DownloadedFile> {
        let path = format!("/games/{id}/sides/{}", side.number());
        self.download(&path, file, None, bar).await
    }

    /// Downloads the recording of the game, with both sides.
    pub async fn download_recording(
        &self,
        id: GameId,
        file: &Path,
        bar: &ProgressBar,
    ) -> anyhow::Result<DownloadedFile> {
        let path = format!("/games/{id}/recording");
        self.download(&path, file, None, bar).await
    }

    /// Team or organiser: the end of the log of a side's agent.
    pub async fn game_log(&self, id: GameId, side: Side) -> anyhow::Result<String> {
        let path = format!("/games/{id}/sides/{}/log", side.number());
        let response = self.send(self.request(Method::GET, &path)).await?;
        read_text(response).await
    }

    /// The live events of a game after the event `last_event_id`, by default all. The stream ends when the server ends it; a
    /// broken connection ends it with an error.
    pub async fn watch_game(
        &self,
        id: GameId,
        last_event_id: Option<&str>,
    ) -> anyhow::Result<impl Stream<Item = anyhow::Result<ServerEvent>> + use<>> {
        let mut request = self
            .request(Method::GET, &format!("/games/{id}/live"))
            .header(header::ACCEPT, "text/event-stream");
        if let Some(id) = last_event_id {
            request = request.header("last-event-id", id);
        }
        let response = self.send(request).await?;
        let pieces = response.bytes_stream();
        Ok(sse::events(pieces.map(|piece| {
            piece
                .map_err(reqwest::Error::without_url)
                .context("reading the server's answer")
        })))
    }
}

//! The log of an archive.

use super::files::Files;
use faceoff_service::{
    app::AppState,
    problem::Problem,
    room,
    views::event::{self, names},
};
use tokio::io::{AsyncWriteExt, BufWriter};

const AT_ONCE: u32 = 1000;

/// All events of the snapshot, one per line, the oldest first: a page of them at a time is in memory.
pub(super) async fn put(app: &AppState, files: &mut Files) -> Result<(), Problem> {
    let place = files.fresh();
    let file = tokio::fs::File::create(&place)
        .await
        .map_err(room::unwritten)?;
    let mut writer = BufWriter::new(file);
    let names = names(app).await?;
    let mut after = 0;
    loop {
        let events = app.store.events_after(after, AT_ONCE).await?;
        let Some(last) = events.last() else {
            break;
        };
        after = last.id;
        for event in events {
            let mut view = event::of(event);
            view.actor_name = names.get(&view.actor).cloned();
            let mut line = serde_json::to_vec(&view).map_err(Problem::internal)?;
            line.push(b'\n');
            writer.write_all(&line).await.map_err(room::unwritten)?;
        }
    }
    writer.flush().await.map_err(room::unwritten)?;
    files.add("events.jsonl", place).await
}

//! The event log in the season archive.

use super::files::Files;
use faceoff_service::{
    app::AppState,
    free_space,
    problem::Problem,
    views::event::{self, actor_names},
};
use tokio::io::{AsyncWriteExt, BufWriter};

/// Events that are read from the database at once.
const PAGE_EVENTS: u32 = 1000;

/// Writes all events of the snapshot, one per line, oldest first. Only one page of them is in memory at a time.
pub(super) async fn put(app: &AppState, files: &mut Files) -> Result<(), Problem> {
    let path = files.new_path();
    let file = tokio::fs::File::create(&path)
        .await
        .map_err(free_space::write_problem)?;
    let mut writer = BufWriter::new(file);
    let names = actor_names(app).await?;
    let mut last_id = 0;
    loop {
        let events = app.store.events_after(last_id, PAGE_EVENTS).await?;
        let Some(last) = events.last() else {
            break;
        };
        last_id = last.id;
        for event in events {
            let mut view = event::view(event);
            view.actor_name = names.get(&view.actor).cloned();
            let mut line = serde_json::to_vec(&view).map_err(Problem::internal)?;
            line.push(b'\n');
            writer
                .write_all(&line)
                .await
                .map_err(free_space::write_problem)?;
        }
    }
    writer.flush().await.map_err(free_space::write_problem)?;
    files.add("events.jsonl", path).await
}

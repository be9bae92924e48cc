//! The table of announcements.

use crate::{column::Instant, error::Result};
use faceoff_types::AnnouncementId;
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A public announcement of the organisers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announcement {
    pub id: AnnouncementId,
    /// When it was published.
    pub at: Timestamp,
    pub title: String,
    pub text: String,
}

/// The newest announcements, the newest first.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    limit: u32,
) -> Result<Vec<Announcement>> {
    let rows = sqlx::query!(
        "SELECT id, at, title, text
         FROM announcements ORDER BY at DESC, id DESC LIMIT ?",
        limit
    )
    .fetch_all(connection)
    .await?;
    let announcements = rows.into_iter().map(|row| Announcement {
        id: row.id,
        at: row.at.0,
        title: row.title,
        text: row.text,
    });
    Ok(announcements.collect())
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    announcement: &Announcement,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO announcements (id, at, title, text) VALUES (?, ?, ?, ?)",
        announcement.id,
        Instant(announcement.at),
        announcement.title,
        announcement.text
    )
    .execute(connection)
    .await?;
    Ok(())
}

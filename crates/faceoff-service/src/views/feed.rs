//! News feed of the season: announcements, openings and closings of stages and tournaments, and releases of evaluation days.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_store::Stage;
use jiff::Timestamp;
use uuid::Uuid;

/// Largest number of items in the feed.
const MAX_ITEMS: usize = 100;

/// Number of newest announcements that may appear in the feed.
const MAX_ANNOUNCEMENTS: u32 = 100;

/// Number of newest tournaments whose rounds may appear in the feed.
const MAX_TOURNAMENTS: usize = 10;

/// An item of the feed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewsItem {
    /// The same whenever the feed is made, so that a reader recognises the item.
    pub id: Uuid,
    /// When the event of the item happened.
    pub occurred_at: Timestamp,
    pub title: String,
    /// The full text; plain text.
    pub text: Option<String>,
    /// Path of the page with details.
    pub path: String,
}

/// Id of an item, the same on every server that shows the season: derived from `key`, not random.
fn item_id(key: &str) -> Uuid {
    let mut hash = blake3::Hasher::new_derive_key("Faceoff: ids of news");
    hash.update(key.as_bytes());
    let mut bytes = [0; 16];
    bytes.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    uuid::Builder::from_custom_bytes(bytes).into_uuid()
}

/// Removes characters that XML does not allow.
fn xml_safe(text: &str) -> String {
    let is_allowed = |c: &char| {
        matches!(c, '\n' | '\t' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
            && !('\u{7f}'..='\u{9f}').contains(c)
    };
    text.chars().filter(is_allowed).collect()
}

/// An item without text; its id derives from `key`.
fn item(key: &str, occurred_at: Timestamp, title: String, path: String) -> NewsItem {
    NewsItem {
        id: item_id(key),
        occurred_at,
        title: xml_safe(&title),
        text: None,
        path,
    }
}

/// The id of the feed, derived from the season's commitment, which is the hash of its secret.
pub fn feed_id(commitment: &str) -> Uuid {
    item_id(&format!("season {commitment}"))
}

/// The newest items, newest first.
#[boxed_future]
pub async fn newest(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let now = app.config.clock.now();
    let mut items = announcements(app).await?;
    let stages = app.store.stages().await?;
    for stage in &stages {
        items.extend(stage_items(stage));
    }
    for (day, _) in app.store.days().await? {
        let Some(released_at) = day.released_at else {
            continue;
        };
        let stage = stages.iter().find(|stage| stage.id == day.stage_day.stage);
        let stage = stage.map_or("a stage", |stage| stage.name.as_str());
        let title = format!("{stage}: the day {} is released", day.stage_day.date);
        let key = format!("day {} released", day.stage_day);
        items.push(item(&key, released_at, title, "/season".to_owned()));
    }
    items.extend(tournament_items(app).await?);
    // Items of the future are not shown yet.
    items.retain(|item| item.occurred_at <= now);
    items.sort_by_key(|item| (std::cmp::Reverse(item.occurred_at), item.id));
    items.truncate(MAX_ITEMS);
    Ok(items)
}

async fn announcements(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let announcements = app
        .store
        .announcements(MAX_ANNOUNCEMENTS)
        .await?
        .into_iter();
    let items = announcements.map(|announcement| NewsItem {
        id: announcement.id.as_uuid(),
        occurred_at: announcement.at,
        title: xml_safe(&announcement.title),
        text: Some(xml_safe(&announcement.text)),
        path: format!("/announcements#a{}", announcement.id),
    });
    Ok(items.collect())
}

/// Items of a stage. It opens and closes at a set time, without an event in the log.
fn stage_items(stage: &Stage) -> Vec<NewsItem> {
    let (id, name) = (stage.id, &stage.name);
    let path = format!("/?stage={id}");
    let mut items = vec![item(
        &format!("stage {id} opens"),
        stage.opens_at,
        format!("{name} is open"),
        path.clone(),
    )];
    if let Some(closes_at) = stage.closes_at {
        let title = format!("{name} is closed");
        let key = format!("stage {id} closes");
        items.push(item(&key, closes_at, title, path.clone()));
    }
    if let Some(sign_off) = &stage.sign_off {
        let title = format!("{name}: the result is signed off");
        let key = format!("stage {id} signed off");
        items.push(item(&key, sign_off.signed_off_at, title, path));
    }
    items
}

async fn tournament_items(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let mut items = Vec::new();
    let tournaments = app.store.tournaments().await?;
    for tournament in tournaments.into_iter().rev().take(MAX_TOURNAMENTS) {
        let (id, name) = (tournament.id, &tournament.name);
        let path = format!("/tournaments/{id}");
        let mut add = |event: &str, occurred_at: Timestamp, title: String| {
            items.push(item(
                &format!("tournament {id} {event}"),
                occurred_at,
                title,
                path.clone(),
            ));
        };
        let opened = format!("The tournament {name} is open");
        add("opened", tournament.created_at, opened);
        if let Some(closed_at) = tournament.closed_at {
            add(
                "closed",
                closed_at,
                format!("The tournament {name} is closed"),
            );
        }
        for round in app.store.tournament_record(id).await?.rounds {
            let number = round.number;
            let begun = format!("{name}: round {number} has begun");
            add(&format!("round {number} begun"), round.started_at, begun);
            if let Some(over_at) = round.over_at {
                let over = format!("{name}: round {number} is over");
                add(&format!("round {number} over"), over_at, over);
            }
        }
    }
    Ok(items)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_xml_characters_are_removed() {
        let text = "a\u{0}b\u{8}c\u{b}\td\n\u{1b}[31m\u{85}e\u{fffe}\u{ffff}<&>🙂";
        assert_eq!(xml_safe(text), "abc\td\n[31me<&>🙂");
    }

    #[test]
    fn item_id_depends_only_on_key() {
        assert_eq!(item_id("a"), item_id("a"));
        assert_ne!(item_id("a"), item_id("b"));
        assert_eq!(item_id("a").get_version_num(), 8);
    }
}

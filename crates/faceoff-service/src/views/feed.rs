//! News of the season: what was announced, opened, released and closed, for everybody.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::paths;
use faceoff_store::Stage;
use jiff::Timestamp;
use uuid::Uuid;

/// The newest so many are told.
const SHOWN: usize = 100;

/// Of announcements, as many are read.
const ANNOUNCEMENTS: u32 = 100;

/// Rounds are read of the newest so many tournaments.
const TOURNAMENTS: usize = 10;

/// A thing that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewsItem {
    /// Stays, however often the feed is made.
    pub id: Uuid,
    pub at: Timestamp,
    pub title: String,
    /// What more there is to say; plain text.
    pub text: Option<String>,
    /// Where more can be read, without the server's address.
    pub path: String,
}

/// Names the same thing by the same id, on every server that knows it: its own ids are drawn.
fn id_of(what: &str) -> Uuid {
    let mut hash = blake3::Hasher::new_derive_key("Faceoff: ids of news");
    hash.update(what.as_bytes());
    let mut bytes = [0; 16];
    bytes.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    uuid::Builder::from_custom_bytes(bytes).into_uuid()
}

/// What XML can hold of a text: no control characters, whoever wrote it.
fn told(text: &str) -> String {
    let is_held = |c: &char| {
        matches!(c, '\n' | '\t' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
            && !('\u{7f}'..='\u{9f}').contains(c)
    };
    text.chars().filter(is_held).collect()
}

fn item(what: &str, at: Timestamp, title: String, path: String) -> NewsItem {
    NewsItem {
        id: id_of(what),
        at,
        title: told(&title),
        text: None,
        path,
    }
}

/// The id of a feed, which is its season's.
pub fn feed_id(commitment: &str) -> Uuid {
    id_of(&format!("season {commitment}"))
}

/// The newest first.
#[boxed]
pub async fn newest(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let now = app.config.clock.now();
    let mut news = announcements(app).await?;
    let stages = app.store.stages().await?;
    for stage in &stages {
        news.extend(of_stage(stage));
    }
    for (day, _) in app.store.days().await? {
        let Some(at) = day.released_at else {
            continue;
        };
        let stage = stages.iter().find(|stage| stage.id == day.of.stage);
        let stage = stage.map_or("a stage", |stage| stage.name.as_str());
        let title = format!("{stage}: the day {} is released", day.of.date);
        let what = format!("day {} released", day.of);
        news.push(item(&what, at, title, "/season".to_owned()));
    }
    news.extend(of_tournaments(app).await?);
    // What is to come is no news yet.
    news.retain(|item| item.at <= now);
    news.sort_by_key(|item| (std::cmp::Reverse(item.at), item.id));
    news.truncate(SHOWN);
    Ok(news)
}

async fn announcements(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let announcements = app.store.announcements(ANNOUNCEMENTS).await?.into_iter();
    let news = announcements.map(|announcement| NewsItem {
        id: announcement.id.as_uuid(),
        at: announcement.at,
        title: told(&announcement.title),
        text: Some(told(&announcement.text)),
        path: "/announcements".to_owned(),
    });
    Ok(news.collect())
}

/// Opening and closing follow from the clock, and are in no log.
fn of_stage(stage: &Stage) -> Vec<NewsItem> {
    let (id, name) = (stage.id, &stage.name);
    let path = format!("/?stage={id}");
    let mut news = vec![item(
        &format!("stage {id} opens"),
        stage.opens_at,
        format!("{name} is open"),
        path.clone(),
    )];
    if let Some(at) = stage.closes_at {
        let title = format!("{name} is closed");
        let what = format!("stage {id} closes");
        news.push(item(&what, at, title, path.clone()));
    }
    if let Some(finalised) = &stage.finalised {
        let title = format!("{name}: the result is signed off");
        let what = format!("stage {id} signed off");
        news.push(item(&what, finalised.at, title, path));
    }
    news
}

async fn of_tournaments(app: &AppState) -> Result<Vec<NewsItem>, Problem> {
    let mut news = Vec::new();
    let tournaments = app.store.tournaments().await?;
    for tournament in tournaments.into_iter().rev().take(TOURNAMENTS) {
        let (id, name) = (tournament.id, &tournament.name);
        let path = paths::tournament(id);
        let mut add = |what: &str, at: Timestamp, title: String| {
            news.push(item(
                &format!("tournament {id} {what}"),
                at,
                title,
                path.clone(),
            ));
        };
        let opened = format!("The tournament {name} is open");
        add("opened", tournament.created_at, opened);
        if let Some(at) = tournament.closed_at {
            add("closed", at, format!("The tournament {name} is closed"));
        }
        for round in app.store.tournament_record(id).await?.rounds {
            let number = round.number;
            let begun = format!("{name}: round {number} has begun");
            add(&format!("round {number} begun"), round.started_at, begun);
            if let Some(at) = round.over_at {
                let over = format!("{name}: round {number} is over");
                add(&format!("round {number} over"), at, over);
            }
        }
    }
    Ok(news)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_cannot_hold_is_left_out() {
        let text = "a\u{0}b\u{8}c\u{b}\td\n\u{1b}[31m\u{85}e\u{fffe}\u{ffff}<&>🙂";
        assert_eq!(told(text), "abc\td\n[31me<&>🙂");
    }

    #[test]
    fn the_same_thing_has_the_same_id_and_another_another() {
        assert_eq!(id_of("a"), id_of("a"));
        assert_ne!(id_of("a"), id_of("b"));
        assert_eq!(id_of("a").get_version_num(), 8);
    }
}

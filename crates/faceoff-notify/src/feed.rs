//! The feed of the log: each page is read once for all followers.

use crate::{boxed, notice::Notice, stage_visibility::StageVisibility};
use faceoff_store::{Store, StoreError, Subject, SubjectContext};
use std::{
    collections::{HashMap, VecDeque},
    sync::Arc,
};
use tokio::sync::Mutex;

/// Maximum number of events in a page.
const PAGE_SIZE: u32 = 200;
/// Number of cached pages: most followers are at the same position, or nearly.
const CACHED_PAGES: usize = 8;

/// Notices after an event, the oldest first.
#[derive(Debug)]
pub struct Page {
    /// Id of the event before the page.
    after: i64,
    pub notices: Vec<Notice>,
    /// Visibility of results, as of the end of the page or later.
    pub stages: StageVisibility,
    /// Id of the last event of the page.
    pub until: i64,
}

/// Reads the log. All waiting followers get the same cached page. A follower's only state is the id of the last event
/// that it has seen.
#[derive(Debug)]
pub struct Feed {
    store: Store,
    cache: Mutex<VecDeque<Arc<Page>>>,
}

impl Feed {
    #[must_use]
    pub fn new(store: Store) -> Self {
        Self {
            store,
            cache: Mutex::default(),
        }
    }

    /// The page after the event with this id; `None` if there are no later events yet.
    ///
    /// # Errors
    /// If the log cannot be read.
    #[boxed]
    pub async fn after(&self, id: i64) -> Result<Option<Arc<Page>>, StoreError> {
        let mut cache = self.cache.lock().await;
        // Pages never change: newer events are on later pages.
        if let Some(page) = cache.iter().find(|page| page.after == id) {
            return Ok(Some(Arc::clone(page)));
        }
        let records = self.store.events_after(id, PAGE_SIZE).await?;
        let Some(until) = records.last().map(|record| record.id) else {
            return Ok(None);
        };
        let mut notices = Vec::with_capacity(records.len());
        // Consecutive events often belong to the same evaluation.
        let mut contexts: HashMap<Subject, SubjectContext> = HashMap::new();
        for record in records {
            let subject = record.subject;
            let context = match contexts.get(&subject) {
                Some(context) => *context,
                None => self.store.subject_context(subject).await?,
            };
            contexts.insert(subject, context);
            notices.push(Notice::new(record, context));
        }
        let page = Arc::new(Page {
            after: id,
            notices,
            stages: StageVisibility::read(&self.store).await?,
            until,
        });
        cache.truncate(CACHED_PAGES - 1);
        cache.push_front(Arc::clone(&page));
        Ok(Some(page))
    }
}

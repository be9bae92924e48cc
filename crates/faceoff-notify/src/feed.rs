//! The feed of the event log: its events as notices, page by page. Its *followers* are webhooks and clients of the API's event
//! stream. Each page is read once for all of them. The Atom feed of the pages does not use it.

use crate::{boxed_future, notice::Notice, stage_visibility::StageVisibility};
use faceoff_store::{Store, StoreError, Subject, SubjectContext};
use std::{
    collections::{HashMap, VecDeque},
    sync::Arc,
};
use tokio::sync::Mutex;

/// Maximum number of events in a page.
const PAGE_SIZE: u32 = 200;
/// Number of cached pages. A few suffice, since most followers have read the log to nearly the same position.
const CACHED_PAGES: usize = 8;

/// A page of the log: notices of consecutive events, the oldest first.
#[derive(Debug)]
pub struct Page {
    /// Id of the event before the page.
    previous_event: i64,
    pub notices: Vec<Notice>,
    /// Visibility of results, as of the end of the page or later.
    pub stage_visibility: StageVisibility,
    /// Id of the last event of the page.
    pub last_event: i64,
}

/// Reads the log for all followers. Those at the same position get the same cached page. A follower's only state is the id
/// of the last event that it has seen.
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

    /// The page that follows an event; `None` if there are no later events yet.
    ///
    /// # Errors
    /// If the log cannot be read.
    #[boxed_future]
    pub async fn page_after(&self, event: i64) -> Result<Option<Arc<Page>>, StoreError> {
        let mut cache = self.cache.lock().await;
        // Pages never change: newer events are on later pages.
        if let Some(page) = cache.iter().find(|page| page.previous_event == event) {
            return Ok(Some(Arc::clone(page)));
        }
        let records = self.store.events_after(event, PAGE_SIZE).await?;
        let Some(last_event) = records.last().map(|record| record.id) else {
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
            previous_event: event,
            notices,
            stage_visibility: StageVisibility::read(&self.store).await?,
            last_event,
        });
        cache.truncate(CACHED_PAGES - 1);
        cache.push_front(Arc::clone(&page));
        Ok(Some(page))
    }
}

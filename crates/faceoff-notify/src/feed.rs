//! The log, read once for all who follow it.

use crate::{boxed, notice::Notice, stages_told::StagesTold};
use faceoff_store::{Concern, Store, StoreError, Subject};
use std::{
    collections::{HashMap, VecDeque},
    sync::Arc,
};
use tokio::sync::Mutex;

/// Events of a page at most.
const PAGE: u32 = 200;
/// Pages that are kept: those who follow are at the same place, or nearly.
const KEPT: usize = 8;

/// What happened after an event, from the oldest on.
#[derive(Debug)]
pub struct Page {
    /// After the event with this id.
    after: i64,
    pub notices: Vec<Notice>,
    /// What is kept from others, as of the end of the page or later.
    pub stages: StagesTold,
    /// The id of the last one; what comes next comes after it.
    pub until: i64,
}

/// Reads the log. Everybody who waits reads the same page once something happens: it is read once, and a reader is no
/// more than the id that it has come to.
#[derive(Debug)]
pub struct Feed {
    store: Store,
    kept: Mutex<VecDeque<Arc<Page>>>,
}

impl Feed {
    #[must_use]
    pub fn new(store: Store) -> Self {
        Self {
            store,
            kept: Mutex::default(),
        }
    }

    /// What happened after the event with this id, as far as a page goes; `None`: nothing yet.
    ///
    /// # Errors
    /// If the log cannot be read.
    #[boxed]
    pub async fn after(&self, id: i64) -> Result<Option<Arc<Page>>, StoreError> {
        let mut kept = self.kept.lock().await;
        // Nothing of it changes any more: what is newer comes after it.
        if let Some(page) = kept.iter().find(|page| page.after == id) {
            return Ok(Some(Arc::clone(page)));
        }
        let records = self.store.events_after(id, PAGE).await?;
        let Some(until) = records.last().map(|record| record.id) else {
            return Ok(None);
        };
        let mut notices = Vec::with_capacity(records.len());
        // Most of what happens comes in rows, of one evaluation.
        let mut concerns: HashMap<Subject, Concern> = HashMap::new();
        for record in records {
            let subject = record.subject;
            let concern = match concerns.get(&subject) {
                Some(concern) => *concern,
                None => self.store.concern(subject).await?,
            };
            concerns.insert(subject, concern);
            notices.push(Notice::new(record, concern));
        }
        let page = Arc::new(Page {
            after: id,
            notices,
            stages: StagesTold::read(&self.store).await?,
            until,
        });
        kept.truncate(KEPT - 1);
        kept.push_front(Arc::clone(&page));
        Ok(Some(page))
    }
}

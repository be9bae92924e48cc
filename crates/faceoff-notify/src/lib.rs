//! Notifications: notices of changes, their visibility, and their delivery to webhooks.
//!
//! A notice names an event and its subject, so that a page or an API client knows what to reload. It contains no scores
//! and no free texts. The API's event stream and webhooks follow the log through a [`Feed`]. What each reader may see is
//! decided in one file, `notice.rs`.
//!
//! This crate handles no requests and changes nothing in a season. It does not trust the addresses of webhooks: names
//! are resolved here, and only public addresses on the Internet are connected to.

mod address;
mod deliverer;
mod feed;
mod notice;
mod notice_filter;
mod resolver;
mod secret;
mod sender;
mod stage_visibility;
mod topic;

/// `#[boxed_future]` on a public `async fn` makes it return a boxed future, so that its body is compiled once, here, and not in each
/// crate that awaits it.
pub(crate) use async_recursion::async_recursion as boxed_future;

pub use address::{NotPublic, WebhookRules};
pub use deliverer::{Deliverer, message};
pub use feed::{Feed, Page};
pub use notice::{Audience, Notice};
pub use notice_filter::{MAX_FILTER_ITEMS, NoticeFilter, ParseNoticeFilterError};
pub use secret::WebhookSecret;
pub use stage_visibility::StageVisibility;
pub use topic::Topic;

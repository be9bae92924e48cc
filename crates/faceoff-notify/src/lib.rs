//! What is told to those who do not ask: which change of the season is told to whom, in which words, and the webhooks
//! that carry it.
//!
//! A notice says what happened to what, so that a page or a program knows what to ask for again; it holds no score and
//! nobody's words. Who is told of what is decided in one file (`notice.rs`), for the stream of events of the API, for
//! webhooks and for the feed.
//!
//! This crate answers no request, decides nothing about a season, and trusts no address that a webhook names: names are
//! resolved here, and what is not public on the Internet is not connected to.

mod about;
mod address;
mod deliverer;
mod feed;
mod notice;
mod resolver;
mod secret;
mod sender;
mod stages_told;
mod topic;

/// What others await is boxed, so that it is compiled here, once, and not by each crate that awaits it.
pub(crate) use async_recursion::async_recursion as boxed;

pub use about::{About, MAX_ITEMS, ParseAboutError};
pub use address::{NotPublic, WebhookRules};
pub use deliverer::{Deliverer, message};
pub use feed::{Feed, Page};
pub use notice::{Notice, Reader};
pub use secret::WebhookSecret;
pub use stages_told::StagesTold;
pub use topic::Topic;

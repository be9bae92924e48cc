//! Work on other machines. The queue stays the store's: the server claims from it as much as free slots elsewhere ask for, and NATS carries
//! the orders there and what came of them back. A unit's lease is the only truth about whose it is: what NATS loses ends with its
//! lease, or is taken back before, and is given out again; what it delivers twice is begun once, by whoever says first that it
//! begins, and committed once.
//!
//! `names.rs` is what both sides call things; `dispatch.rs`, `granted.rs` and `answers.rs` are the server's side; `far_server.rs` is the server as
//! a worker's slots see it: `next_order.rs` how they come by orders, `order_files.rs` and `transfer.rs` files, `handing_in.rs` what came of
//! them; `worker.rs` is the process that they run in, `link.rs` what they share; `checked.rs` is why the server believes what comes back.

mod answers;
mod bucket;
mod checked;
mod connection;
mod dispatch;
mod examine;
mod far_server;
mod granted;
mod handing_in;
mod link;
mod names;
mod next_order;
mod order_files;
mod taken_back;
mod transfer;
mod worker;

pub use bucket::BucketConfig;
pub use connection::NatsConfig;
pub use dispatch::{RemoteConfig, dispatch};
pub use examine::{Examined, examine};
pub(crate) use handing_in::TooLarge;
pub use worker::{RemoteWorker, work};

//! Work on other machines. The queue stays the store's: the server claims from it as much as free slots elsewhere ask for, and NATS carries
//! the orders there and what came of them back. A unit's lease is the only truth about whose it is: what NATS loses ends with its
//! lease, or is taken back before, and is given out again; what it delivers twice is begun once, by whoever says first that it
//! begins, and committed once.
//!
//! `names.rs` is what both sides call things and `connection.rs` how both reach NATS. The server's side: `streams.rs` are its streams,
//! `dispatch.rs` gives out what `granted.rs` and `bucket.rs` open, and `taken_back.rs` knows what nobody has begun; `answers.rs` is what workers ask
//! meanwhile, and `like.rs` which of them get work; `taken_in.rs` takes in what came of it, `checked.rs` is why it believes that, and `handed_in.rs`
//! knows what waits for it. `examine.rs` asks as a worker would. `far_server.rs` is the server as a worker's slots see it: `next_order.rs` how they come
//! by orders, `order_files.rs` and `transfer.rs` files, `handing_in.rs` what came of them; `worker.rs` is the process that they run in, `link.rs` what
//! they share.

mod answers;
mod bucket;
mod checked;
mod connection;
mod dispatch;
mod examine;
mod far_server;
mod granted;
mod handed_in;
mod handing_in;
mod like;
mod link;
mod names;
mod next_order;
mod order_files;
mod streams;
mod taken_back;
mod taken_in;
mod transfer;
mod worker;

pub use bucket::BucketConfig;
pub use connection::NatsConfig;
pub use dispatch::{RemoteConfig, dispatch};
pub use examine::{Examined, examine};
pub(crate) use handing_in::TooLarge;
pub use worker::{RemoteWorker, work};

//! Signal of the server's shutdown. Streaming responses (events, live games) have no end, so they wait for it and then end.

use crate::boxed_future;
use std::future::pending;
use tokio::sync::watch;

/// Signals the server's shutdown to all requests.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Receiver<bool>);

impl Shutdown {
    /// The sender, which sends `true` at shutdown, and the signal.
    pub fn new() -> (watch::Sender<bool>, Self) {
        let (sender, receiver) = watch::channel(false);
        (sender, Self(receiver))
    }

    /// Waits for the shutdown; without a signal (`None`) forever.
    #[boxed_future]
    pub async fn wait(shutdown: Option<&mut Self>) {
        match shutdown {
            Some(Self(receiver)) => {
                // A dropped sender means shutdown, too.
                let _ = receiver.wait_for(|has_begun| *has_begun).await;
            }
            None => pending().await,
        }
    }
}

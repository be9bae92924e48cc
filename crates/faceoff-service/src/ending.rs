//! That the server is about to end, for answers that have no end of their own.

use crate::boxed;
use std::future::pending;
use tokio::sync::watch;

/// Told to all requests; without one a server does not end.
#[derive(Debug, Clone)]
pub struct Ending(watch::Receiver<bool>);

impl Ending {
    /// What says so when it is true, and what is told.
    pub fn new() -> (watch::Sender<bool>, Self) {
        let (sender, receiver) = watch::channel(false);
        (sender, Self(receiver))
    }

    /// Until the server ends.
    #[boxed]
    pub async fn wait(of: Option<&mut Self>) {
        match of {
            Some(Self(receiver)) => {
                // Who dropped the sender has ended, too.
                let _ = receiver.wait_for(|ends| *ends).await;
            }
            None => pending().await,
        }
    }
}

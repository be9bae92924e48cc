//! Would a worker of this machine get work? Asked before it is started.

use super::{
    connection::{ANSWER, NatsConfig},
    names::Names,
};
use crate::boxed;
use anyhow::Context as _;
use faceoff_wire::remote::{Answer, Ask, Introduction};
use std::time::Duration;

/// What was found on the way to the server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Examined {
    /// The version of the nats-server, or why it is not reached.
    pub nats: Result<String, String>,
    /// Would the server give it work? Or why not; `None`: NATS is not reached.
    pub server: Option<Result<(), String>>,
}

/// How long connecting may take.
const CONNECTS_WITHIN: Duration = Duration::from_secs(5);

/// Asks NATS and the server, as a worker of this name would, and changes nothing.
#[boxed]
pub async fn examine(nats: &NatsConfig, name: &str, own: &Introduction) -> Examined {
    let connected = async {
        let options = nats.options(name).await?;
        let connecting = options
            .connection_timeout(CONNECTS_WITHIN)
            .connect(&nats.url);
        let client = tokio::time::timeout(2 * CONNECTS_WITHIN, connecting)
            .await
            .context("no answer")?;
        anyhow::Ok((client?, Names::of(&nats.name)?))
    };
    let (client, names) = match connected.await {
        Ok(connected) => connected,
        Err(error) => {
            return Examined {
                nats: Err(format!("{error:#}")),
                server: None,
            };
        }
    };
    let asked = async {
        let question = serde_json::to_vec(&Ask::WouldWork(own.clone()))?;
        let answer = client.request(names.asks(name), question.into());
        let answer = tokio::time::timeout(2 * ANSWER, answer).await??;
        anyhow::Ok(serde_json::from_slice(&answer.payload)?)
    };
    let server = match asked.await {
        Ok(Answer::Yes) => Ok(()),
        Ok(Answer::No { reason }) => Err(reason),
        Ok(Answer::Unknown) => Err("the server cannot tell now".to_owned()),
        Err(error) => Err(format!(
            "no server answers at NATS as nats.name = {:?}: {error:#}",
            nats.name
        )),
    };
    Examined {
        nats: Ok(client.server_info().version),
        server: Some(server),
    }
}

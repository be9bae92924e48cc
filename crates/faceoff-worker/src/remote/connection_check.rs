//! Checks in advance whether a worker on this machine would get jobs from the server, over the message broker NATS.

use super::{
    connection::{NatsConfig, REQUEST_TIMEOUT},
    names::Names,
};
use crate::boxed_future;
use anyhow::Context as _;
use faceoff_wire::remote::{WorkerCapabilities, WorkerRequest, WorkerResponse};
use std::time::Duration;

/// Result of the check of the connection to the server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConnectionCheck {
    /// Version of the nats-server, or the reason why it cannot be reached.
    pub nats: Result<String, String>,
    /// `Ok` if the server would give the worker jobs, otherwise the reason; `None` if NATS cannot be reached.
    pub server: Option<Result<(), String>>,
}

/// Timeout for connecting.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Connects to NATS and asks the server whether a worker with this name and these capabilities would get jobs. Registers nothing.
#[boxed_future]
pub async fn check_connection(
    nats: &NatsConfig,
    name: &str,
    capabilities: &WorkerCapabilities,
) -> ConnectionCheck {
    let connected = async {
        let options = nats.options(name).await?;
        let connecting = options
            .connection_timeout(CONNECT_TIMEOUT)
            .connect(&nats.url);
        let client = tokio::time::timeout(2 * CONNECT_TIMEOUT, connecting)
            .await
            .context("no answer")?;
        anyhow::Ok((client?, Names::new(&nats.name)?))
    };
    let (client, names) = match connected.await {
        Ok(connected) => connected,
        Err(error) => {
            return ConnectionCheck {
                nats: Err(format!("{error:#}")),
                server: None,
            };
        }
    };
    let response = async {
        let request = serde_json::to_vec(&WorkerRequest::CheckRegistration(capabilities.clone()))?;
        let response = client.request(names.requests(name), request.into());
        let response = tokio::time::timeout(2 * REQUEST_TIMEOUT, response).await??;
        anyhow::Ok(serde_json::from_slice(&response.payload)?)
    };
    let server = match response.await {
        Ok(WorkerResponse::Accepted) => Ok(()),
        Ok(WorkerResponse::Refused { reason }) => Err(reason),
        Ok(WorkerResponse::Unavailable) => Err("the server cannot answer now".to_owned()),
        Err(error) => Err(format!(
            "no server answers at NATS as nats.name = {:?}: {error:#}",
            nats.name
        )),
    };
    ConnectionCheck {
        nats: Ok(client.server_info().version),
        server: Some(server),
    }
}

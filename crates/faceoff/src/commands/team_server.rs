use crate::client::Client;
use clap::Args;
use faceoff_http::views::queue::QueueView;

/// Where a team's commands go, and as whom.
#[derive(Debug, Args)]
pub struct TeamServer {
    /// The server
    #[arg(
        long,
        value_name = "URL",
        env = "FACEOFF_SERVER",
        default_value = "http://127.0.0.1:8080"
    )]
    server: String,
    /// The team's token
    #[arg(long, env = "FACEOFF_TOKEN", hide_env_values = true)]
    token: String,
}

impl TeamServer {
    /// A client that speaks for the team.
    ///
    /// # Errors
    /// If the address is none.
    pub fn client(&self) -> anyhow::Result<Client> {
        Client::new(&self.server, Some(self.token.trim()))
    }
}

/// Where something stands in the queue, in words.
pub fn in_queue(queue: &QueueView) -> String {
    let expected = match queue.expected_at {
        Some(at) => format!("expected to be over {}", at.strftime("%Y-%m-%d %H:%M UTC")),
        None => "nobody can tell yet when it will be over".to_owned(),
    };
    format!(
        "number {} of {} to be over, {expected}",
        queue.place, queue.of
    )
}

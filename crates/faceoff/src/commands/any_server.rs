use crate::client::Client;
use clap::Args;

/// Where commands go that anybody may give, and as whom, if a token makes a difference.
#[derive(Debug, Args)]
pub struct AnyServer {
    /// The server
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = "FACEOFF_SERVER",
        default_value = "http://127.0.0.1:8080"
    )]
    server: String,
    /// The team's token, where what is asked is not for everybody
    #[arg(long, global = true, env = "FACEOFF_TOKEN", hide_env_values = true)]
    token: Option<String>,
}

impl AnyServer {
    /// A client that speaks for whose token it is, or for nobody.
    ///
    /// # Errors
    /// If the address is none.
    pub fn client(&self) -> anyhow::Result<Client> {
        Client::new(&self.server, self.token.as_deref().map(str::trim))
    }
}

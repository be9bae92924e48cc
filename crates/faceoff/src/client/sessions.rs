//! Signing in with name and password, and signing out.

use super::{Client, Unreachable, read_json};
use anyhow::{Context, anyhow};
use faceoff_api::{
    requests::{NewToken, SignInRequest},
    views::token::NewTokenView,
};
use reqwest::{Method, header};

impl Client {
    /// Signs in with name and password, creates a token and ends the session.
    ///
    /// # Errors
    /// If name or password is wrong, or the user may not create tokens.
    pub async fn create_token_with_password(
        &self,
        name: &str,
        password: &str,
        new: &NewToken,
    ) -> anyhow::Result<String> {
        let sign_in = SignInRequest {
            name: name.to_owned(),
            password: password.to_owned(),
        };
        let request = self.request(Method::POST, "/sessions").json(&sign_in);
        let response = self.send(request).await?;
        let cookie = response.headers().get(header::SET_COOKIE);
        let cookie = cookie
            .and_then(|cookie| cookie.to_str().ok()?.split(';').next())
            .ok_or_else(|| anyhow!("the server sent no session cookie"))
            .context(Unreachable("is it another version of Faceoff?".to_owned()))?
            .to_owned();
        // The server accepts a session cookie only from its own pages.
        let browser_request = |method, path: &str| {
            self.request(method, path)
                .header(header::COOKIE, &cookie)
                .header("sec-fetch-site", "same-origin")
        };
        let created = self
            .send(browser_request(Method::POST, "/tokens").json(new))
            .await;
        let created = match created {
            Ok(response) => read_json::<NewTokenView>(response).await,
            Err(error) => Err(error),
        };
        let ended = self
            .send(browser_request(Method::DELETE, "/sessions/current"))
            .await;
        let created = created?;
        ended.context("ending the session that created the token")?;
        Ok(created.secret)
    }

    /// Revokes the client's own token.
    pub async fn revoke_own_token(&self) -> anyhow::Result<()> {
        let request = self.request(Method::DELETE, "/sessions/current");
        self.send(request).await.map(drop)
    }
}

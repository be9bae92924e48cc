//! Signing in by name and password, and out.

use super::{Client, Unreachable, read};
use anyhow::{Context, anyhow};
use faceoff_api::{
    requests::{NewToken, SignIn},
    views::token::NewTokenView,
};
use reqwest::{Method, header};

impl Client {
    /// A token of the person's who has this name and password. The session by which it is made ends at once.
    ///
    /// # Errors
    /// If they do not belong together, or a person may make no token.
    pub async fn token_by_password(
        &self,
        name: &str,
        password: &str,
        new: &NewToken,
    ) -> anyhow::Result<String> {
        let sign_in = SignIn {
            name: name.to_owned(),
            password: password.to_owned(),
        };
        let request = self.request(Method::POST, "/sessions").json(&sign_in);
        let response = self.send(request).await?;
        let cookie = response.headers().get(header::SET_COOKIE);
        let cookie = cookie
            .and_then(|cookie| cookie.to_str().ok()?.split(';').next())
            .ok_or_else(|| anyhow!("it has signed us in without a cookie"))
            .context(Unreachable("is it another version of Faceoff?".to_owned()))?
            .to_owned();
        // A cookie comes from pages of the server, and so does this.
        let as_page = |method, path: &str| {
            self.request(method, path)
                .header(header::COOKIE, &cookie)
                .header("sec-fetch-site", "same-origin")
        };
        let made = self.send(as_page(Method::POST, "/tokens").json(new)).await;
        let made = match made {
            Ok(response) => read::<NewTokenView>(response).await,
            Err(error) => Err(error),
        };
        let ended = self
            .send(as_page(Method::DELETE, "/sessions/current"))
            .await;
        let made = made?;
        ended.context("ending the session by which the token was made")?;
        Ok(made.secret)
    }

    /// Revokes the token by which we call.
    pub async fn end_token(&self) -> anyhow::Result<()> {
        let request = self.request(Method::DELETE, "/sessions/current");
        self.send(request).await.map(drop)
    }
}

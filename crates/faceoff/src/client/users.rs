//! Requests about users, their teams and their tokens. The API's routes call users *people*.

use super::{Client, read_json};
use faceoff_api::{
    requests::{
        Confirmation, CreatedCredentials, Decision, JoinRequest, NewAnnouncement, NewAnswer,
        NewInvitation, NewPassword, NewQuestion, NewTeam, NewTerms, NewToken, Reason,
        RegistrationRequest, RevocationQuery, SeasonChange, TeamChange, UserChange,
    },
    views::{
        announcement::{AnnouncementView, QuestionView, TermsView},
        credentials::{ChangedAccessView, NewAccountView, RevokedTokenView},
        invitation::{InvitationView, NewInvitationView, NewRegistrationView, RegistrationView},
        season::SeasonView,
        team::{TeamView, TeamWithToken},
        token::{NewTokenView, TokenView},
        user::{CallerView, UserView},
    },
};
use faceoff_types::{InvitationId, QuestionId, RegistrationId, TeamId, TokenId, UserId, UserName};
use reqwest::Method;

impl Client {
    pub async fn whoami(&self) -> anyhow::Result<CallerView> {
        self.get("/whoami").await
    }

    /// The tokens and sessions that the caller may manage, the newest first.
    pub async fn tokens(&self) -> anyhow::Result<Vec<TokenView>> {
        self.list(self.request(Method::GET, "/tokens")).await
    }

    /// Creates a token; only this response has its text.
    pub async fn create_token(&self, new: &NewToken) -> anyhow::Result<NewTokenView> {
        self.post("/tokens", new).await
    }

    /// Replaces the secret of a token; only this response has the new one.
    pub async fn rotate_token(&self, id: TokenId) -> anyhow::Result<NewTokenView> {
        self.post_empty(&format!("/tokens/{id}/rotate")).await
    }

    /// Revokes a token. `created_with_it` says whether the tokens, invitations and webhooks that were created with the token end, too.
    pub async fn revoke_token(
        &self,
        id: TokenId,
        created_with_it: Option<CreatedCredentials>,
    ) -> anyhow::Result<RevokedTokenView> {
        let request = self.request(Method::DELETE, &format!("/tokens/{id}"));
        let request = request.query(&RevocationQuery {
            made: created_with_it,
        });
        read_json(self.send(request).await?).await
    }

    /// The users that the caller may see.
    pub async fn users(&self) -> anyhow::Result<Vec<UserView>> {
        self.list(self.request(Method::GET, "/people")).await
    }

    pub async fn rename_user(&self, id: UserId, name: UserName) -> anyhow::Result<UserView> {
        let path = format!("/people/{id}");
        self.call_with_body(Method::PATCH, &path, &UserChange { name })
            .await
    }

    /// Removes a user; `confirm` is their name.
    pub async fn remove_user(
        &self,
        id: UserId,
        confirm: Option<String>,
    ) -> anyhow::Result<ChangedAccessView> {
        let path = format!("/people/{id}/remove");
        self.post(&path, &Confirmation { confirm }).await
    }

    /// Sets the caller's password and revokes all their other tokens and sessions.
    pub async fn set_password(
        &self,
        id: UserId,
        new: &NewPassword,
    ) -> anyhow::Result<ChangedAccessView> {
        self.call_with_body(Method::PUT, &format!("/people/{id}/password"), new)
            .await
    }

    /// Registers a team. Only this response has its registration link, which shows the organisers' decision.
    pub async fn register(&self, new: &RegistrationRequest) -> anyhow::Result<NewRegistrationView> {
        let mut created: NewRegistrationView = self.post("/registrations", new).await?;
        self.make_absolute(&mut created.join_link);
        Ok(created)
    }

    /// Creates an invitation; only this response has its link.
    pub async fn invite(&self, new: &NewInvitation) -> anyhow::Result<NewInvitationView> {
        let mut created: NewInvitationView = self.post("/invitations", new).await?;
        self.make_absolute(&mut created.link);
        Ok(created)
    }

    /// The invitations that the caller may manage, the newest first.
    pub async fn invitations(&self) -> anyhow::Result<Vec<InvitationView>> {
        self.list(self.request(Method::GET, "/invitations")).await
    }

    /// Revokes an invitation.
    pub async fn revoke_invitation(&self, id: InvitationId) -> anyhow::Result<InvitationView> {
        self.call(Method::DELETE, &format!("/invitations/{id}"))
            .await
    }

    /// Accepts an invitation; only this response has the token.
    pub async fn join(&self, join: &JoinRequest) -> anyhow::Result<NewAccountView> {
        self.post("/invitations/accept", join).await
    }

    /// Organiser: creates a team. Only this response has its token.
    pub async fn create_team(&self, name: &str) -> anyhow::Result<TeamWithToken> {
        self.post(
            "/teams",
            &NewTeam {
                name: name.to_owned(),
            },
        )
        .await
    }

    /// Organiser: all teams.
    pub async fn teams(&self) -> anyhow::Result<Vec<TeamView>> {
        self.list(self.request(Method::GET, "/teams")).await
    }

    /// Organiser: issues a new token for a team and revokes the old one.
    pub async fn replace_token(&self, team: TeamId) -> anyhow::Result<TeamWithToken> {
        self.post_empty(&format!("/teams/{team}/token")).await
    }

    /// Organiser: disqualifies a team.
    pub async fn disqualify(&self, id: TeamId, decision: &Decision) -> anyhow::Result<TeamView> {
        self.post(&format!("/teams/{id}/disqualify"), decision)
            .await
    }

    /// Organiser: reinstates a disqualified team.
    pub async fn reinstate(&self, id: TeamId, reason: String) -> anyhow::Result<TeamView> {
        self.post(&format!("/teams/{id}/reinstate"), &Reason { reason })
            .await
    }

    pub async fn team(&self, id: TeamId) -> anyhow::Result<TeamView> {
        self.get(&format!("/teams/{id}")).await
    }

    /// Changes a team's name or its description.
    pub async fn change_team(&self, id: TeamId, change: &TeamChange) -> anyhow::Result<TeamView> {
        self.call_with_body(Method::PATCH, &format!("/teams/{id}"), change)
            .await
    }

    /// Retires a team from all future evaluation days; `confirm` is its name.
    pub async fn retire_team(
        &self,
        id: TeamId,
        confirm: Option<String>,
    ) -> anyhow::Result<TeamView> {
        let path = format!("/teams/{id}/retire");
        self.post(&path, &Confirmation { confirm }).await
    }

    /// Returns a retired team to the competition.
    pub async fn return_team(&self, id: TeamId) -> anyhow::Result<TeamView> {
        self.post_empty(&format!("/teams/{id}/return")).await
    }

    /// All versions of the terms, the newest first.
    pub async fn terms(&self) -> anyhow::Result<Vec<TermsView>> {
        self.get("/terms").await
    }

    /// Organiser: publishes a new version of the terms.
    pub async fn publish_terms(&self, text: String) -> anyhow::Result<TermsView> {
        self.post("/terms", &NewTerms { text }).await
    }

    /// Accepts the terms.
    pub async fn accept_terms(&self, version: u32) -> anyhow::Result<UserView> {
        self.post_empty(&format!("/terms/{version}/accept")).await
    }

    /// All announcements, the newest first.
    pub async fn announcements(&self) -> anyhow::Result<Vec<AnnouncementView>> {
        self.list(self.request(Method::GET, "/announcements")).await
    }

    pub async fn announce(&self, title: String, text: String) -> anyhow::Result<AnnouncementView> {
        let new = NewAnnouncement { title, text };
        self.post("/announcements", &new).await
    }

    /// The questions that the caller may read, the newest first.
    pub async fn questions(&self) -> anyhow::Result<Vec<QuestionView>> {
        self.list(self.request(Method::GET, "/questions")).await
    }

    /// Team: asks the organisers.
    pub async fn ask(&self, text: String) -> anyhow::Result<QuestionView> {
        self.post("/questions", &NewQuestion { text }).await
    }

    /// Organiser: answers a question.
    pub async fn answer(
        &self,
        id: QuestionId,
        text: String,
        public: bool,
    ) -> anyhow::Result<QuestionView> {
        let new = NewAnswer { text, public };
        self.call_with_body(Method::PUT, &format!("/questions/{id}/answer"), &new)
            .await
    }

    /// Organiser: all registrations, the newest first.
    pub async fn registrations(&self) -> anyhow::Result<Vec<RegistrationView>> {
        self.list(self.request(Method::GET, "/registrations")).await
    }

    /// Organiser: approves a registration.
    pub async fn approve(&self, id: RegistrationId) -> anyhow::Result<RegistrationView> {
        self.post_empty(&format!("/registrations/{id}/approve"))
            .await
    }

    /// Organiser: refuses a registration.
    pub async fn refuse(
        &self,
        id: RegistrationId,
        reason: String,
    ) -> anyhow::Result<RegistrationView> {
        let path = format!("/registrations/{id}/refuse");
        self.post(&path, &Reason { reason }).await
    }

    /// Organiser: opens or closes registration, or sets the *divisions*, groups of teams that a board can rank among themselves.
    pub async fn change_season(&self, change: &SeasonChange) -> anyhow::Result<SeasonView> {
        self.call_with_body(Method::PATCH, "/season", change).await
    }
}

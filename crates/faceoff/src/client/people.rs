//! What a client asks about people, their teams and their tokens.

use super::Client;
use faceoff_api::{
    requests::{
        Confirmation, Join, NewAnnouncement, NewAnswer, NewInvitation, NewPassword, NewQuestion,
        NewTerms, NewToken, Reason, Register, SeasonChange, TeamChange,
    },
    views::{
        announcement::{AnnouncementView, QuestionView, TermsView},
        invitation::{InvitationView, NewInvitationView, NewRegistrationView, RegistrationView},
        person::{JoinedView, PersonView, WhoView},
        season::SeasonView,
        team::TeamView,
        token::{NewTokenView, TokenView},
    },
};
use faceoff_types::{InvitationId, PersonId, QuestionId, RegistrationId, TeamId, TokenId};
use reqwest::Method;

impl Client {
    pub async fn whoami(&self) -> anyhow::Result<WhoView> {
        self.get("/whoami").await
    }

    /// The tokens and sessions that we may manage, the newest first.
    pub async fn tokens(&self) -> anyhow::Result<Vec<TokenView>> {
        self.list(self.request(Method::GET, "/tokens")).await
    }

    /// Makes a token; its text comes this once.
    pub async fn create_token(&self, new: &NewToken) -> anyhow::Result<NewTokenView> {
        self.tell(Method::POST, "/tokens", new).await
    }

    /// Gives a token another secret, which comes this once.
    pub async fn rotate_token(&self, id: TokenId) -> anyhow::Result<NewTokenView> {
        self.act(Method::POST, &format!("/tokens/{id}/rotate"))
            .await
    }

    pub async fn revoke_token(&self, id: TokenId) -> anyhow::Result<TokenView> {
        self.act(Method::DELETE, &format!("/tokens/{id}")).await
    }

    /// The people whom we may see.
    pub async fn people(&self) -> anyhow::Result<Vec<PersonView>> {
        self.list(self.request(Method::GET, "/people")).await
    }

    /// Lets a person do nothing any more; `confirm` is their name.
    pub async fn remove_person(
        &self,
        id: PersonId,
        confirm: Option<String>,
    ) -> anyhow::Result<PersonView> {
        let path = format!("/people/{id}/remove");
        self.tell(Method::POST, &path, &Confirmation { confirm })
            .await
    }

    /// Sets our own password; all our other tokens and sessions are worth nothing from then on.
    pub async fn set_password(
        &self,
        id: PersonId,
        new: &NewPassword,
    ) -> anyhow::Result<PersonView> {
        self.tell(Method::PUT, &format!("/people/{id}/password"), new)
            .await
    }

    /// Registers a team; its link comes this once.
    pub async fn register(&self, new: &Register) -> anyhow::Result<NewRegistrationView> {
        self.tell(Method::POST, "/registrations", new).await
    }

    /// Makes an invitation; its link comes this once.
    pub async fn invite(&self, new: &NewInvitation) -> anyhow::Result<NewInvitationView> {
        self.tell(Method::POST, "/invitations", new).await
    }

    /// The invitations that we may manage, the newest first.
    pub async fn invitations(&self) -> anyhow::Result<Vec<InvitationView>> {
        self.list(self.request(Method::GET, "/invitations")).await
    }

    /// Takes an invitation back.
    pub async fn revoke_invitation(&self, id: InvitationId) -> anyhow::Result<InvitationView> {
        self.act(Method::DELETE, &format!("/invitations/{id}"))
            .await
    }

    /// Follows an invitation; the token comes this once.
    pub async fn join(&self, join: &Join) -> anyhow::Result<JoinedView> {
        self.tell(Method::POST, "/invitations/accept", join).await
    }

    pub async fn team(&self, id: TeamId) -> anyhow::Result<TeamView> {
        self.get(&format!("/teams/{id}")).await
    }

    /// Changes a team's name, or what it tells of itself.
    pub async fn change_team(&self, id: TeamId, change: &TeamChange) -> anyhow::Result<TeamView> {
        self.tell(Method::PATCH, &format!("/teams/{id}"), change)
            .await
    }

    /// Takes a team out of all days to come; `confirm` is its name.
    pub async fn retire_team(
        &self,
        id: TeamId,
        confirm: Option<String>,
    ) -> anyhow::Result<TeamView> {
        let path = format!("/teams/{id}/retire");
        self.tell(Method::POST, &path, &Confirmation { confirm })
            .await
    }

    /// Lets a team that has retired play again.
    pub async fn return_team(&self, id: TeamId) -> anyhow::Result<TeamView> {
        self.act(Method::POST, &format!("/teams/{id}/return")).await
    }

    /// All versions of the terms, the newest first.
    pub async fn terms(&self) -> anyhow::Result<Vec<TermsView>> {
        self.get("/terms").await
    }

    /// Organiser: publishes other terms.
    pub async fn publish_terms(&self, text: String) -> anyhow::Result<TermsView> {
        self.tell(Method::POST, "/terms", &NewTerms { text }).await
    }

    /// Accepts the terms.
    pub async fn accept_terms(&self, version: u32) -> anyhow::Result<PersonView> {
        self.act(Method::POST, &format!("/terms/{version}/accept"))
            .await
    }

    /// What everybody was told, the newest first.
    pub async fn announcements(&self) -> anyhow::Result<Vec<AnnouncementView>> {
        self.list(self.request(Method::GET, "/announcements")).await
    }

    pub async fn announce(&self, title: String, text: String) -> anyhow::Result<AnnouncementView> {
        let new = NewAnnouncement { title, text };
        self.tell(Method::POST, "/announcements", &new).await
    }

    /// The questions that we may read, the newest first.
    pub async fn questions(&self) -> anyhow::Result<Vec<QuestionView>> {
        self.list(self.request(Method::GET, "/questions")).await
    }

    /// Team: asks the organisers.
    pub async fn ask(&self, text: String) -> anyhow::Result<QuestionView> {
        self.tell(Method::POST, "/questions", &NewQuestion { text })
            .await
    }

    /// Organiser: answers a question.
    pub async fn answer(
        &self,
        id: QuestionId,
        text: String,
        public: bool,
    ) -> anyhow::Result<QuestionView> {
        let new = NewAnswer { text, public };
        self.tell(Method::PUT, &format!("/questions/{id}/answer"), &new)
            .await
    }

    /// Organiser: all registrations, the newest first.
    pub async fn registrations(&self) -> anyhow::Result<Vec<RegistrationView>> {
        self.list(self.request(Method::GET, "/registrations")).await
    }

    /// Organiser: lets a registered team take part.
    pub async fn approve(&self, id: RegistrationId) -> anyhow::Result<RegistrationView> {
        self.act(Method::POST, &format!("/registrations/{id}/approve"))
            .await
    }

    /// Organiser: refuses a registration.
    pub async fn refuse(
        &self,
        id: RegistrationId,
        reason: String,
    ) -> anyhow::Result<RegistrationView> {
        let path = format!("/registrations/{id}/refuse");
        self.tell(Method::POST, &path, &Reason { reason }).await
    }

    /// Organiser: lets anybody register, or nobody; sets the divisions.
    pub async fn change_season(&self, change: &SeasonChange) -> anyhow::Result<SeasonView> {
        self.tell(Method::PATCH, "/season", change).await
    }
}

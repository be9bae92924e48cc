//! Values as text columns of SQLite (feature `sqlx`): a value is stored as its `Display` text and parsed by its `FromStr`.

use crate::{
    AblationId, AnnouncementId, DeliveryId, DivisionName, EvaluationId, GameId, GameSeedLabel,
    IanaTimeZone, InvitationId, Profile, ProposalId, QuestionId, RegistrationId, Ruleset, RunId,
    SeedLabel, ShardId, StageId, StageName, SubmissionId, Task, TeamId, TeamName, TokenId,
    TournamentId, UserId, UserName, WebhookId,
};

/// Implements sqlx's traits for types with `Display` and `FromStr`, so that queries bind and return them as text.
#[macro_export]
macro_rules! sqlite_text {
    ($($name:ty),+ $(,)?) => {$(
        impl ::sqlx::Type<::sqlx::Sqlite> for $name {
            fn type_info() -> ::sqlx::sqlite::SqliteTypeInfo {
                <String as ::sqlx::Type<::sqlx::Sqlite>>::type_info()
            }
        }

        impl ::sqlx::Encode<'_, ::sqlx::Sqlite> for $name {
            fn encode_by_ref(
                &self,
                buffer: &mut ::sqlx::sqlite::SqliteArgumentsBuffer,
            ) -> Result<::sqlx::encode::IsNull, ::sqlx::error::BoxDynError> {
                ::sqlx::Encode::<::sqlx::Sqlite>::encode(self.to_string(), buffer)
            }
        }

        impl<'r> ::sqlx::Decode<'r, ::sqlx::Sqlite> for $name {
            fn decode(value: ::sqlx::sqlite::SqliteValueRef<'r>) -> Result<Self, ::sqlx::error::BoxDynError> {
                let text = <&str as ::sqlx::Decode<'r, ::sqlx::Sqlite>>::decode(value)?;
                Ok(text.parse()?)
            }
        }
    )+};
}

sqlite_text!(
    AblationId,
    AnnouncementId,
    DeliveryId,
    DivisionName,
    EvaluationId,
    GameId,
    GameSeedLabel,
    InvitationId,
    Profile,
    ProposalId,
    QuestionId,
    RegistrationId,
    RunId,
    Ruleset,
    SeedLabel,
    ShardId,
    StageId,
    StageName,
    SubmissionId,
    Task,
    TeamId,
    TeamName,
    TokenId,
    TournamentId,
    UserId,
    UserName,
    WebhookId,
    IanaTimeZone,
);

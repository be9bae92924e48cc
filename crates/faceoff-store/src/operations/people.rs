//! What people do with their accounts, and organisers with people.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::tokens::revoke_all,
    store::Store,
    tables::{
        people::{self, Person},
        terms::{self, Terms},
        tokens::{self, TokenOwner},
    },
};
use faceoff_types::{PersonId, TeamId, TokenId};
use jiff::Timestamp;

impl Store {
    /// Everybody who has ever joined, by name.
    #[boxed]
    pub async fn people(&self) -> Result<Vec<Person>> {
        people::all(&mut *self.database.read.acquire().await?).await
    }

    /// The members that a team has and has had, by name.
    #[boxed]
    pub async fn members_of(&self, team: TeamId) -> Result<Vec<Person>> {
        people::of_team(&mut *self.database.read.acquire().await?, team).await
    }

    /// The person with this id.
    #[boxed]
    pub async fn person(&self, id: PersonId) -> Result<Person> {
        people::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// The PHC string of the password of whoever has this name, if they are there and have one.
    #[boxed]
    pub async fn password_of(&self, name: &str) -> Result<Option<(PersonId, String)>> {
        people::with_password(&mut *self.database.read.acquire().await?, name).await
    }

    /// Gives a person another password, as a PHC string. All that they have is revoked but the token with which they
    /// do it.
    #[boxed]
    pub async fn set_password(
        &self,
        actor: Actor,
        id: PersonId,
        password: &str,
        by: TokenId,
        now: Timestamp,
    ) -> Result<Person> {
        self.write(actor, now, async |tx| {
            people::set_password(tx, id, password).await?;
            revoke_all(tx, TokenOwner::Person(id), Some(by)).await?;
            tx.record(Subject::Person(id), Event::PasswordSet);
            people::find(tx, id).await
        })
        .await
    }

    /// Lets a person do nothing any more, at once: their keys and sessions are revoked. Their name stays with what they
    /// did. [`StoreError::Conflict`] if they have left, or are the last who can organise: no other organiser, and no
    /// good token of the host's.
    #[boxed]
    pub async fn remove_person(
        &self,
        actor: Actor,
        id: PersonId,
        now: Timestamp,
    ) -> Result<Person> {
        self.write(actor, now, async |tx| {
            let person = people::find(tx, id).await?;
            if person.left_at.is_some() {
                return Err(StoreError::Conflict(format!("{} has left", person.name)));
            }
            let is_last = person.team.is_none() && people::organisers(tx).await? == 1;
            if is_last && tokens::count_good(tx, TokenOwner::Host, now).await? == 0 {
                return Err(StoreError::Conflict(format!(
                    "{} is the last who can organise: invite another organiser first",
                    person.name
                )));
            }
            people::set_left(tx, id, now).await?;
            revoke_all(tx, TokenOwner::Person(id), None).await?;
            let name = person.name;
            tx.record(Subject::Person(id), Event::PersonLeft { name });
            people::find(tx, id).await
        })
        .await
    }

    /// All versions of the terms, the newest first.
    #[boxed]
    pub async fn terms(&self) -> Result<Vec<Terms>> {
        terms::all(&mut *self.database.read.acquire().await?).await
    }

    /// Publishes other terms. Who has accepted older ones neither uploads nor chooses submissions until somebody of the
    /// team accepts these. [`StoreError::Conflict`] if they are what they were.
    #[boxed]
    pub async fn publish_terms(&self, actor: Actor, text: &str, now: Timestamp) -> Result<Terms> {
        self.write(actor, now, async |tx| {
            let newest = terms::all(tx).await?.into_iter().next();
            if newest.as_ref().is_some_and(|newest| newest.text == text) {
                return Err(StoreError::Conflict(
                    "these are the terms that there are; nothing was changed".into(),
                ));
            }
            let new = Terms {
                version: newest.map_or(0, |newest| newest.version) + 1,
                since: now,
                text: text.to_owned(),
            };
            terms::insert(tx, &new).await?;
            let version = new.version;
            tx.record(Subject::Season, Event::TermsPublished { version });
            Ok(new)
        })
        .await
    }

    /// A person accepts the terms. [`StoreError::Conflict`] unless `version` is the newest.
    #[boxed]
    pub async fn accept_terms(
        &self,
        actor: Actor,
        id: PersonId,
        version: u32,
        now: Timestamp,
    ) -> Result<Person> {
        self.write(actor, now, async |tx| {
            match terms::newest(tx).await? {
                Some(newest) if newest == version => {}
                Some(newest) => {
                    return Err(StoreError::Conflict(format!(
                        "version: expected {newest}, the newest of the terms, got {version}"
                    )));
                }
                None => return Err(StoreError::Conflict("this season has no terms".into())),
            }
            let person = people::find(tx, id).await?;
            if person.accepted_terms != Some(version) {
                people::set_accepted_terms(tx, id, version).await?;
                tx.record(Subject::Person(id), Event::TermsAccepted { version });
            }
            people::find(tx, id).await
        })
        .await
    }
}

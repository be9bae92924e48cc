//! Passwords: hashed by Argon2id, and tried out slowly.
//!
//! A hash takes memory and tens of milliseconds, so that few are computed at a time; and whoever guesses a person's
//! password has ever longer to wait. That delays whoever knows it, too: keys, sessions and links are not affected.

use crate::{
    boxed,
    problem::{Problem, ProblemKind},
};
use argon2::{
    Argon2,
    password_hash::{PasswordHasher, PasswordVerifier, phc::PasswordHash},
};
use faceoff_types::PersonId;
use jiff::{SignedDuration, Timestamp};
use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Semaphore;

/// Shortest password, in characters.
pub const MIN_CHARS: usize = 12;
/// Longest one, in bytes: hashing takes time with the length.
const MAX_BYTES: usize = 1024;
/// Hashes at a time; each takes 19 MiB.
const AT_A_TIME: usize = 2;
/// Who may wait for their turn.
const WAITING: usize = 16;
/// Wrong passwords of a person that cost no wait.
const FREE: u32 = 5;
/// The wait after one more, which doubles with each.
const FIRST_WAIT: SignedDuration = SignedDuration::from_secs(2);
const LONGEST_WAIT: SignedDuration = SignedDuration::from_mins(5);

/// The places for hashing, and who has guessed how often.
#[derive(Debug)]
pub struct Passwords {
    places: Semaphore,
    waiting: Semaphore,
    wrong: Mutex<HashMap<PersonId, Wrong>>,
}

/// Wrong passwords since the last right one.
#[derive(Debug, Clone, Copy)]
struct Wrong {
    count: u32,
    last: Timestamp,
}

impl Wrong {
    fn wait_until(self) -> Timestamp {
        let Some(doublings) = self.count.checked_sub(FREE) else {
            return Timestamp::MIN;
        };
        let factor = 1_i32.checked_shl(doublings).unwrap_or(i32::MAX).max(1);
        let wait = FIRST_WAIT.saturating_mul(factor).min(LONGEST_WAIT);
        self.last.saturating_add(wait).unwrap_or(Timestamp::MAX)
    }
}

impl Default for Passwords {
    fn default() -> Self {
        Self {
            places: Semaphore::new(AT_A_TIME),
            waiting: Semaphore::new(WAITING),
            wrong: Mutex::new(HashMap::new()),
        }
    }
}

/// Refuses a password that would be too easily guessed, or takes too long.
pub fn check(password: &str) -> Result<(), Problem> {
    let chars = password.chars().count();
    if chars < MIN_CHARS || password.len() > MAX_BYTES {
        let detail = format!(
            "expected {MIN_CHARS} or more characters and at most {MAX_BYTES} bytes, got {chars} characters"
        );
        return Err(Problem::invalid("password", detail));
    }
    Ok(())
}

impl Passwords {
    /// One after another, off the threads that answer requests.
    async fn hashing<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let Ok(_waiting) = self.waiting.try_acquire() else {
            return Err(Problem::new(
                ProblemKind::Busy,
                "many people sign in at the moment; try again in 2 s",
            ));
        };
        let _place = self.places.acquire().await.map_err(Problem::internal)?;
        tokio::task::spawn_blocking(work)
            .await
            .map_err(Problem::internal)
    }

    /// The PHC string of a new password.
    #[boxed]
    pub async fn hash(&self, password: String) -> Result<String, Problem> {
        check(&password)?;
        let hashed = self.hashing(move || {
            let hash = Argon2::default().hash_password(password.as_bytes());
            hash.map(|hash| hash.to_string())
        });
        hashed.await?.map_err(Problem::internal)
    }

    /// Is it the password of whoever has this name? `known` is that person and the PHC string of theirs. Takes as long
    /// if there is no such person.
    #[boxed]
    pub async fn verify(
        &self,
        known: Option<(PersonId, String)>,
        password: String,
        now: Timestamp,
    ) -> Result<Option<PersonId>, Problem> {
        if let Some((id, _)) = &known {
            self.check_wait(*id, now)?;
        }
        let (id, hash) = known.unzip();
        let matches = self.hashing(move || match hash {
            Some(hash) => PasswordHash::new(&hash).is_ok_and(|hash| {
                Argon2::default()
                    .verify_password(password.as_bytes(), &hash)
                    .is_ok()
            }),
            None => {
                // For the time alone.
                let _ = Argon2::default().hash_password(password.as_bytes());
                false
            }
        });
        let matches = matches.await?;
        let Some(id) = id else { return Ok(None) };
        let mut wrong = self.wrong();
        if matches {
            wrong.remove(&id);
            return Ok(Some(id));
        }
        let count = wrong.get(&id).map_or(0, |wrong| wrong.count) + 1;
        wrong.insert(id, Wrong { count, last: now });
        Ok(None)
    }

    fn check_wait(&self, id: PersonId, now: Timestamp) -> Result<(), Problem> {
        let until = self.wrong().get(&id).map(|wrong| wrong.wait_until());
        let Some(until) = until.filter(|until| *until > now) else {
            return Ok(());
        };
        let seconds = until.duration_since(now).as_secs().unsigned_abs() + 1;
        let problem = Problem::new(
            ProblemKind::TooManySignIns,
            format!(
                "wrong passwords came for this name, one after another; try again in {seconds} s, or ask an organiser \
                 for a link"
            ),
        );
        Err(problem.retry_after(seconds))
    }

    fn wrong(&self) -> MutexGuard<'_, HashMap<PersonId, Wrong>> {
        self.wrong.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_password_is_known_again_and_guessing_gets_slower() {
        let passwords = Passwords::default();
        let mut now: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let hash = passwords
            .hash("correct horse battery".into())
            .await
            .unwrap();
        assert!(hash.starts_with("$argon2id$"), "{hash}");
        let id = PersonId::new();
        let known = || Some((id, hash.clone()));
        let verify =
            async |password: &str, now| passwords.verify(known(), password.into(), now).await;
        assert_eq!(
            verify("correct horse battery", now).await.unwrap(),
            Some(id)
        );
        for _ in 0..FREE {
            assert_eq!(verify("wrong", now).await.unwrap(), None);
        }
        let refused = verify("correct horse battery", now).await.unwrap_err();
        assert_eq!(refused.kind(), ProblemKind::TooManySignIns);
        now += FIRST_WAIT;
        assert_eq!(verify("wrong", now).await.unwrap(), None);
        now += FIRST_WAIT;
        assert!(verify("wrong", now).await.is_err(), "it doubles");
        now += FIRST_WAIT;
        assert_eq!(
            verify("correct horse battery", now).await.unwrap(),
            Some(id)
        );
        assert_eq!(verify("wrong", now).await.unwrap(), None, "forgiven");
        let nobody = passwords.verify(None, "wrong".into(), now).await;
        assert_eq!(nobody.unwrap(), None);
    }

    #[test]
    fn the_wait_is_bounded() {
        let now = "2026-03-01T10:00:00Z".parse().unwrap();
        for count in [FREE + 10, FREE + 40, u32::MAX] {
            let wrong = Wrong { count, last: now };
            assert_eq!(wrong.wait_until(), now + LONGEST_WAIT, "{count}");
        }
    }

    #[test]
    fn short_and_endless_passwords_are_refused() {
        assert!(check(&"é".repeat(MIN_CHARS)).is_ok());
        assert!(check(&"a".repeat(MIN_CHARS - 1)).is_err());
        assert!(check(&"a".repeat(MAX_BYTES + 1)).is_err());
    }
}

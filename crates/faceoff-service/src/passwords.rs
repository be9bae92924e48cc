//! Passwords: hashed by Argon2id, with a delay after wrong ones.
//!
//! A hash takes memory and tens of milliseconds, so only few are computed at a time. After several wrong passwords for
//! a user each further attempt has to wait longer. The delay also affects the user, whose tokens, sessions and links keep
//! working meanwhile.

use crate::{
    boxed,
    problem::{Problem, ProblemKind},
};
use argon2::{
    Argon2,
    password_hash::{PasswordHasher, PasswordVerifier, phc::PasswordHash},
};
use faceoff_types::UserId;
use jiff::{SignedDuration, Timestamp};
use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Semaphore;

/// Shortest password, in characters.
pub const MIN_CHARS: usize = 12;
/// Longest password, in bytes: the time of hashing grows with the length.
const MAX_BYTES: usize = 1024;
/// Hashes that are computed in parallel; each takes 19 MiB.
const MAX_PARALLEL: usize = 2;
/// Requests that may wait for a hash at the same time; further ones are refused.
const MAX_WAITING: usize = 16;
/// Number of wrong passwords for a user that cause no delay.
const FREE_ATTEMPTS: u32 = 5;
/// Delay after the first wrong password beyond these; doubles with each further one.
const FIRST_WAIT: SignedDuration = SignedDuration::from_secs(2);
/// The delay does not grow beyond this.
const LONGEST_WAIT: SignedDuration = SignedDuration::from_mins(5);

/// Limits concurrent hashing, and counts wrong passwords by user.
#[derive(Debug)]
pub struct Passwords {
    /// One permit per hash that is being computed.
    hashing: Semaphore,
    /// One permit per request that waits for a hash or computes one.
    waiting: Semaphore,
    failures: Mutex<HashMap<UserId, Failures>>,
}

/// Wrong passwords since the last correct one.
#[derive(Debug, Clone, Copy)]
struct Failures {
    count: u32,
    /// When the newest one was entered.
    last_at: Timestamp,
}

impl Failures {
    /// The time before which further attempts are refused.
    fn wait_until(self) -> Timestamp {
        let Some(doublings) = self.count.checked_sub(FREE_ATTEMPTS) else {
            return Timestamp::MIN;
        };
        let factor = 1_i32.checked_shl(doublings).unwrap_or(i32::MAX).max(1);
        let wait = FIRST_WAIT.saturating_mul(factor).min(LONGEST_WAIT);
        self.last_at.saturating_add(wait).unwrap_or(Timestamp::MAX)
    }
}

impl Default for Passwords {
    fn default() -> Self {
        Self {
            hashing: Semaphore::new(MAX_PARALLEL),
            waiting: Semaphore::new(MAX_WAITING),
            failures: Mutex::new(HashMap::new()),
        }
    }
}

/// Refuses a password that is too short, or too long to hash.
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
    /// Runs `compute_hash` on a blocking thread, [`MAX_PARALLEL`] at a time.
    async fn run_hashing<T: Send + 'static>(
        &self,
        compute_hash: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let Ok(_waiting) = self.waiting.try_acquire() else {
            return Err(Problem::new(
                ProblemKind::Busy,
                "too many sign-ins at the moment; try again in 2 s",
            ));
        };
        let _permit = self.hashing.acquire().await.map_err(Problem::internal)?;
        tokio::task::spawn_blocking(compute_hash)
            .await
            .map_err(Problem::internal)
    }

    /// Hashes a new password. The result is a PHC string: algorithm, parameters, salt and hash in one text.
    #[boxed]
    pub async fn hash(&self, password: String) -> Result<String, Problem> {
        check(&password)?;
        let hashed = self.run_hashing(move || {
            let hash = Argon2::default().hash_password(password.as_bytes());
            hash.map(|hash| hash.to_string())
        });
        hashed.await?.map_err(Problem::internal)
    }

    /// Verifies a password; returns the user if it is correct. `account` is the user with the stored hash (PHC string), or
    /// `None` if there is no user of that name; this takes the same time, so an attacker cannot find out names.
    #[boxed]
    pub async fn verify(
        &self,
        account: Option<(UserId, String)>,
        password: String,
        now: Timestamp,
    ) -> Result<Option<UserId>, Problem> {
        if let Some((id, _)) = &account {
            self.check_wait(*id, now)?;
        }
        let (id, hash) = account.unzip();
        let matches = self.run_hashing(move || match hash {
            Some(hash) => PasswordHash::new(&hash).is_ok_and(|hash| {
                Argon2::default()
                    .verify_password(password.as_bytes(), &hash)
                    .is_ok()
            }),
            None => {
                // Only so that it takes the same time.
                let _ = Argon2::default().hash_password(password.as_bytes());
                false
            }
        });
        let matches = matches.await?;
        let Some(id) = id else { return Ok(None) };
        let mut failures = self.failures();
        if matches {
            failures.remove(&id);
            return Ok(Some(id));
        }
        let count = failures.get(&id).map_or(0, |failures| failures.count) + 1;
        failures.insert(
            id,
            Failures {
                count,
                last_at: now,
            },
        );
        Ok(None)
    }

    fn check_wait(&self, id: UserId, now: Timestamp) -> Result<(), Problem> {
        let until = self
            .failures()
            .get(&id)
            .map(|failures| failures.wait_until());
        let Some(until) = until.filter(|until| *until > now) else {
            return Ok(());
        };
        let seconds = until.duration_since(now).as_secs().unsigned_abs() + 1;
        let problem = Problem::new(
            ProblemKind::TooManySignIns,
            format!(
                "too many wrong passwords for this name; try again in {seconds} s, or ask an organiser for a link"
            ),
        );
        Err(problem.retry_after(seconds))
    }

    fn failures(&self) -> MutexGuard<'_, HashMap<UserId, Failures>> {
        self.failures.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn wrong_passwords_delay_further_attempts() {
        let passwords = Passwords::default();
        let mut now: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let hash = passwords
            .hash("correct horse battery".into())
            .await
            .unwrap();
        assert!(hash.starts_with("$argon2id$"), "{hash}");
        let id = UserId::new();
        let account = || Some((id, hash.clone()));
        let verify =
            async |password: &str, now| passwords.verify(account(), password.into(), now).await;
        assert_eq!(
            verify("correct horse battery", now).await.unwrap(),
            Some(id)
        );
        for _ in 0..FREE_ATTEMPTS {
            assert_eq!(verify("wrong", now).await.unwrap(), None);
        }
        let refused = verify("correct horse battery", now).await.unwrap_err();
        assert_eq!(refused.kind(), ProblemKind::TooManySignIns);
        now += FIRST_WAIT;
        assert_eq!(verify("wrong", now).await.unwrap(), None);
        now += FIRST_WAIT;
        assert!(verify("wrong", now).await.is_err(), "the delay doubles");
        now += FIRST_WAIT;
        assert_eq!(
            verify("correct horse battery", now).await.unwrap(),
            Some(id)
        );
        assert_eq!(
            verify("wrong", now).await.unwrap(),
            None,
            "the count restarts"
        );
        let unknown = passwords.verify(None, "wrong".into(), now).await;
        assert_eq!(unknown.unwrap(), None);
    }

    #[test]
    fn delay_is_bounded() {
        let now = "2026-03-01T10:00:00Z".parse().unwrap();
        for count in [FREE_ATTEMPTS + 10, FREE_ATTEMPTS + 40, u32::MAX] {
            let failures = Failures {
                count,
                last_at: now,
            };
            assert_eq!(failures.wait_until(), now + LONGEST_WAIT, "{count}");
        }
    }

    #[test]
    fn short_and_long_passwords_are_refused() {
        assert!(check(&"é".repeat(MIN_CHARS)).is_ok());
        assert!(check(&"a".repeat(MIN_CHARS - 1)).is_err());
        assert!(check(&"a".repeat(MAX_BYTES + 1)).is_err());
    }
}

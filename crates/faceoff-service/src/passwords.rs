//! Passwords: hashed by Argon2id, with a delay after wrong ones.
//!
//! A hash takes memory and tens of milliseconds, so only few are computed at a time, in the order of the requests, and each client has
//! few places in the queue. After several wrong passwords for a name each further attempt has to wait longer, whether or not there is a
//! user of that name. The delay also affects the user, whose tokens, sessions and links keep working meanwhile.

use crate::{
    boxed_future,
    network::Network,
    problem::{Problem, ProblemKind},
};
use argon2::{
    Argon2,
    password_hash::{PasswordHasher, PasswordVerifier, phc::PasswordHash},
};
use faceoff_types::{UserId, name_skeleton};
use jiff::{SignedDuration, Timestamp};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Semaphore;

/// Shortest password, in characters.
pub const MIN_CHARS: usize = 12;
/// Longest password, in bytes: the time of hashing grows with the length.
const MAX_BYTES: usize = 1024;
/// Hashes that are computed in parallel; each takes 19 MiB.
const MAX_PARALLEL: usize = 2;
/// Requests that may wait for a hash at the same time; further ones are refused.
const MAX_WAITING: usize = 64;
/// Requests of one client among them. Clients whose address is unknown, behind a proxy that does not name it, count as one.
const MAX_WAITING_PER_CLIENT: usize = 8;
const MAX_WAITING_UNKNOWN: usize = 16;
/// Number of wrong passwords for a name that cause no delay.
const FREE_ATTEMPTS: u32 = 5;
/// Delay after the first wrong password beyond these; doubles with each further one.
const FIRST_WAIT: SignedDuration = SignedDuration::from_secs(2);
/// The delay does not grow beyond this.
const LONGEST_WAIT: SignedDuration = SignedDuration::from_mins(5);
/// More doublings of the first wait exceed the longest one.
const MAX_DOUBLINGS: u32 = 20;
/// Names whose wrong passwords are remembered. Beyond, those with the fewest are forgotten.
const MAX_NAMES: usize = 10_000;
/// Wrong passwords are forgotten this long after the last one.
const REMEMBERED_FOR: SignedDuration = SignedDuration::from_hours(1);

/// Limits concurrent hashing, and counts wrong passwords by name.
#[derive(Debug)]
pub struct Passwords {
    /// One permit per hash that is being computed.
    hashing: Arc<Semaphore>,
    /// Number of requests that wait for a hash or compute one, by client.
    places: Arc<Mutex<HashMap<Option<Network>, usize>>>,
    failures: Mutex<HashMap<NameKey, Failures>>,
}

/// A hash of a name to sign in with, the same for names that look alike. Names can be as long as a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct NameKey([u8; 32]);

impl NameKey {
    fn new(name: &str) -> Self {
        Self(*blake3::hash(name_skeleton(name).as_bytes()).as_bytes())
    }

    /// Of a user, whose name may look like that of another one in a database of an earlier version.
    fn of_user(id: UserId) -> Self {
        Self(*blake3::hash(id.as_uuid().as_bytes()).as_bytes())
    }
}

/// Attempts since the last correct password, the running ones included.
#[derive(Debug, Clone, Copy)]
struct Failures {
    count: u32,
    /// When the newest one began.
    last_at: Timestamp,
    /// The user of this name, if there is one.
    user: Option<UserId>,
}

/// Wrong passwords in the last hour.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WrongPasswords {
    /// For each user, the most first.
    pub by_user: Vec<(UserId, u32)>,
    /// For names that no user has, together.
    pub unknown_names: u32,
}

impl WrongPasswords {
    pub fn total(&self) -> u32 {
        let of_users: u32 = self.by_user.iter().map(|(_, count)| count).sum();
        of_users.saturating_add(self.unknown_names)
    }
}

impl Failures {
    /// The time before which further attempts are refused.
    fn wait_until(self) -> Timestamp {
        let Some(doublings) = self.count.checked_sub(FREE_ATTEMPTS) else {
            return Timestamp::MIN;
        };
        let factor = 1_i32 << doublings.min(MAX_DOUBLINGS);
        let wait = FIRST_WAIT.saturating_mul(factor).min(LONGEST_WAIT);
        self.last_at.saturating_add(wait).unwrap_or(Timestamp::MAX)
    }
}

impl Default for Passwords {
    fn default() -> Self {
        Self {
            hashing: Arc::new(Semaphore::new(MAX_PARALLEL)),
            places: Arc::default(),
            failures: Mutex::default(),
        }
    }
}

/// A place in the queue for hashes, until it is dropped.
struct Place {
    places: Arc<Mutex<HashMap<Option<Network>, usize>>>,
    client: Option<Network>,
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut places = lock(&self.places);
        if let Some(count) = places.get_mut(&self.client) {
            *count -= 1;
            if *count == 0 {
                places.remove(&self.client);
            }
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
    /// A place in the queue for hashes.
    fn take_place(&self, client: Option<Network>) -> Result<Place, Problem> {
        let max = match client {
            Some(_) => MAX_WAITING_PER_CLIENT,
            None => MAX_WAITING_UNKNOWN,
        };
        let mut places = lock(&self.places);
        let all: usize = places.values().sum();
        let own = places.entry(client).or_default();
        if *own >= max || all >= MAX_WAITING {
            if *own == 0 {
                places.remove(&client);
            }
            return Err(Problem::new(
                ProblemKind::Busy,
                "too many sign-ins at the moment; try again in 2 s",
            ));
        }
        *own += 1;
        Ok(Place {
            places: Arc::clone(&self.places),
            client,
        })
    }

    /// Runs `compute_hash` on a blocking thread, [`MAX_PARALLEL`] at a time. It holds its place to the end, also if the client has closed
    /// the connection.
    async fn run_hashing<T: Send + 'static>(
        &self,
        place: Place,
        compute_hash: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        // Permits are given in the order of the requests.
        let permit = Arc::clone(&self.hashing).acquire_owned().await;
        let permit = permit.map_err(Problem::internal)?;
        let computed = tokio::task::spawn_blocking(move || {
            let _held = (place, permit);
            compute_hash()
        });
        computed.await.map_err(Problem::internal)
    }

    /// Hashes a new password. The result is a PHC string: algorithm, parameters, salt and hash in one text.
    #[boxed_future]
    pub async fn hash(&self, password: String, client: Option<Network>) -> Result<String, Problem> {
        check(&password)?;
        let place = self.take_place(client)?;
        let hashed = self.run_hashing(place, move || {
            let hash = Argon2::default().hash_password(password.as_bytes());
            hash.map(|hash| hash.to_string())
        });
        hashed.await?.map_err(Problem::internal)
    }

    /// Verifies a password for a name; returns the user if it is correct. `account` is the user of that name with the stored hash (PHC
    /// string), or `None`; then all takes the same time and has the same answers, so an attacker cannot find out names.
    #[boxed_future]
    pub async fn verify(
        &self,
        name: &str,
        account: Option<(UserId, String)>,
        password: String,
        client: Option<Network>,
        now: Timestamp,
    ) -> Result<Option<UserId>, Problem> {
        let (id, hash) = account.unzip();
        let name = id.map_or_else(|| NameKey::new(name), NameKey::of_user);
        let place = self.take_place(client)?;
        // Counted before the hash is computed, since many attempts may run at once.
        self.count_attempt(name, id, now)?;
        let matches = self.run_hashing(place, move || match hash {
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
        if !matches.await? {
            return Ok(None);
        }
        lock(&self.failures).remove(&name);
        Ok(id)
    }

    /// Counts an attempt as failed, which it is until its password turns out to be correct.
    fn count_attempt(
        &self,
        name: NameKey,
        user: Option<UserId>,
        now: Timestamp,
    ) -> Result<(), Problem> {
        let mut failures = lock(&self.failures);
        failures.retain(|_, failures| now.duration_since(failures.last_at) < REMEMBERED_FOR);
        let earlier = failures.get(&name).copied();
        let until = earlier.map(Failures::wait_until);
        if let Some(until) = until.filter(|until| *until > now) {
            let seconds = until.duration_since(now).as_secs().unsigned_abs() + 1;
            let problem = Problem::new(
                ProblemKind::TooManySignIns,
                format!(
                    "too many wrong passwords for this name; try again in {seconds} s, or ask an organiser for a link"
                ),
            );
            return Err(problem.retry_after(seconds));
        }
        if earlier.is_none() && failures.len() >= MAX_NAMES {
            let fewest = failures
                .iter()
                .min_by_key(|(_, failures)| (failures.count, failures.last_at));
            if let Some(fewest) = fewest.map(|(name, _)| *name) {
                failures.remove(&fewest);
            }
        }
        let count = earlier.map_or(0, |earlier| earlier.count).saturating_add(1);
        let last_at = now;
        failures.insert(
            name,
            Failures {
                count,
                last_at,
                user,
            },
        );
        Ok(())
    }

    /// The wrong passwords that are remembered at `now`, for organisers.
    pub fn wrong_passwords(&self, now: Timestamp) -> WrongPasswords {
        let mut found = WrongPasswords::default();
        for failures in lock(&self.failures).values() {
            if now.duration_since(failures.last_at) >= REMEMBERED_FOR {
                continue;
            }
            match failures.user {
                Some(user) => found.by_user.push((user, failures.count)),
                None => {
                    found.unknown_names = found.unknown_names.saturating_add(failures.count);
                }
            }
        }
        found
            .by_user
            .sort_by_key(|(user, count)| (std::cmp::Reverse(*count), *user));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: &str = "Ada";

    fn now() -> Timestamp {
        "2026-03-01T10:00:00Z".parse().unwrap()
    }

    fn client(last: u8) -> Option<Network> {
        Some(Network::from_address([192, 0, 2, last].into()))
    }

    #[tokio::test]
    async fn wrong_passwords_delay_further_attempts() {
        let passwords = Passwords::default();
        let mut now = now();
        let hash = passwords
            .hash("correct horse battery".into(), None)
            .await
            .unwrap();
        assert!(hash.starts_with("$argon2id$"), "{hash}");
        let id = UserId::new();
        let account = || Some((id, hash.clone()));
        let verify = async |password: &str, now| {
            let password = password.to_owned();
            passwords.verify(NAME, account(), password, None, now).await
        };
        assert_eq!(
            verify("correct horse battery", now).await.unwrap(),
            Some(id)
        );
        for _ in 0..FREE_ATTEMPTS {
            assert_eq!(verify("wrong", now).await.unwrap(), None);
        }
        assert_eq!(passwords.wrong_passwords(now).by_user, [(id, 5)]);
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
        now += REMEMBERED_FOR;
        assert_eq!(passwords.wrong_passwords(now), WrongPasswords::default());
    }

    #[tokio::test]
    async fn unknown_name_gets_the_same_answers_as_a_known_one() {
        let passwords = Passwords::default();
        let account = || Some((UserId::new(), "$argon2id$".to_owned()));
        let mut answers = Vec::new();
        for (name, account) in [("Ada", account()), ("Eve", None)] {
            for attempt in 0..2 * FREE_ATTEMPTS {
                // Names are equal regardless of case.
                let name = if attempt % 2 == 0 {
                    name
                } else {
                    &name.to_uppercase()
                };
                let verified = passwords
                    .verify(name, account.clone(), "wrong".into(), None, now())
                    .await;
                answers.push(verified.map_err(|problem| problem.detail().to_owned()));
            }
        }
        let (known, unknown) = answers.split_at(2 * FREE_ATTEMPTS as usize);
        assert_eq!(known, unknown);
        assert!(known[5].is_err(), "{known:?}");
        let wrong = passwords.wrong_passwords(now());
        assert_eq!((wrong.unknown_names, wrong.total()), (5, 10));
    }

    #[tokio::test]
    async fn parallel_attempts_are_counted_before_they_are_checked() {
        let passwords = Passwords::default();
        let attempts = (0..40)
            .map(|number| passwords.verify(NAME, None, "wrong".into(), client(number), now()));
        let answers = futures::future::join_all(attempts).await;
        let checked = answers.iter().filter(|answer| answer.is_ok()).count();
        assert_eq!(checked, FREE_ATTEMPTS as usize);
    }

    #[tokio::test]
    async fn client_cannot_fill_the_queue_for_password_hashes() {
        let passwords = Passwords::default();
        let places: Vec<_> = (0..MAX_WAITING_PER_CLIENT)
            .map(|_| {
                passwords
                    .take_place(client(1))
                    .unwrap_or_else(|_| panic!("a place"))
            })
            .collect();
        for _ in 0..100 {
            let refused = passwords.verify(NAME, None, "wrong".into(), client(1), now());
            assert_eq!(refused.await.unwrap_err().kind(), ProblemKind::Busy);
        }
        // Requests without a place are not counted as attempts.
        assert_eq!(passwords.wrong_passwords(now()).total(), 0);
        assert!(
            passwords
                .hash("a long password".into(), client(2))
                .await
                .is_ok()
        );
        drop(places);
        assert!(
            passwords
                .hash("a long password".into(), client(1))
                .await
                .is_ok()
        );
        assert!(lock(&passwords.places).is_empty());
    }

    #[tokio::test]
    async fn closed_connection_keeps_its_place_while_the_hash_is_computed() {
        let passwords = Passwords::default();
        let (started, is_started) = std::sync::mpsc::channel();
        let (end, ended) = std::sync::mpsc::channel::<()>();
        let place = passwords
            .take_place(client(1))
            .unwrap_or_else(|_| panic!("a place"));
        let computing = passwords.run_hashing(place, move || {
            let _ = started.send(());
            let _ = ended.recv();
        });
        let mut computing = Box::pin(computing);
        while is_started.try_recv().is_err() {
            let pause = std::time::Duration::from_millis(1);
            let _ = tokio::time::timeout(pause, &mut computing).await;
        }
        drop(computing);
        assert_eq!(lock(&passwords.places).len(), 1);
        assert_eq!(passwords.hashing.available_permits(), MAX_PARALLEL - 1);
        drop(end);
        while !lock(&passwords.places).is_empty() {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
    }

    #[test]
    fn names_with_the_fewest_wrong_passwords_are_forgotten() {
        let passwords = Passwords::default();
        let count = |name: &str| passwords.count_attempt(NameKey::new(name), None, now());
        for _ in 0..FREE_ATTEMPTS {
            count(NAME).unwrap_or_else(|_| panic!("a free attempt"));
        }
        for number in 0..MAX_NAMES + 10 {
            count(&number.to_string()).unwrap_or_else(|_| panic!("a free attempt"));
        }
        assert_eq!(lock(&passwords.failures).len(), MAX_NAMES);
        assert!(count(NAME).is_err(), "it is remembered");
    }

    #[test]
    fn delay_is_bounded() {
        let now = now();
        for count in [FREE_ATTEMPTS + 10, FREE_ATTEMPTS + 40, u32::MAX] {
            let failures = Failures {
                count,
                last_at: now,
                user: None,
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

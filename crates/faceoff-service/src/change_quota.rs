//! The number of changes that a team may make per UTC day: requests of its members and API clients that are not only reads. Each
//! leaves rows in the database, such as events, for the whole season, so a team must not be able to make any number of them.
//! Deletions and revocations are not counted: what they end was counted, and a team must always be able to revoke a token.

use crate::problem::{Problem, ProblemKind};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method};
use faceoff_types::{TeamId, TokenId};
use jiff::{Timestamp, civil::Date, tz::TimeZone};
use std::{
    collections::HashMap,
    num::NonZeroU32,
    sync::{Arc, Mutex, OnceLock, PoisonError},
};

/// Headers of draft-ietf-httpapi-ratelimit-headers: the quota, and what is left of it.
const POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");
const REMAINING: HeaderName = HeaderName::from_static("ratelimit");

/// Counts the changes of each team on the current day. The counts start again with the server.
#[derive(Debug)]
pub struct ChangeQuota {
    /// `None`: unlimited.
    per_day: Option<NonZeroU32>,
    counted: Mutex<ChangeCounts>,
}

#[derive(Debug, Default)]
struct ChangeCounts {
    day: Date,
    by_team: HashMap<TeamId, u32>,
    by_token: HashMap<TokenId, u32>,
}

/// Whether a request with this method and path is counted.
pub(crate) fn is_counted(method: &Method, path: &str) -> bool {
    let is_revocation = path == "/sign-out" || path.ends_with("/revoke");
    !method.is_safe() && method != Method::DELETE && !is_revocation
}

/// What is left of a team's quota after a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RemainingChanges {
    per_day: NonZeroU32,
    remaining: u32,
    seconds_to_midnight: i64,
}

/// Request extension, set once the caller is authenticated: what is left of the team's quota, for the headers of the response.
#[derive(Debug, Clone, Default)]
pub struct RemainingChangesSlot(Arc<OnceLock<RemainingChanges>>);

impl ChangeQuota {
    /// A quota of this many changes per team and day.
    pub fn new(per_day: Option<NonZeroU32>) -> Self {
        Self {
            per_day,
            counted: Mutex::default(),
        }
    }

    /// Counts a change; `None` if changes are not limited. One token can use half of the quota, so that a leaked one cannot stop its
    /// team.
    ///
    /// # Errors
    /// `DailyChangeQuotaExceeded`.
    pub(crate) fn count(
        &self,
        team: TeamId,
        token: TokenId,
        now: Timestamp,
    ) -> Result<Option<RemainingChanges>, Problem> {
        let Some(per_day) = self.per_day else {
            return Ok(None);
        };
        let time = now.to_zoned(TimeZone::UTC);
        let seconds_to_midnight = 24 * 3600 - now.as_second().rem_euclid(24 * 3600);
        let mut counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        if counted.day != time.date() {
            *counted = ChangeCounts {
                day: time.date(),
                ..ChangeCounts::default()
            };
        }
        let ChangeCounts {
            by_team, by_token, ..
        } = &mut *counted;
        let (team_changes, token_changes) = (
            by_team.entry(team).or_default(),
            by_token.entry(token).or_default(),
        );
        let per_token = per_day.get().div_ceil(2);
        let exceeded = match (*team_changes >= per_day.get(), *token_changes >= per_token) {
            (true, _) => Some(format!(
                "the team has made {per_day} changes today, as many as a team may make per UTC day"
            )),
            (false, true) => Some(format!(
                "this token has made {per_token} changes today, half of what its team may make per UTC day; other tokens of the team \
                 can still make some"
            )),
            (false, false) => None,
        };
        if let Some(exceeded) = exceeded {
            let detail = format!(
                "{exceeded}. Reading, deleting and revoking is not limited. Try again after midnight UTC"
            );
            let problem = Problem::new(ProblemKind::DailyChangeQuotaExceeded, detail);
            return Err(problem
                .with("limit", per_day.get())
                .retry_after(seconds_to_midnight.unsigned_abs()));
        }
        *team_changes += 1;
        *token_changes += 1;
        Ok(Some(RemainingChanges {
            per_day,
            remaining: per_day.get() - *team_changes,
            seconds_to_midnight,
        }))
    }
}

impl RemainingChangesSlot {
    /// Counts a change of the team for this request, once.
    ///
    /// # Errors
    /// `DailyChangeQuotaExceeded`.
    pub(crate) fn count(
        &self,
        quota: &ChangeQuota,
        team: TeamId,
        token: TokenId,
        now: Timestamp,
    ) -> Result<(), Problem> {
        if self.0.get().is_none()
            && let Some(remaining) = quota.count(team, token, now)?
        {
            // Set only here, by extractors that run one after the other.
            let _ = self.0.set(remaining);
        }
        Ok(())
    }

    /// Adds the headers that tell the quota, if a change was counted.
    pub fn add_headers(&self, headers: &mut HeaderMap) {
        let Some(RemainingChanges {
            per_day,
            remaining,
            seconds_to_midnight,
        }) = self.0.get()
        else {
            return;
        };
        for (name, value) in [
            (POLICY, format!("\"changes\";q={per_day};w=86400")),
            (
                REMAINING,
                format!("\"changes\";r={remaining};t={seconds_to_midnight}"),
            ),
        ] {
            if let Ok(value) = HeaderValue::try_from(value) {
                headers.insert(name, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quota_is_per_team_token_and_day() {
        let quota = ChangeQuota::new(NonZeroU32::new(3));
        let [alpha, beta] = [TeamId::new(), TeamId::new()];
        let [first, second] = [TokenId::new(), TokenId::new()];
        let at = |text: &str| text.parse::<Timestamp>().unwrap();
        let evening = at("2026-03-01T23:59:50Z");
        let remaining = quota.count(alpha, first, evening).unwrap().unwrap();
        assert_eq!(
            (remaining.remaining, remaining.seconds_to_midnight),
            (2, 10)
        );
        assert!(quota.count(alpha, first, evening).is_ok());
        let refused = quota.count(alpha, first, evening).unwrap_err();
        assert_eq!(refused.kind(), ProblemKind::DailyChangeQuotaExceeded);
        assert!(refused.detail().contains("this token has made 2"));
        assert!(quota.count(alpha, second, evening).is_ok());
        let refused = quota.count(alpha, second, evening).unwrap_err();
        assert!(refused.detail().contains("the team has made 3"));
        assert!(quota.count(beta, TokenId::new(), evening).is_ok());
        assert!(
            quota
                .count(alpha, first, at("2026-03-02T00:00:00Z"))
                .is_ok()
        );
        let unlimited = ChangeQuota::new(None);
        assert_eq!(unlimited.count(alpha, first, evening).unwrap(), None);
    }

    #[test]
    fn revoking_is_not_counted() {
        assert!(is_counted(&Method::POST, "/api/v1/tokens"));
        assert!(is_counted(&Method::PATCH, "/api/v1/teams/x"));
        for (method, path) in [
            (Method::GET, "/api/v1/tokens"),
            (Method::DELETE, "/api/v1/tokens/x"),
            (Method::POST, "/dashboard/access/tokens/x/revoke"),
            (Method::POST, "/sign-out"),
        ] {
            assert!(!is_counted(&method, path), "{method} {path}");
        }
    }
}

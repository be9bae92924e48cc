//! The kinds of problems (error responses), with HTTP status, title and explanation of each.

use axum::http::StatusCode;

/// One entry per kind: variant, slug (its name in URLs), HTTP status, title, and its meaning with advice for the client.
macro_rules! kinds {
    ($($kind:ident $slug:literal $status:ident $title:literal $meaning:literal)*) => {
        /// Kind of a problem. The member `type` of the response is `/problems#` and the kind's slug; the page `/problems` explains all
        /// kinds.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ProblemKind {
            $(#[doc = $meaning] $kind,)*
        }

        impl ProblemKind {
            /// All kinds, as the page `/problems` lists them.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Slug, status, title and meaning.
            const fn properties(self) -> (&'static str, StatusCode, &'static str, &'static str) {
                match self {
                    $(Self::$kind => ($slug, StatusCode::$status, $title, $meaning),)*
                }
            }
        }
    };
}

kinds! {
    Unauthenticated "unauthenticated" UNAUTHORIZED
        "A valid token is needed"
        "Send the header “Authorization: Bearer TOKEN”, or sign in on the page /sign-in. If you have lost your token, ask an organiser for a new one."
    Forbidden "forbidden" FORBIDDEN
        "This token may not do that"
        "The token is valid, but lacks the right: some requests need a team's token, some an organiser's."
    ReadOnly "read-only" FORBIDDEN
        "The season is archived"
        "This server shows the archive of a season: everything can be read, nothing can be changed, and there is no sign-in."
    Disqualified "disqualified" FORBIDDEN
        "The team is disqualified"
        "An organiser has disqualified the team; the detail says when and why. Its data stays, but it can neither upload nor be evaluated."
    Retired "retired" FORBIDDEN
        "The team has retired"
        "The team has withdrawn from the season. An organiser or a member undoes this with POST /api/v1/teams/ID/return."
    TermsNotAccepted "terms-owed" FORBIDDEN
        "The terms must be accepted"
        "No member of the team has accepted the newest terms. A member reads GET /api/v1/terms and accepts with POST /api/v1/terms/VERSION/accept."
    LinkInvalid "link-invalid" FORBIDDEN
        "The link is invalid"
        "A signed link downloads one file, as long as the token of its maker is valid. Use the complete link unchanged, or ask for a new one."
    NotFound "not-found" NOT_FOUND
        "Not found"
        "The resource does not exist, or it belongs to another team. Check the id."
    MethodNotAllowed "method-not-allowed" METHOD_NOT_ALLOWED
        "Method not allowed"
        "The path does not support this method. The header “Allow” lists the supported ones."
    InvalidRequest "invalid-request" BAD_REQUEST
        "The request is malformed"
        "The JSON, an id, a header or the query is malformed. The detail says where."
    InvalidContent "invalid-content" UNPROCESSABLE_ENTITY
        "A value is invalid"
        "The request is well-formed, but a field has an invalid value. The detail names the field."
    UnsupportedMediaType "unsupported-media-type" UNSUPPORTED_MEDIA_TYPE
        "Unsupported media type"
        "A bundle is a .tar.gz, .tar.zst, .zip, or the .tar of a container image, sent as the body itself; everything else is JSON."
    TooLarge "too-large" PAYLOAD_TOO_LARGE
        "The body is too large"
        "The detail and “limit_bytes” state the limit. Leave out of the bundle what the agent does not need."
    RequestTimeout "request-timeout" REQUEST_TIMEOUT
        "The upload is too slow"
        "The upload stalled, or was slower than the minimum rate in the detail. Nothing was stored; send it again."
    TeamNameTaken "team-name-taken" CONFLICT
        "The name is taken"
        "Another team has this name. Choose another name, or ask for a new token for the existing team."
    UserNameTaken "person-name-taken" CONFLICT
        "The name is taken"
        "Another user has this name. Choose another name. If you have lost your password, ask an organiser for a link."
    InvitationInvalid "invitation-spent" CONFLICT
        "The invitation is no longer valid"
        "It was accepted or revoked, has expired, or does not exist; the detail says which. Ask for a new one."
    StageNameTaken "stage-name-taken" CONFLICT
        "The name is taken"
        "Another stage of the season has this name. Choose another name."
    TournamentNameTaken "tournament-name-taken" CONFLICT
        "The name is taken"
        "Another tournament of the season has this name. Choose another name."
    StageNotOpen "stage-not-open" CONFLICT
        "The stage is not open"
        "Evaluation days of a stage start only between its opening and its closing, “opens_at” and “closed_at”. GET /api/v1/stages lists the stages."
    NotConfirmed "not-confirmed" CONFLICT
        "Confirmation is required"
        "The request cannot be undone; the detail describes its effects. Send it again with the field “confirm” as the detail says."
    CutoffPassed "cutoff-passed" CONFLICT
        "The day has had its cutoff"
        "A day has one cutoff, at which the active submissions of all teams are evaluated. “next_cutoff” says when the next one is."
    NotYet "not-yet" CONFLICT
        "Not yet"
        "Datasets and comparisons reveal the day's episodes. They are released for everyone at once, when the day's last evaluation has ended."
    Blind "blind" CONFLICT
        "The stage is blind"
        "Scores, points, tiers, boards, comparisons and datasets of a blind stage are hidden until the organisers reveal them. State and progress of its evaluations are visible."
    SeasonClosed "season-closed" CONFLICT
        "The season is over"
        "The season's secret is public, so nothing can be uploaded or evaluated any more. Results and datasets stay."
    NotPaired "not-paired" CONFLICT
        "Not the same episodes"
        "Two evaluations can be compared if they have the same stage, day, rules, profile and tasks and the same number of episodes. “field” names what differs."
    Conflict "conflict" CONFLICT
        "Not possible in this state"
        "The detail says which state the resource is in and what has to happen first."
    Gone "gone" GONE
        "No longer offered"
        "The server no longer offers this. The detail says why, and names the alternative."
    LinkExpired "link-expired" GONE
        "The link has expired"
        "A signed link is valid for a limited time, until “expired_at”. Ask the person who gave it to you for a new one."
    Removed "removed" GONE
        "The file was removed"
        "The file was deleted by its stage's retention rule, by its team or by an organiser. The detail says when and why; results stay."
    RangeNotSatisfiable "range-not-satisfiable" RANGE_NOT_SATISFIABLE
        "The range begins behind the end"
        "The header “Range” asks for bytes behind the end of the file; “Content-Range” states its length. If you have that many bytes, the download is already complete."
    TooManyPending "too-many-pending" TOO_MANY_REQUESTS
        "Too many submissions are pending"
        "Several submissions of the team are waiting for their validation run. Wait until one has its verdict."
    TooManyUploads "too-many-uploads" TOO_MANY_REQUESTS
        "Too many uploads at once"
        "The team has as many running uploads as it may. Wait until one has ended; uploads of other teams do not count."
    TooManySignIns "too-many-sign-ins" TOO_MANY_REQUESTS
        "Too many wrong passwords"
        "Several wrong passwords were entered for this name. Try again after the seconds in the header “Retry-After”; tokens work meanwhile."
    DailyUploadQuotaExceeded "day-quota-spent" TOO_MANY_REQUESTS
        "The daily upload quota is used up"
        "“limit_bytes” is the team's quota per UTC day, “used_bytes” what it has used. “Retry-After” is the time to midnight UTC."
    DailyChangeQuotaExceeded "daily-change-quota-exceeded" TOO_MANY_REQUESTS
        "The team's daily quota of changes is used up"
        "“limit” is the number of changes that a team may make per UTC day: requests of its members and tokens that are not only reads. “Retry-After” is the time to midnight UTC."
    StorageQuotaExceeded "stored-quota-spent" CONFLICT
        "The team's storage is full"
        "“limit_bytes” is the quota of stored bundles, “used_bytes” what the team has used. Delete old submissions, or ask an organiser for a higher quota."
    DailyGameQuotaExceeded "daily-game-quota-exceeded" TOO_MANY_REQUESTS
        "The daily game quota is used up"
        "“limit” is the team's quota of test and friendly games per UTC day, “used” what it has used. “Retry-After” is the time to midnight UTC."
    TooManyRequests "too-many-requests" TOO_MANY_REQUESTS
        "Too many requests"
        "The address or the token has exceeded its rate limit. Wait the seconds in the header “Retry-After”, and send fewer requests."
    TooManyConnections "too-many-connections" TOO_MANY_REQUESTS
        "Too many connections"
        "The address has too many open connections. Close some, or send several requests over one."
    Busy "busy" SERVICE_UNAVAILABLE
        "The server is busy"
        "Try again after the seconds in the header “Retry-After”."
    StorageFull "storage-full" INSUFFICIENT_STORAGE
        "The server's disk is full"
        "The server lacks disk space for this request; this is not your fault and affects no verdict. Nothing was stored. Try again after the seconds in the header “Retry-After”."
    NotReady "not-ready" SERVICE_UNAVAILABLE
        "The server is not ready"
        "The server responds, but is not fully working: “database”, “queue” and “free_space” say what is wrong. It recovers automatically once that is fixed."
    Internal "internal" INTERNAL_SERVER_ERROR
        "The server failed"
        "An error of the server. Try again; if it persists, send the header “X-Request-Id” of the response to an organiser."
}

impl ProblemKind {
    /// The name in the member `type`.
    #[must_use]
    pub const fn slug(self) -> &'static str {
        self.properties().0
    }

    /// The slug in earlier versions. Links with it keep working until the next minor version.
    #[must_use]
    pub const fn old_slug(self) -> Option<&'static str> {
        match self {
            Self::CutoffPassed => Some("day-has-cut"),
            Self::DailyGameQuotaExceeded => Some("free-games-spent"),
            _ => None,
        }
    }

    #[must_use]
    pub const fn status(self) -> StatusCode {
        self.properties().1
    }

    /// Short title, the same for every problem of the kind.
    #[must_use]
    pub const fn title(self) -> &'static str {
        self.properties().2
    }

    /// What the kind means and what to do, for the page `/problems`.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        self.properties().3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn kinds_have_unique_slugs_and_error_statuses() {
        let kinds = ProblemKind::ALL;
        let slugs: BTreeSet<_> = kinds.iter().map(|kind| kind.slug()).collect();
        assert_eq!(slugs.len(), kinds.len());
        let mut old_slugs = kinds.iter().filter_map(|kind| kind.old_slug());
        assert!(old_slugs.all(|old| !slugs.contains(old)));
        for kind in ProblemKind::ALL {
            assert!(kind.status().is_client_error() || kind.status().is_server_error());
            assert!(kind.meaning().ends_with('.'));
        }
    }
}

use axum::http::StatusCode;

/// One line per kind: variant, name in `type`, HTTP status, title, and what it means with what to do.
macro_rules! kinds {
    ($($kind:ident $slug:literal $status:ident $title:literal $meaning:literal)*) => {
        /// What kind of problem it is. `type` in the answer is `/problems#` and the kind's name; that page
        /// explains them all.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ProblemKind {
            $(#[doc = $meaning] $kind,)*
        }

        impl ProblemKind {
            /// All kinds, as the page `/problems` lists them.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            const fn row(self) -> (&'static str, StatusCode, &'static str, &'static str) {
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
        "Send the header “Authorization: Bearer TOKEN”, or sign in on the page /sign-in. A lost token is replaced by the organiser."
    Forbidden "forbidden" FORBIDDEN
        "This token may not do that"
        "The token is valid, but of the wrong kind: some requests are a team's, some are the organiser's."
    ReadOnly "read-only" FORBIDDEN
        "The season is archived"
        "This server shows the archive of a season as it was at one moment: everything can be read, nothing changes, and nobody signs in."
    Disqualified "disqualified" FORBIDDEN
        "The team is disqualified"
        "The organiser has disqualified the team; the detail says when and why. It keeps what it has, and neither uploads nor plays."
    Retired "retired" FORBIDDEN
        "The team has retired"
        "The team takes no part any more, by its own wish. An organiser or a member lets it play again with POST /api/v1/teams/ID/return."
    TermsOwed "terms-owed" FORBIDDEN
        "The terms are to be accepted"
        "There are other terms than the team's members have accepted. One of them reads GET /api/v1/terms and accepts with POST /api/v1/terms/VERSION/accept."
    LinkInvalid "link-invalid" FORBIDDEN
        "The link is not good"
        "A signed link opens the one file that it was made for, as long as the token that made it is good. Follow it as it was given, or ask for another one."
    NotFound "not-found" NOT_FOUND
        "Not found"
        "There is no such thing, or it belongs to another team. Check the id."
    MethodNotAllowed "method-not-allowed" METHOD_NOT_ALLOWED
        "Method not allowed"
        "The path exists, but not with this method. The header “Allow” lists what it takes."
    InvalidRequest "invalid-request" BAD_REQUEST
        "The request is not understood"
        "The JSON, an id, a header or the query is malformed. The detail names the place."
    InvalidContent "invalid-content" UNPROCESSABLE_ENTITY
        "A value is not acceptable"
        "The request is well-formed, but a field has a value that cannot be used. The detail names it."
    UnsupportedMediaType "unsupported-media-type" UNSUPPORTED_MEDIA_TYPE
        "Unsupported media type"
        "A bundle is a .tar.gz, .tar.zst, .zip, or the .tar of a container image, sent as the body itself; everything else is JSON."
    TooLarge "too-large" PAYLOAD_TOO_LARGE
        "The body is too large"
        "The detail and “limit_bytes” state the limit. Leave data out of the bundle that the agent does not need."
    RequestTimeout "request-timeout" REQUEST_TIMEOUT
        "The body stopped coming"
        "The upload stalled, or came slower than the server waits for; the detail states the rate. Nothing was stored; send it again."
    TeamNameTaken "team-name-taken" CONFLICT
        "The name is taken"
        "Another team has this name. Choose another one, or ask for a new token for the existing team."
    PersonNameTaken "person-name-taken" CONFLICT
        "The name is taken"
        "Another person has this name. Choose another one; whoever has lost their password asks an organiser for a link."
    InvitationSpent "invitation-spent" CONFLICT
        "The invitation is worth nothing"
        "It was accepted, taken back, has expired, or there is none; the detail says which. Ask for another one."
    StageNameTaken "stage-name-taken" CONFLICT
        "The name is taken"
        "Another stage of the season has this name. Choose another one."
    TournamentNameTaken "tournament-name-taken" CONFLICT
        "The name is taken"
        "Another tournament of the season has this name. Choose another one."
    StageNotOpen "stage-not-open" CONFLICT
        "The stage is not open"
        "Days of a stage start from its opening to its closing; “opens_at” and “closed_at” say when these are. GET /api/v1/stages lists the stages."
    NotConfirmed "not-confirmed" CONFLICT
        "This needs to be confirmed"
        "The request would do what cannot be undone; the detail says what. Send it again with the field “confirm” as the detail tells."
    DayHasCut "day-has-cut" CONFLICT
        "The day has had its cut"
        "A day starts once: what each team has active then plays it. What is active at the next cut plays the next day; “next_cut” says when that is."
    NotYet "not-yet" CONFLICT
        "Not yet"
        "Datasets and comparisons tell of the day's episodes. They come out for everybody at once, when the last evaluation of the day has ended."
    Blind "blind" CONFLICT
        "The stage is blind"
        "Scores, points, tiers, boards, comparisons and datasets of a blind stage are hidden from everybody until the organiser opens it. Its evaluations tell their state and progress."
    SeasonClosed "season-closed" CONFLICT
        "The season is over"
        "The season's secret is published, so nothing more is uploaded or evaluated. Results and datasets stay."
    NotPaired "not-paired" CONFLICT
        "Not the same episodes"
        "Two evaluations are compared if they are of the same stage and day and played equally many episodes of the same tasks under the same rules and profile. “field” names what differs."
    Conflict "conflict" CONFLICT
        "Not possible in this state"
        "The detail says which state the thing is in and what it waits for."
    Gone "gone" GONE
        "No longer offered"
        "The server no longer does this. The detail says why, and what there is instead."
    LinkExpired "link-expired" GONE
        "The link has expired"
        "A signed link is good for a time; “expired_at” says until when. Ask who gave it to you for another one."
    Removed "removed" GONE
        "It was removed"
        "The file was kept for a time, and is no more: by the retention of its stage, or because its team or an organiser had it deleted. The detail says when and why; results stay."
    RangeNotSatisfiable "range-not-satisfiable" RANGE_NOT_SATISFIABLE
        "The range begins behind the end"
        "The header “Range” asks for bytes that the file does not have; “Content-Range” says how many it has. Who has that many has all of it."
    TooManyPending "too-many-pending" TOO_MANY_REQUESTS
        "Too many uploads are waiting"
        "Several uploads of the team are not validated yet. Wait until one has its verdict."
    TooManyUploads "too-many-uploads" TOO_MANY_REQUESTS
        "Too many uploads at once"
        "The team has several uploads under way. Wait until one has ended; nothing of another team's takes these places."
    TooManySignIns "too-many-sign-ins" TOO_MANY_REQUESTS
        "Too many wrong passwords"
        "Wrong passwords came for a name, one after another. Try again after the seconds stated in the header “Retry-After”; tokens work meanwhile."
    DayQuotaSpent "day-quota-spent" TOO_MANY_REQUESTS
        "The day's quota of uploads is spent"
        "A team uploads so many bytes on a UTC day. “limit_bytes” and “used_bytes” state how many; “Retry-After” is the time to midnight UTC."
    StoredQuotaSpent "stored-quota-spent" CONFLICT
        "The team's storage is full"
        "The bundles that are kept of the team fill its room; “limit_bytes” and “used_bytes” state how much. Ask the organiser for more."
    FreeGamesSpent "free-games-spent" TOO_MANY_REQUESTS
        "The day's games are spent"
        "A team asks for so many games that do not count on a UTC day. “limit” and “used” state how many; “Retry-After” is the time to midnight UTC."
    TooManyRequests "too-many-requests" TOO_MANY_REQUESTS
        "Too many requests"
        "An address, and a token, may make so many requests per second in the mean. Wait the seconds stated in the header “Retry-After”, and ask less often."
    TooManyConnections "too-many-connections" TOO_MANY_REQUESTS
        "Too many connections"
        "An address has so many connections at a time. Close some, or send several requests over one."
    Busy "busy" SERVICE_UNAVAILABLE
        "The server is busy"
        "Try again after the seconds stated in the header “Retry-After”."
    StorageFull "storage-full" INSUFFICIENT_STORAGE
        "No room on the server's disk"
        "Our fault, and nobody's verdict: what was asked needs room that the server's disk does not have. Nothing was stored. Try again after the seconds stated in the header “Retry-After”."
    NotReady "not-ready" SERVICE_UNAVAILABLE
        "The server is not ready"
        "It answers, but something that it needs is missing: “database”, “queue” and “room” say what. It goes on by itself once that is back."
    Internal "internal" INTERNAL_SERVER_ERROR
        "The server failed"
        "Our fault. Try again; if it stays, send the organiser the header “X-Request-Id” of the answer."
}

impl ProblemKind {
    /// Name in `type`.
    #[must_use]
    pub const fn slug(self) -> &'static str {
        self.row().0
    }

    #[must_use]
    pub const fn status(self) -> StatusCode {
        self.row().1
    }

    /// Short title, the same for every problem of the kind.
    #[must_use]
    pub const fn title(self) -> &'static str {
        self.row().2
    }

    /// What the kind means and what to do, for the page `/problems`.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        self.row().3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn kinds_are_told_apart_and_are_errors() {
        let slugs: BTreeSet<_> = ProblemKind::ALL.iter().map(|kind| kind.slug()).collect();
        assert_eq!(slugs.len(), ProblemKind::ALL.len());
        for kind in ProblemKind::ALL {
            assert!(kind.status().is_client_error() || kind.status().is_server_error());
            assert!(kind.meaning().ends_with('.'));
        }
    }
}

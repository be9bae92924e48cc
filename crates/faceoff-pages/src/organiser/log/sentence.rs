//! Events of the log as sentences: what its author did, and to what.

use super::names::Names;
use faceoff_api::views::event::EventView;
use serde_json::Value;

/// An event with the text of its subject.
struct EventText<'a> {
    event: &'a EventView,
    /// What was changed, such as “Alpha’s evaluation of 2026-03-01”.
    subject: String,
}

impl EventText<'_> {
    /// A field of the event as text; empty if it has none of this name.
    fn field(&self, name: &str) -> String {
        match self.event.details.get(name) {
            Some(Value::String(text)) => text.clone(),
            Some(Value::Null) | None => String::new(),
            Some(other) => other.to_string(),
        }
    }

    /// A number of things, such as “3 evaluations”.
    fn count(&self, name: &str, thing: &str) -> String {
        let number = self.field(name);
        match number.as_str() {
            "1" => format!("1 {thing}"),
            _ => format!("{number} {thing}s"),
        }
    }
}

/// The event as a sentence without its full stop: “Anna disqualified Alpha: it read the seed”.
pub(super) fn sentence(event: &EventView, names: &Names) -> String {
    let event_text = EventText {
        event,
        subject: names.subject(&event.subject),
    };
    let mut text = format!("{} {}", names.actor(event), predicate(&event_text, names));
    // Not every event has a reason.
    let reason = event_text.field("reason");
    if !reason.is_empty() {
        text.push_str(": ");
        text.push_str(&reason);
    }
    text
}

/// What the author did.
fn predicate(event_text: &EventText<'_>, names: &Names) -> String {
    about_access(event_text, names)
        .or_else(|| about_teams(event_text, names))
        .or_else(|| about_evaluations(event_text, names))
        .or_else(|| about_season(event_text, names))
        .or_else(|| about_tournaments(event_text, names))
        // Events of later versions, which this list does not know yet.
        .unwrap_or_else(|| {
            let kind = event_text.event.kind.replace('_', " ");
            format!("recorded “{kind}” for {}", event_text.subject)
        })
}

/// Accounts, invitations, tokens and webhooks.
fn about_access(event_text: &EventText<'_>, names: &Names) -> Option<String> {
    let (subject, name) = (&event_text.subject, event_text.field("name"));
    Some(match event_text.event.kind.as_str() {
        "token_replaced" => format!("replaced the token of {subject}"),
        "token_created" => format!("created the token “{name}” for {subject}"),
        "token_rotated" => format!("gave the token “{name}” of {subject} a new secret"),
        "token_revoked" => format!("revoked the token “{name}” of {subject}"),
        "invited" => {
            let role = match event_text.field("role").as_str() {
                "return" => "for a new password".to_owned(),
                "founder" => "for the first member of a new team".to_owned(),
                role => format!("for a new {role}"),
            };
            format!(
                "created the invitation “{}” {role}",
                event_text.field("note")
            )
        }
        "invitation_revoked" => "revoked an invitation".to_owned(),
        "person_joined" => match names.team(&event_text.field("team")) {
            Some(team) => format!("joined the team {team}"),
            None => "joined as an organiser".to_owned(),
        },
        "person_renamed" => format!(
            "renamed the user {} to {}",
            event_text.field("from"),
            event_text.field("to")
        ),
        "person_left" => format!("closed the account of {name}"),
        "signed_in" => "signed in".to_owned(),
        "password_set" => "set a new password".to_owned(),
        "terms_accepted" => format!(
            "accepted version {} of the terms",
            event_text.field("version")
        ),
        "webhook_created" => format!("created the webhook “{name}” of {subject}"),
        "webhook_changed" => format!("changed the webhook “{name}” of {subject}"),
        "webhook_rotated" => format!("gave the webhook “{name}” of {subject} a new secret"),
        "webhook_removed" => format!("removed the webhook “{name}” of {subject}"),
        "webhook_died" => format!("disabled a webhook of {subject}"),
        _ => return None,
    })
}

/// Teams, registrations, questions and submissions.
fn about_teams(event_text: &EventText<'_>, names: &Names) -> Option<String> {
    let subject = &event_text.subject;
    Some(match event_text.event.kind.as_str() {
        "team_created" => format!("created the team {}", event_text.field("name")),
        "team_registered" => format!("registered the team {}", event_text.field("name")),
        "registration_approved" => {
            let team = names.team(&event_text.field("team"));
            format!("approved the registration of {}", team.unwrap_or("a team"))
        }
        "registration_refused" => format!("refused {subject}"),
        "team_renamed" => format!(
            "renamed {} to {}",
            event_text.field("from"),
            event_text.field("to")
        ),
        "team_described" => format!("changed the description of {subject}"),
        "team_made_baseline" => format!("made {subject} a reference agent"),
        "team_made_ranked" => format!("made {subject} a ranked team"),
        "team_retired" => format!("retired the team {subject} from the season"),
        "team_returned" => format!("brought the retired team {subject} back"),
        "team_disqualified" => format!("disqualified {subject}"),
        "team_reinstated" => format!("reinstated {subject}"),
        "asked" => {
            let team = names.team(&event_text.field("team"));
            format!("asked a question for {}", team.unwrap_or("a team"))
        }
        "answered" if event_text.field("public") == "true" => {
            format!("answered {subject} and published the answer")
        }
        "answered" => format!("answered {subject}"),
        "submission_uploaded" => match names.team(&event_text.field("team")) {
            Some(team) => format!("uploaded a submission for {team}"),
            None => "uploaded a submission".to_owned(),
        },
        "submission_valid" => {
            format!(
                "found {subject} valid: agent “{}”",
                event_text.field("agent_name")
            )
        }
        "submission_invalid" => format!("found {subject} invalid"),
        "submission_not_validated" => format!("could not validate {subject}"),
        "submission_activated" => format!("chose {subject} for the next cutoff"),
        "submission_not_taken" => format!(
            "excluded {subject} from {} on {}",
            names.stage(&event_text.field("stage")).unwrap_or("a stage"),
            event_text.field("day")
        ),
        "submission_withdrawn" => format!("withdrew {subject}"),
        "submission_deleted" => format!("deleted {subject}"),
        "archive_removed" => format!("deleted the bundle of {subject}"),
        "submission_labelled" => match event_text.field("label") {
            label if label.is_empty() => format!("removed the name of {subject}"),
            label => format!("named {subject} “{label}”"),
        },
        "submission_noted" => format!("changed the note on {subject}"),
        _ => return None,
    })
}

/// Evaluations, days, proposals and ablations.
fn about_evaluations(event_text: &EventText<'_>, names: &Names) -> Option<String> {
    let subject = &event_text.subject;
    Some(match event_text.event.kind.as_str() {
        "evaluation_queued" if !event_text.field("rerun_of").is_empty() => {
            format!("queued {subject} once more")
        }
        "evaluation_queued" => format!("queued {subject}"),
        "evaluation_begun" => format!("started {subject}"),
        "evaluation_finalising" => format!("started to score {subject}"),
        "evaluation_finished" => {
            let score = event_text
                .event
                .details
                .get("score")
                .and_then(Value::as_f64);
            let score = score.map(crate::format::one_decimal).unwrap_or_default();
            format!("finished {subject} with a score of {score} %")
        }
        "evaluation_agent_failed" => format!("stopped {subject} after agent faults"),
        "evaluation_platform_failed" => format!("gave up {subject} after a platform fault"),
        "evaluation_cancelled" => format!("cancelled {subject}"),
        "evaluation_not_played" => format!("ended {subject} unfinished"),
        "evaluation_voided" => format!("voided {subject}"),
        "evaluation_published" => format!("published {subject}"),
        "dataset_removed" => format!("deleted the dataset of {subject}"),
        "evaluation_applied" => format!("replaced {subject} by its proposed re-evaluation"),
        "day_started" => format!(
            "started {subject} with {}",
            event_text.count("evaluations", "evaluation")
        ),
        "day_overdue" => format!(
            "ended {subject} at its deadline, {} unfinished",
            event_text.count("not_played", "evaluation")
        ),
        "day_released" => format!("released {subject}"),
        "day_voided" => format!("voided {subject}"),
        "missed_day_started" => format!("started {subject}, which had been missed"),
        "extra_turn_given" => format!("granted {subject} as an extra evaluation"),
        "ablation_ordered" => format!("requested {subject}"),
        "ablation_finished" => format!("finished {subject}"),
        "ablation_failed" => format!("gave up {subject}"),
        "proposal_made" => format!(
            "proposed to re-evaluate {} of {}",
            event_text.count("evaluations", "evaluation"),
            names.stage(&event_text.field("stage")).unwrap_or("a stage")
        ),
        "proposal_played" => format!("finished {subject}"),
        "proposal_applied" => format!("applied {subject}"),
        "proposal_dropped" => format!("dropped {subject}"),
        "shard_committed" => {
            let number = |field: &str| event_text.event.details.get(field).and_then(Value::as_u64);
            let first = number("first_episode").unwrap_or_default();
            let end = number("end_episode").unwrap_or_default();
            // Episodes are numbered from 0, and the event's end is exclusive.
            format!(
                "finished episodes {first} to {} of {} in {subject}",
                end.saturating_sub(1),
                event_text.field("task")
            )
        }
        "unit_given_back" => format!("gave a job of {subject} back to the queue"),
        _ => return None,
    })
}

/// The season, its stages, the queue and the workers.
fn about_season(event_text: &EventText<'_>, _: &Names) -> Option<String> {
    let (subject, name) = (&event_text.subject, event_text.field("name"));
    Some(match event_text.event.kind.as_str() {
        "season_named" => format!("named the season “{name}”"),
        "season_closed" => "closed the season".to_owned(),
        "terms_published" => format!(
            "published version {} of the terms",
            event_text.field("version")
        ),
        "divisions_set" => "changed the divisions".to_owned(),
        "registration_opened" => "opened the registration of teams".to_owned(),
        "registration_closed" => "closed the registration of teams".to_owned(),
        "announced" => format!("announced “{}”", event_text.field("title")),
        "boards_frozen" => format!("froze the boards of {subject}"),
        "boards_unfrozen" => format!("unfroze the boards of {subject}"),
        "stage_created" => format!("created the stage {name}"),
        "stage_changed" => format!("changed the settings of the stage {name}"),
        "stage_retention_changed" => format!("changed how long {subject} keeps files"),
        "stage_rules_changed" => {
            format!(
                "changed the rules of {subject}: revision {}",
                event_text.field("revision")
            )
        }
        "stage_final_started" => {
            format!(
                "started the final day of {subject}, {}",
                event_text.field("day")
            )
        }
        "stage_finalised" => format!("signed off {subject}"),
        "queue_paused" => "paused the queue".to_owned(),
        "queue_resumed" => "resumed the queue".to_owned(),
        "clock_step_accepted" => format!(
            "accepted the system clock, which was {}",
            event_text.field("size")
        ),
        "worker_banned" => format!("banned the worker {}", event_text.field("worker")),
        "worker_readmitted" => format!("readmitted the worker {}", event_text.field("worker")),
        _ => return None,
    })
}

/// Tournaments and their games.
fn about_tournaments(event_text: &EventText<'_>, names: &Names) -> Option<String> {
    let subject = &event_text.subject;
    let team = || {
        let team = names.team(&event_text.field("team"));
        team.unwrap_or("a team").to_owned()
    };
    Some(match event_text.event.kind.as_str() {
        "tournament_opened" => format!("opened the tournament {}", event_text.field("name")),
        "tournament_changed" => format!("changed the tournament {}", event_text.field("name")),
        "tournament_paused" => format!("paused {subject}"),
        "tournament_resumed" => format!("resumed {subject}"),
        "tournament_closed" => format!("closed {subject}"),
        "teams_entered" => {
            let teams = event_text
                .event
                .details
                .get("teams")
                .and_then(Value::as_array);
            let teams = teams.into_iter().flatten().filter_map(Value::as_str);
            let teams: Vec<&str> = teams.filter_map(|id| names.team(id)).collect();
            format!("entered {} for {subject}", teams.join(", "))
        }
        "team_out" => format!("removed {} from {subject} before its first round", team()),
        "team_left_tournament" => {
            format!(
                "removed {} from {subject} from round {} on",
                team(),
                event_text.field("from_round")
            )
        }
        "round_started" => format!(
            "started round {} of {subject} with {}",
            event_text.field("round"),
            event_text.count("games", "game")
        ),
        "round_over" => format!("ended round {} of {subject}", event_text.field("round")),
        "replays_ordered" => format!(
            "queued {} to repeat the schedule of {subject}",
            event_text.count("games", "game")
        ),
        "replays_cancelled" => format!(
            "cancelled {} that repeat the schedule of {subject}",
            event_text.count("games", "game")
        ),
        "free_game_queued" => match names.team(&event_text.field("opponent")) {
            Some(opponent) => format!("queued a friendly game of {} against {opponent}", team()),
            None => format!("queued a test game of {}", team()),
        },
        "game_begun" => format!("started {subject}"),
        "game_played" => format!("finished {subject}"),
        "game_broken" => format!("gave up {subject} after platform faults"),
        "game_voided" => format!("voided {subject}"),
        "game_queued_again" => format!("queued {subject} once more"),
        "game_cancelled" => format!("cancelled {subject}"),
        "friendly_games_declined" if event_text.field("declines") == "true" => {
            format!("declined friendly games for {subject}")
        }
        "friendly_games_declined" => format!("accepted friendly games for {subject}"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_store::Event;
    use serde_json::json;

    fn event(actor: &str, subject: &str, kind: &str, details: &Value) -> EventView {
        EventView {
            id: 1,
            at: "2026-03-01T10:00:00Z".parse().unwrap(),
            actor: actor.to_owned(),
            actor_name: None,
            subject: subject.to_owned(),
            kind: kind.to_owned(),
            details: details.as_object().unwrap().clone(),
        }
    }

    #[test]
    fn sentence_has_names_and_reason() {
        let names = Names::from([
            ("person:1", "Anna"),
            ("team:2", "AiRLIHockey"),
            ("stage:3", "Qualifying"),
            ("evaluation:4", "AiRLIHockey’s evaluation of 2026-03-01"),
        ]);
        for (actor, subject, kind, details, expected) in [
            (
                "person:1",
                "team:2",
                "team_disqualified",
                json!({ "reason": "it read the seed" }),
                "Anna disqualified AiRLIHockey: it read the seed",
            ),
            (
                "schedule",
                "day:3/2026-03-01",
                "day_started",
                json!({ "evaluations": 1 }),
                "The schedule started the evaluation day 2026-03-01 of Qualifying with 1 evaluation",
            ),
            (
                "server",
                "evaluation:4",
                "evaluation_finished",
                json!({ "score": 52.34, "dataset_blake3": "00" }),
                "The server finished AiRLIHockey’s evaluation of 2026-03-01 with a score of 52.3 %",
            ),
            (
                "server",
                "evaluation:4",
                "shard_committed",
                json!({ "first_episode": 20, "end_episode": 40, "task": "hit" }),
                "The server finished episodes 20 to 39 of hit in AiRLIHockey’s evaluation of 2026-03-01",
            ),
            (
                "visitor",
                "person:1",
                "person_joined",
                json!({ "name": "Anna", "team": "2" }),
                "Anna joined the team AiRLIHockey",
            ),
            (
                "worker:01a224ca-db27-7601-8eb6-400a32f24e25/slot-0",
                "evaluation:4",
                "evaluation_begun",
                json!({}),
                "The server started AiRLIHockey’s evaluation of 2026-03-01",
            ),
            (
                "organiser",
                "season",
                "something_new",
                json!({}),
                "The operator recorded “something new” for the season",
            ),
        ] {
            let event = event(actor, subject, kind, &details);
            assert_eq!(sentence(&event, &names), expected);
        }
    }

    #[test]
    fn every_kind_of_event_has_its_sentence() {
        let error = Event::check_kind("no_such_kind").unwrap_err();
        let (_, kinds) = error.split_once("expected one of ").unwrap();
        let names = Names::from([]);
        let mut count = 0;
        for kind in kinds
            .split('`')
            .filter(|kind| kind.contains(|c: char| c.is_alphabetic()))
        {
            let event = event("server", "season", kind, &json!({}));
            let text = sentence(&event, &names);
            assert!(!text.contains("recorded “"), "{kind}: {text}");
            count += 1;
        }
        assert!(count > 90, "{kinds}");
    }
}

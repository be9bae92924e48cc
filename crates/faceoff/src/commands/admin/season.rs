//! The season in words.

use faceoff_http::views::season::SeasonView;

pub(super) fn of_season(season: &SeasonView) -> String {
    let state = match (season.closed_at, season.secret) {
        (Some(closed_at), Some(secret)) => {
            let closed_at = closed_at.strftime("%Y-%m-%d %H:%M UTC");
            format!("closed     {closed_at}\nsecret     {secret}")
        }
        _ if season.archived.is_some() => {
            "open       it was, so that its secret is not here".to_owned()
        }
        _ => "open       its secret is published when it is closed".to_owned(),
    };
    let archived = match &season.archived {
        Some(archived) => format!(
            "\narchived   as it was on {}, the {} edition: nothing changes any more",
            archived.made_at.strftime("%Y-%m-%d %H:%M UTC"),
            archived.edition
        ),
        None => String::new(),
    };
    let queue = match &season.paused {
        Some(ruling) => {
            let since = ruling.at.strftime("%Y-%m-%d %H:%M UTC");
            format!("\npaused     since {since}: {}", ruling.reason)
        }
        None => String::new(),
    };
    format!(
        "{} ({}), {} days played\ncommitment {}\n{state}{queue}{archived}",
        season.name,
        season.ruleset,
        season.days.len(),
        season.commitment
    )
}

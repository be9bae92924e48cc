//! What an archive tells in files that need no program: stages, boards, days, tournaments, teams, words to everybody.

use super::{
    day_csv,
    files::{self, Files},
};
use crate::board_csv;
use faceoff_api::{
    requests::BoardQuery,
    views::announcement::{AnnouncementView, QuestionView, TermsView},
};
use faceoff_archive::Edition;
use faceoff_service::{
    app::{App, AppState},
    csv,
    problem::Problem,
    viewer::Viewer,
    views::{
        announcement, board, evaluation, game, season, sight::Sight, stage, team, tournament,
        tournament_sheet::TournamentSheet,
    },
};
use faceoff_store::{Artifacts, EvaluationState, Stage};
use faceoff_types::StageDay;
use std::collections::BTreeMap;

/// An artifact that goes into an archive.
pub(super) struct Recorded {
    key: String,
    /// Unknown of datasets of older versions.
    blake3: Option<String>,
    kind: &'static str,
    id: String,
    team: String,
    stage: String,
    day: String,
    public: bool,
}

impl Recorded {
    /// What is no dataset of an evaluation.
    pub(super) fn beside(
        kind: &'static str,
        id: impl ToString,
        key: String,
        blake3: String,
    ) -> Self {
        Self {
            key,
            blake3: Some(blake3),
            kind,
            id: id.to_string(),
            team: String::new(),
            stage: String::new(),
            day: String::new(),
            public: false,
        }
    }
}

/// A name as a part of a path.
pub(super) fn plain(name: &str) -> String {
    let chars = name.chars().map(|c| match c {
        c if c.is_ascii_alphanumeric() => c.to_ascii_lowercase(),
        _ => '-',
    });
    let text: String = chars.take(60).collect();
    match text.trim_matches('-') {
        "" => "season".to_owned(),
        text => text.to_owned(),
    }
}

/// Makes the files of `results/`; the datasets that the viewer gets.
pub(super) async fn gather(
    app: &App,
    viewer: Viewer,
    files: &mut Files,
) -> Result<Vec<Recorded>, Problem> {
    let sight = Sight::of(app, viewer).await?;
    files
        .put_json("results/season.json", &season::now(app, viewer).await?)
        .await?;
    files
        .put_json("results/teams.json", &team::all(app).await?)
        .await?;
    let announced = app.store.announcements(u32::MAX).await?.into_iter();
    let announced: Vec<AnnouncementView> = announced.map(announcement::of).collect();
    files
        .put_json("results/announcements.json", &announced)
        .await?;
    let terms = app.store.terms().await?.into_iter();
    let terms: Vec<TermsView> = terms.map(announcement::terms).collect();
    files.put_json("results/terms.json", &terms).await?;

    let mut recorded = Vec::new();
    for (number, stage) in app.store.stages().await?.into_iter().enumerate() {
        let folder = format!("results/{}-{}", number + 1, plain(stage.name.as_str()));
        boards(app, &sight, &stage, &folder, files).await?;
        for (day, _) in app.store.days().await? {
            if day.of.stage == stage.id && day.released_at.is_some() {
                one_day(app, &sight, day.of, &folder, files).await?;
                recorded.extend(datasets(app, &sight, viewer, &stage, day.of).await?);
            }
        }
    }
    tournaments(app, viewer, files).await?;
    Ok(recorded)
}

/// Tournaments with their games, as the viewer sees them.
async fn tournaments(app: &AppState, viewer: Viewer, files: &mut Files) -> Result<(), Problem> {
    for tournament in app.store.tournaments().await? {
        let name = plain(tournament.name.as_str());
        let folder = format!("results/tournament-{}-{name}", tournament.number);
        let sheet = TournamentSheet::find(app, tournament.id).await?;
        let view = tournament::of(&sheet)?;
        files
            .put_json(&format!("{folder}/tournament.json"), &view)
            .await?;
        let games = game::of_rounds(&sheet, viewer, None)?;
        files
            .put_json(&format!("{folder}/games.json"), &games)
            .await?;
    }
    Ok(())
}

/// A stage, and its boards by each of its rules that has rows.
async fn boards(
    app: &AppState,
    sight: &Sight,
    stage: &Stage,
    folder: &str,
    files: &mut Files,
) -> Result<(), Problem> {
    let view = stage::of(app, stage.clone()).await?;
    files
        .put_json(&format!("{folder}/stage.json"), &view)
        .await?;
    let by = |revision| BoardQuery {
        stage: Some(stage.id),
        revision,
        ..BoardQuery::default()
    };
    let newest = board::asked(app, sight, by(None), None).await?;
    files
        .put_json(&format!("{folder}/board.json"), &newest)
        .await?;
    files
        .put(&format!("{folder}/board.csv"), board_csv::of_board(&newest))
        .await?;
    for task in &stage.rules.rules.tasks {
        let board = board::asked(app, sight, by(None), Some(*task)).await?;
        files
            .put_json(&format!("{folder}/board-{task}.json"), &board)
            .await?;
    }
    for revision in view.revisions {
        let query = by(Some(revision.revision));
        let board = board::asked(app, sight, query, None).await?;
        if board.revision == newest.revision || board.rows.is_empty() && board.baselines.is_empty()
        {
            continue;
        }
        let name = format!("{folder}/board-revision-{}", revision.revision);
        files.put_json(&format!("{name}.json"), &board).await?;
        files
            .put(&format!("{name}.csv"), board_csv::of_board(&board))
            .await?;
    }
    Ok(())
}

async fn one_day(
    app: &AppState,
    sight: &Sight,
    of: StageDay,
    folder: &str,
    files: &mut Files,
) -> Result<(), Problem> {
    let evaluations = evaluation::of_day(app, sight, of).await?;
    let name = format!("{folder}/{}", of.date);
    files
        .put_json(&format!("{name}.json"), &evaluations)
        .await?;
    files
        .put(&format!("{name}.csv"), day_csv::day(&evaluations))
        .await
}

/// The datasets of a day that the viewer gets.
async fn datasets(
    app: &AppState,
    sight: &Sight,
    viewer: Viewer,
    stage: &Stage,
    of: StageDay,
) -> Result<Vec<Recorded>, Problem> {
    let mut found = Vec::new();
    for evaluation in app.store.evaluations_of_day(of).await? {
        let public = sight.is_public(&evaluation);
        if !public && viewer != Viewer::Organiser || evaluation.dataset_removed.is_some() {
            continue;
        }
        let EvaluationState::Finished {
            dataset,
            dataset_blake3,
            ..
        } = evaluation.state
        else {
            continue;
        };
        found.push(Recorded {
            key: dataset,
            blake3: dataset_blake3,
            kind: "evaluation",
            id: evaluation.id.to_string(),
            team: app.store.team(evaluation.team).await?.name.to_string(),
            stage: stage.name.to_string(),
            day: of.date.to_string(),
            public,
        });
    }
    Ok(found)
}

/// Questions with their answers: those that everybody may read, of the organiser's archive all. They are no part of the
/// public database, since a question there has a team.
pub(super) async fn put_questions(
    app: &AppState,
    edition: Edition,
    files: &mut Files,
) -> Result<(), Problem> {
    let is_organisers = edition == Edition::Organiser;
    let questions = app.store.questions().await?.into_iter();
    let shown: Vec<QuestionView> = questions
        .map(|question| announcement::question(question, is_organisers))
        .filter(|question| question.public || is_organisers)
        .collect();
    files.put_json("results/questions.json", &shown).await
}

/// The table of all artifacts, and they themselves. What is not there any more is named in `left_out`.
pub(super) async fn add_artifacts(
    app: &AppState,
    recorded: Vec<Recorded>,
    files: &mut Files,
    left_out: &mut Vec<String>,
) -> Result<(), Problem> {
    let mut table = csv::Table::new(&[
        "path", "of", "id", "team", "stage", "day", "public", "bytes", "blake3",
    ]);
    let mut kept = BTreeMap::new();
    for artifact in recorded {
        let path = format!("artifacts/{}", artifact.key);
        let Some(bytes) = app.store.artifacts().bytes_of(&artifact.key).await? else {
            left_out.push(format!(
                "{path}, of the {} {}: it is no longer kept",
                artifact.kind, artifact.id
            ));
            continue;
        };
        let place = app.store.artifacts().path_of(&artifact.key)?;
        let blake3 = match artifact.blake3 {
            Some(blake3) => blake3,
            None => files::hash(place.clone()).await?.1,
        };
        table.row([
            path.clone(),
            artifact.kind.to_owned(),
            artifact.id,
            csv::words(&artifact.team),
            csv::words(&artifact.stage),
            artifact.day,
            artifact.public.to_string(),
            bytes.to_string(),
            blake3.clone(),
        ]);
        // What replays are drawn from goes along, where there is any.
        let beside = match artifact.key.strip_suffix("/game.zip") {
            Some(folder) => format!("{folder}/clips"),
            None => Artifacts::clips_of(&artifact.key),
        };
        if app.store.artifacts().bytes_of(&beside).await?.is_some() {
            let place = app.store.artifacts().path_of(&beside)?;
            let (bytes, blake3) = files::hash(place.clone()).await?;
            kept.insert(format!("artifacts/{beside}"), (place, bytes, blake3));
        }
        kept.insert(path, (place, bytes, blake3));
    }
    files.put("datasets.csv", table.into_bytes()).await?;
    for (path, (place, bytes, blake3)) in kept {
        files.add_known(&path, place, bytes, blake3);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_parts_of_paths() {
        assert_eq!(plain("Qualifying"), "qualifying");
        assert_eq!(plain("../Größe 2026 "), "gr--e-2026");
        assert_eq!(plain("日本"), "season");
    }
}

//! The results of a season in its archive, as JSON and CSV: stages, boards, days, tournaments, teams and announcements; and
//! the table of the archive's artifacts, which are stored files such as datasets.

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
    csv::{self, CsvFormat},
    problem::Problem,
    viewer::Viewer,
    views::{
        announcement, board, evaluation, game, season, stage, team, tournament,
        tournament_state::TournamentState, visibility::Visibility,
    },
};
use faceoff_store::{Artifacts, EvaluationState, Stage};
use faceoff_types::StageDay;
use std::collections::BTreeMap;

/// An artifact of the archive, and its line in `datasets.csv`.
pub(super) struct ArtifactRow {
    /// Key of the artifact in the store.
    key: String,
    /// `None` for datasets of older versions.
    blake3: Option<String>,
    /// Kind of the resource that the artifact belongs to: evaluation, submission, proposal or game.
    kind: &'static str,
    /// Id of that resource.
    id: String,
    team: String,
    stage: String,
    day: String,
    public: bool,
}

impl ArtifactRow {
    /// An artifact other than the dataset of an evaluation, only in the organiser's edition. Its line names no team, stage or day.
    pub(super) fn without_team(
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

/// Maximum length of a name in a path.
const MAX_SLUG_CHARS: usize = 60;

/// A name as part of a path: lower-case letters, digits and hyphens, [`MAX_SLUG_CHARS`] at most.
pub(super) fn slug(name: &str) -> String {
    let chars = name.chars().map(|c| match c {
        c if c.is_ascii_alphanumeric() => c.to_ascii_lowercase(),
        _ => '-',
    });
    let text: String = chars.take(MAX_SLUG_CHARS).collect();
    match text.trim_matches('-') {
        "" => "season".to_owned(),
        text => text.to_owned(),
    }
}

/// Creates the files of `results/`; returns the datasets that the viewer may download.
pub(super) async fn collect(
    app: &App,
    viewer: Viewer,
    files: &mut Files,
) -> Result<Vec<ArtifactRow>, Problem> {
    let visibility = Visibility::load(app, viewer).await?;
    files
        .put_json("results/season.json", &season::build(app, viewer).await?)
        .await?;
    files
        .put_json("results/teams.json", &team::all(app).await?)
        .await?;
    let announcements = app.store.announcements(u32::MAX).await?.into_iter();
    let announcements: Vec<AnnouncementView> = announcements.map(announcement::view).collect();
    files
        .put_json("results/announcements.json", &announcements)
        .await?;
    let terms = app.store.terms().await?.into_iter();
    let terms: Vec<TermsView> = terms.map(announcement::terms).collect();
    files.put_json("results/terms.json", &terms).await?;

    let mut artifacts = Vec::new();
    for (number, stage) in app.store.stages().await?.into_iter().enumerate() {
        let folder = format!("results/{}-{}", number + 1, slug(stage.name.as_str()));
        put_boards(app, &visibility, &stage, &folder, files).await?;
        for (day, _) in app.store.days().await? {
            if day.stage_day.stage == stage.id && day.released_at.is_some() {
                put_day(app, &visibility, day.stage_day, &folder, files).await?;
                artifacts
                    .extend(day_datasets(app, &visibility, viewer, &stage, day.stage_day).await?);
            }
        }
    }
    put_tournaments(app, viewer, files).await?;
    Ok(artifacts)
}

/// Adds all tournaments with their games, as the viewer may see them.
async fn put_tournaments(app: &AppState, viewer: Viewer, files: &mut Files) -> Result<(), Problem> {
    for tournament in app.store.tournaments().await? {
        let name = slug(tournament.name.as_str());
        let folder = format!("results/tournament-{}-{name}", tournament.number);
        let state = TournamentState::find(app, tournament.id).await?;
        let view = tournament::view(&state)?;
        files
            .put_json(&format!("{folder}/tournament.json"), &view)
            .await?;
        let games = game::round_games(&state, viewer, None)?;
        files
            .put_json(&format!("{folder}/games.json"), &games)
            .await?;
    }
    Ok(())
}

/// Adds a stage with its newest board, and the boards of earlier revisions of its rules, if they have rows.
async fn put_boards(
    app: &AppState,
    visibility: &Visibility,
    stage: &Stage,
    folder: &str,
    files: &mut Files,
) -> Result<(), Problem> {
    let view = stage::build(app, stage.clone()).await?;
    files
        .put_json(&format!("{folder}/stage.json"), &view)
        .await?;
    let query = |revision| BoardQuery {
        stage: Some(stage.id),
        revision,
        ..BoardQuery::default()
    };
    let newest = board::query(app, visibility, query(None), None).await?;
    files
        .put_json(&format!("{folder}/board.json"), &newest)
        .await?;
    files
        .put(
            &format!("{folder}/board.csv"),
            board_csv::board_table(app.config.competition(), &newest).into_bytes(CsvFormat::Csv),
        )
        .await?;
    for task in &stage.revision.rules.tasks {
        let board = board::query(app, visibility, query(None), Some(*task)).await?;
        files
            .put_json(&format!("{folder}/board-{task}.json"), &board)
            .await?;
    }
    for revision in view.revisions {
        let query = query(Some(revision.revision));
        let board = board::query(app, visibility, query, None).await?;
        if board.revision == newest.revision || board.rows.is_empty() && board.baselines.is_empty()
        {
            continue;
        }
        let name = format!("{folder}/board-revision-{}", revision.revision);
        files.put_json(&format!("{name}.json"), &board).await?;
        files
            .put(
                &format!("{name}.csv"),
                board_csv::board_table(app.config.competition(), &board).into_bytes(CsvFormat::Csv),
            )
            .await?;
    }
    Ok(())
}

/// Adds the evaluations of a day.
async fn put_day(
    app: &AppState,
    visibility: &Visibility,
    stage_day: StageDay,
    folder: &str,
    files: &mut Files,
) -> Result<(), Problem> {
    let evaluations = evaluation::day_evaluations(app, visibility, stage_day).await?;
    let name = format!("{folder}/{}", stage_day.date);
    files
        .put_json(&format!("{name}.json"), &evaluations)
        .await?;
    files
        .put(
            &format!("{name}.csv"),
            day_csv::day_table(app.config.competition(), &evaluations).into_bytes(CsvFormat::Csv),
        )
        .await
}

/// The datasets of a day that the viewer may download.
async fn day_datasets(
    app: &AppState,
    visibility: &Visibility,
    viewer: Viewer,
    stage: &Stage,
    stage_day: StageDay,
) -> Result<Vec<ArtifactRow>, Problem> {
    let mut datasets = Vec::new();
    for evaluation in app.store.evaluations_of_day(stage_day).await? {
        let is_public = visibility.is_public(&evaluation);
        if !is_public && viewer != Viewer::Organiser || evaluation.dataset_removed.is_some() {
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
        datasets.push(ArtifactRow {
            key: dataset,
            blake3: dataset_blake3,
            kind: "evaluation",
            id: evaluation.id.to_string(),
            team: app.store.team(evaluation.team).await?.name.to_string(),
            stage: stage.name.to_string(),
            day: stage_day.date.to_string(),
            public: is_public,
        });
    }
    Ok(datasets)
}

/// Adds the questions of teams with their answers: the organiser's edition contains all, the public one those with a public answer.
/// The database of the public edition has no questions, because each row names the asking team.
pub(super) async fn put_team_questions(
    app: &AppState,
    edition: Edition,
    files: &mut Files,
) -> Result<(), Problem> {
    let is_organiser_edition = edition == Edition::Organiser;
    let questions = app.store.questions().await?.into_iter();
    let included: Vec<QuestionView> = questions
        .map(|question| announcement::question(question, is_organiser_edition))
        .filter(|question| question.public || is_organiser_edition)
        .collect();
    files.put_json("results/questions.json", &included).await
}

/// Adds the artifacts, and `datasets.csv`, the table of them. Artifacts that no longer exist, cannot be read or differ from their
/// hash are listed in `left_out`. Each is read for that before the archive begins: a damaged one would break it off later.
pub(super) async fn add_artifacts(
    app: &AppState,
    artifacts: Vec<ArtifactRow>,
    files: &mut Files,
    left_out: &mut Vec<String>,
) -> Result<(), Problem> {
    let mut table = csv::Table::new(&[
        "path", "of", "id", "team", "stage", "day", "public", "bytes", "blake3",
    ]);
    // Local path, length and hash of each file, by its path in the archive.
    let mut sources = BTreeMap::new();
    for artifact in artifacts {
        let path = format!("artifacts/{}", artifact.key);
        let Some(bytes) = app.store.artifacts().size_bytes(&artifact.key).await? else {
            left_out.push(format!(
                "{path}, of the {} {}: the file no longer exists",
                artifact.kind, artifact.id
            ));
            continue;
        };
        let source = app.store.artifacts().local_path(&artifact.key)?;
        let checked_hash = match files::hash(source.clone()).await? {
            Ok((hashed_bytes, blake3))
                if hashed_bytes == bytes
                    && artifact.blake3.is_none_or(|expected| expected == blake3) =>
            {
                Ok(blake3)
            }
            Ok(_) => Err("the file is damaged".to_owned()),
            Err(error) => Err(format!("the file cannot be read ({error})")),
        };
        let blake3 = match checked_hash {
            Ok(blake3) => blake3,
            Err(problem) => {
                tracing::error!(%path, problem, "left out of the season archive");
                left_out.push(format!(
                    "{path}, of the {} {}: {problem}",
                    artifact.kind, artifact.id
                ));
                continue;
            }
        };
        table.row([
            path.clone(),
            artifact.kind.to_owned(),
            artifact.id,
            csv::escape_formula(&artifact.team),
            csv::escape_formula(&artifact.stage),
            artifact.day,
            artifact.public.to_string(),
            bytes.to_string(),
            blake3.clone(),
        ]);
        // The clips of the recording (data for the replay viewer) are added if they exist.
        let clips_key = match artifact.key.strip_suffix("/game.zip") {
            Some(folder) => format!("{folder}/clips"),
            None => Artifacts::clips_key(&artifact.key),
        };
        let clips_bytes = app.store.artifacts().size_bytes(&clips_key).await?;
        if clips_bytes.is_some() {
            let source = app.store.artifacts().local_path(&clips_key)?;
            let path = format!("artifacts/{clips_key}");
            match files::hash(source.clone()).await? {
                Ok((bytes, blake3)) => {
                    sources.insert(path, (source, bytes, blake3));
                }
                Err(error) => left_out.push(format!("{path}: the file cannot be read ({error})")),
            }
        }
        sources.insert(path, (source, bytes, blake3));
    }
    files
        .put("datasets.csv", table.into_bytes(CsvFormat::Csv))
        .await?;
    for (path, (source, bytes, blake3)) in sources {
        files.add_hashed(&path, source, bytes, blake3);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slug_is_safe_in_paths() {
        assert_eq!(slug("Qualifying"), "qualifying");
        assert_eq!(slug("../Größe 2026 "), "gr--e-2026");
        assert_eq!(slug("日本"), "season");
    }
}

//! `faceoff admin announce`, `questions`, `answer` and `publish-terms`.

use crate::{
    client::Client,
    commands::output::{lines_or, print},
};
use anyhow::Context;
use faceoff_types::QuestionId;
use std::path::Path;

pub(super) async fn announce(
    client: &Client,
    json: bool,
    title: String,
    text: String,
) -> anyhow::Result<()> {
    let announcement = client.announce(title, text).await?;
    print(json, &announcement, || {
        format!("announced ({})", announcement.id)
    })
}

pub(super) async fn questions(client: &Client, json: bool) -> anyhow::Result<()> {
    let questions = client.questions().await?;
    print(json, &questions, || {
        let lines = questions.iter().map(|question| {
            let team = question
                .team
                .map_or_else(String::new, |id| format!("  team:{id}"));
            let answer = question.answer.as_deref().unwrap_or("no answer yet");
            let public = if question.public { " (public)" } else { "" };
            format!(
                "{}{team}  {}\n  {}\n→ {answer}{public}",
                question.id,
                question.at.strftime("%Y-%m-%d %H:%M UTC"),
                question.text
            )
        });
        lines_or(lines.collect(), "no questions yet")
    })
}

pub(super) async fn answer(
    client: &Client,
    json: bool,
    question: QuestionId,
    text: String,
    public: bool,
) -> anyhow::Result<()> {
    let answered = client.answer(question, text, public).await?;
    print(json, &answered, || format!("answered ({})", answered.id))
}

pub(super) async fn publish_terms(client: &Client, json: bool, file: &Path) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("reading the terms from {}", file.display()))?;
    let terms = client.publish_terms(text).await?;
    print(json, &terms, || {
        format!(
            "published as version {}; a member of each team has to accept it before the team uploads or activates again",
            terms.version
        )
    })
}

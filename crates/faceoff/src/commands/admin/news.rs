//! `faceoff admin announce`, `questions`, `answer` and `terms`: what people are told.

use crate::{
    client::Client,
    commands::output::{or_none, print},
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
    let told = client.announce(title, text).await?;
    print(json, &told, || format!("announced ({})", told.id))
}

pub(super) async fn questions(client: &Client, json: bool) -> anyhow::Result<()> {
    let questions = client.questions().await?;
    print(json, &questions, || {
        let lines = questions.iter().map(|question| {
            let team = question
                .team
                .map_or_else(String::new, |id| format!("  team:{id}"));
            let answer = question.answer.as_deref().unwrap_or("no answer yet");
            let to = if question.public {
                " (to everybody)"
            } else {
                ""
            };
            format!(
                "{}{team}  {}\n  {}\n→ {answer}{to}",
                question.id,
                question.at.strftime("%Y-%m-%d %H:%M UTC"),
                question.text
            )
        });
        or_none(lines.collect(), "nobody has asked yet")
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
            "published as version {}; teams upload and choose again once a member has accepted it",
            terms.version
        )
    })
}

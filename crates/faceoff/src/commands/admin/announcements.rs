//! `faceoff admin announce`, `questions`, `answer` and `publish-terms`.

use crate::{
    client::Client,
    commands::output::{print, print_list, time_text},
};
use anyhow::Context;
use clap::Subcommand;
use faceoff_api::views::announcement::QuestionView;
use faceoff_types::QuestionId;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum AnnouncementAction {
    /// Publish an announcement
    Announce {
        /// One line
        title: String,
        /// Plain text
        text: String,
    },
    /// List the teams' questions
    Questions,
    /// Answer a question
    Answer {
        /// The question's id
        question: QuestionId,
        /// Plain text
        text: String,
        /// Publish question and answer, without the name of the team
        #[arg(long)]
        public: bool,
    },
    /// Publish a new version of the terms of participation
    PublishTerms {
        /// A text file
        file: PathBuf,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: AnnouncementAction,
) -> anyhow::Result<()> {
    match action {
        AnnouncementAction::Announce { title, text } => {
            let announcement = client.announce(title, text).await?;
            print(json, &announcement, |announcement| {
                format!("announced ({})", announcement.id)
            })
        }
        AnnouncementAction::Questions => {
            let questions = client.questions().await?;
            print_list(json, &questions, question_text, "no questions yet")
        }
        AnnouncementAction::Answer {
            question,
            text,
            public,
        } => {
            let answered = client.answer(question, text, public).await?;
            print(json, &answered, |answered| {
                format!("answered ({})", answered.id)
            })
        }
        AnnouncementAction::PublishTerms { file } => {
            let text = std::fs::read_to_string(&file)
                .with_context(|| format!("reading the terms from {}", file.display()))?;
            let terms = client.publish_terms(text).await?;
            print(json, &terms, |terms| {
                format!(
                    "published as version {}; a member of each team has to accept it before the team uploads or activates again",
                    terms.version
                )
            })
        }
    }
}

fn question_text(question: &QuestionView) -> String {
    let team = question
        .team
        .map_or_else(String::new, |id| format!("  team:{id}"));
    let answer = question.answer.as_deref().unwrap_or("no answer yet");
    let public = if question.public { " (public)" } else { "" };
    format!(
        "{}{team}  {}\n  {}\n→ {answer}{public}",
        question.id,
        time_text(question.at),
        question.text
    )
}

//! A form with the most important settings of a stage, and its conversion into requests of the API.

mod inputs;
mod texts;

use faceoff_api::requests::{NewStage, StagePatch};
use faceoff_service::problem::Problem;
use faceoff_store::Stage;
use faceoff_types::{Competition, Task};
pub(super) use inputs::InputKind;
use inputs::{GROUPS, Input, InputGroup, NAME};
use std::iter;
pub(super) use texts::StageForm;

fn inputs() -> impl Iterator<Item = &'static Input> {
    let grouped = GROUPS.iter().flat_map(|group| group.inputs);
    iter::once(&NAME).chain(grouped)
}

/// The name of a task's checkbox.
fn task_checkbox(task: Task) -> String {
    format!("task_{task}")
}

impl StageForm {
    /// The current settings of a stage.
    pub(super) fn from_stage(stage: &Stage) -> Self {
        let texts = inputs().map(|input| (input.name.to_owned(), (input.text)(stage)));
        let tasks = stage.revision.rules.tasks.iter();
        let tasks = tasks.map(|task| (task_checkbox(*task), "on".to_owned()));
        Self(texts.chain(tasks).collect())
    }

    /// Default settings for a new stage: those of `stage` without name and dates.
    pub(super) fn defaults_from(stage: &Stage) -> Self {
        let mut form = Self::from_stage(stage);
        for name in [
            "name",
            "opens_at",
            "closes_at",
            "schedule",
            "days_off",
            "blind",
        ] {
            form.0.remove(name);
        }
        form.0
            .insert("ablation_episodes".to_owned(), "0".to_owned());
        form
    }

    /// The inputs, except that of the name.
    pub(super) const fn groups(&self) -> &'static [InputGroup] {
        &GROUPS
    }

    /// The ticked tasks, in the competition's order.
    fn tasks(&self, competition: &Competition) -> Vec<Task> {
        let is_ticked = |task: &Task| self.is_ticked(&task_checkbox(*task));
        competition.task_names().filter(is_ticked).collect()
    }

    /// The checkboxes of the tasks: name and label.
    pub(super) fn task_checkboxes(competition: &Competition) -> Vec<(String, String)> {
        let tasks = competition.tasks.iter();
        tasks
            .map(|info| (task_checkbox(info.task), info.title.clone()))
            .collect()
    }

    /// Is the text of this input another one than in the other form?
    fn differs(&self, other: &Self, input: &Input) -> bool {
        match input.kind {
            InputKind::Checkbox => self.is_ticked(input.name) != other.is_ticked(input.name),
            _ => self.text(input.name) != other.text(input.name),
        }
    }

    /// The differences between the form and the stage. Unchanged settings are omitted, since many of them cannot be changed at
    /// any time.
    pub(super) fn change(
        &self,
        stage: &Stage,
        competition: &Competition,
    ) -> Result<StagePatch, Problem> {
        let current = Self::from_stage(stage);
        let mut change = StagePatch::default();
        for input in inputs().filter(|input| self.differs(&current, input)) {
            (input.read)(self, &mut change)?;
        }
        let tasks = self.tasks(competition);
        change.tasks = (tasks != current.tasks(competition)).then_some(tasks);
        change.confirm = Some(self.text("confirm").to_owned()).filter(|name| !name.is_empty());
        Ok(change)
    }

    /// The request for a new stage.
    pub(super) fn new_stage(&self, competition: &Competition) -> Result<NewStage, Problem> {
        let mut patch = StagePatch::default();
        for input in inputs() {
            (input.read)(self, &mut patch)?;
        }
        patch.tasks = Some(self.tasks(competition));
        Ok(NewStage {
            name: patch.name.take().unwrap_or_default(),
            settings: patch,
        })
    }
}

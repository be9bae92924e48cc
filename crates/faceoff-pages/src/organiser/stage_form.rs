//! A form with the most important settings of a stage, and its conversion into requests of the API.

mod inputs;
mod texts;

use faceoff_api::requests::{NewStage, StagePatch};
use faceoff_service::problem::Problem;
use faceoff_store::Stage;
pub(super) use inputs::InputKind;
use inputs::{GROUPS, Input, InputGroup, NAME};
use std::iter;
pub(super) use texts::StageForm;

fn inputs() -> impl Iterator<Item = &'static Input> {
    let grouped = GROUPS.iter().flat_map(|group| group.inputs);
    iter::once(&NAME).chain(grouped)
}

impl StageForm {
    /// The current settings of a stage.
    pub(super) fn from_stage(stage: &Stage) -> Self {
        let texts = inputs().map(|input| (input.name.to_owned(), (input.text)(stage)));
        Self(texts.collect())
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

    fn differs(&self, other: &Self, input: &Input) -> bool {
        match input.kind {
            InputKind::Checkbox => self.is_ticked(input.name) != other.is_ticked(input.name),
            _ => self.text(input.name) != other.text(input.name),
        }
    }

    /// The differences between the form and the stage. Unchanged settings are omitted, since many of them cannot be changed at
    /// any time.
    pub(super) fn change(&self, stage: &Stage) -> Result<StagePatch, Problem> {
        let current = Self::from_stage(stage);
        let mut change = StagePatch::default();
        for input in inputs().filter(|input| self.differs(&current, input)) {
            (input.read)(self, &mut change)?;
        }
        change.confirm = Some(self.text("confirm").to_owned()).filter(|name| !name.is_empty());
        Ok(change)
    }

    /// The request for a new stage.
    pub(super) fn new_stage(&self) -> Result<NewStage, Problem> {
        let mut patch = StagePatch::default();
        for input in inputs() {
            (input.read)(self, &mut patch)?;
        }
        Ok(NewStage {
            name: patch.name.take().unwrap_or_default(),
            settings: patch,
        })
    }
}

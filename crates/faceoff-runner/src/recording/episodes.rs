use super::{EpisodeStart, columns::FloatColumns, parquet_file::TableWriter};
use crate::PlatformFault;
use arrow_array::{
    ArrayRef,
    builder::{BooleanBuilder, StringBuilder, UInt32Builder},
};
use arrow_schema::{DataType, Field, Schema};
use faceoff_sim::EpisodeState;
use faceoff_types::{EpisodeEnd, EpisodeOutcome};
use std::{path::Path, sync::Arc};

/// Episodes that are held before they go to the file.
const BATCH: usize = 256;

/// The table of episodes: one row each.
pub(super) struct EpisodesTable {
    writer: TableWriter,
    rows: usize,
    /// How the episode under way began.
    begun: Option<Begun>,
    tasks: StringBuilder,
    episodes: UInt32Builder,
    seeds: StringBuilder,
    interpolations: StringBuilder,
    steps: UInt32Builder,
    ends: StringBuilder,
    successes: BooleanBuilder,
    violations: [BooleanBuilder; 4],
    times: FloatColumns,
    faults: StringBuilder,
    host_noise_reruns: UInt32Builder,
    initial: FloatColumns,
}

struct Begun {
    seed: String,
    interpolation: Option<String>,
    initial: EpisodeState,
}

impl EpisodesTable {
    pub fn create(path: &Path) -> Result<Self, PlatformFault> {
        let times = FloatColumns::default().with(
            [
                "penalty_points",
                "computation_time_mean_s",
                "computation_time_max_s",
            ]
            .map(str::to_owned),
            false,
        );
        let initial = FloatColumns::default().with_state("initial_");
        let text = |name: &str, nullable| Field::new(name, DataType::Utf8, nullable);
        let flag = |name: &str| Field::new(name, DataType::Boolean, false);
        let mut fields = vec![
            text("task", false),
            Field::new("episode", DataType::UInt32, false),
            text("seed", false),
            text("interpolation", true),
            Field::new("steps", DataType::UInt32, false),
            text("end", false),
            flag("success"),
            flag("violated_ee"),
            flag("violated_link"),
            flag("violated_joint_pos"),
            flag("violated_joint_vel"),
        ];
        fields.extend_from_slice(times.fields());
        fields.push(text("fault", true));
        fields.push(Field::new("host_noise_reruns", DataType::UInt32, false));
        fields.extend_from_slice(initial.fields());
        Ok(Self {
            writer: TableWriter::create(path, Schema::new(fields))?,
            rows: 0,
            begun: None,
            tasks: StringBuilder::new(),
            episodes: UInt32Builder::new(),
            seeds: StringBuilder::new(),
            interpolations: StringBuilder::new(),
            steps: UInt32Builder::new(),
            ends: StringBuilder::new(),
            successes: BooleanBuilder::new(),
            violations: Default::default(),
            times,
            faults: StringBuilder::new(),
            host_noise_reruns: UInt32Builder::new(),
            initial,
        })
    }

    /// Begins an episode, in place of one that has not ended.
    pub fn begin(&mut self, start: &EpisodeStart<'_>) {
        self.begun = Some(Begun {
            seed: start.seed.to_string(),
            interpolation: start.interpolation.map(|code| code.to_string()),
            initial: start.state.clone(),
        });
    }

    pub fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_noise_reruns: u32,
    ) -> Result<(), PlatformFault> {
        let begun = self.begun.take().ok_or_else(|| {
            PlatformFault::Recording("an episode ended that was not begun".to_owned())
        })?;
        self.seeds.append_value(begun.seed);
        self.interpolations.append_option(begun.interpolation);
        self.initial.put_state(&begun.initial);
        self.initial.end_row();
        self.tasks.append_value(outcome.task.as_str());
        self.episodes.append_value(outcome.episode);
        self.steps.append_value(outcome.steps);
        self.ends.append_value(end_name(outcome.end));
        self.successes.append_value(outcome.success);
        let v = outcome.violations;
        for (column, value) in
            self.violations
                .iter_mut()
                .zip([v.ee, v.link, v.joint_pos, v.joint_vel])
        {
            column.append_value(value);
        }
        self.times.put(&[
            faceoff_scoring::episode_penalty(outcome),
            outcome.computation_time.mean_s,
            outcome.computation_time.max_s,
        ]);
        self.times.end_row();
        let fault = outcome
            .fault
            .as_ref()
            .map(serde_json::to_string)
            .transpose()
            .map_err(PlatformFault::recording("writing a fault"))?;
        self.faults.append_option(fault);
        self.host_noise_reruns.append_value(host_noise_reruns);
        self.rows += 1;
        if self.rows < BATCH {
            Ok(())
        } else {
            self.flush()
        }
    }

    fn flush(&mut self) -> Result<(), PlatformFault> {
        if self.rows == 0 {
            return Ok(());
        }
        self.rows = 0;
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(self.tasks.finish()),
            Arc::new(self.episodes.finish()),
            Arc::new(self.seeds.finish()),
            Arc::new(self.interpolations.finish()),
            Arc::new(self.steps.finish()),
            Arc::new(self.ends.finish()),
            Arc::new(self.successes.finish()),
        ];
        columns.extend(
            self.violations
                .iter_mut()
                .map(|column| Arc::new(column.finish()) as ArrayRef),
        );
        columns.extend(self.times.take());
        columns.push(Arc::new(self.faults.finish()));
        columns.push(Arc::new(self.host_noise_reruns.finish()));
        columns.extend(self.initial.take());
        self.writer.write(columns)
    }

    pub fn finish(mut self) -> Result<(), PlatformFault> {
        self.flush()?;
        self.writer.finish()
    }
}

const fn end_name(end: EpisodeEnd) -> &'static str {
    match end {
        EpisodeEnd::Horizon => "horizon",
        EpisodeEnd::LeftTable => "left_table",
        EpisodeEnd::CrossedMiddle => "crossed_middle",
        EpisodeEnd::Stopped => "stopped",
        EpisodeEnd::ReachedAxis => "reached_axis",
        EpisodeEnd::AgentFault => "agent_fault",
    }
}

use super::{
    npy::NpyWriter,
    pickle::{Transition, Transitions},
};
use anyhow::{Context, ensure};
use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use clap::Args;
use faceoff_dataset::{Dataset, EpisodeRecord, StepBatches};
use faceoff_types::{EpisodeEnd, Interpolation, Task, Tier};
use serde_json::{Map, Value, json};
use std::{
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

/// Writes one folder per task, as the 2023 challenge's evaluation did.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// dataset.zip, the folder it was unpacked to, or the folder that `faceoff eval` wrote
    dataset: PathBuf,
    /// Folder for the export; it must not hold one already
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Constraint groups of the 2023 challenge and the columns that hold their largest value.
const CONSTRAINTS: [(&str, &str); 4] = [
    ("joint_pos_constr", "constraint_joint_pos"),
    ("joint_vel_constr", "constraint_joint_vel"),
    ("ee_constr", "constraint_ee"),
    ("link_constr", "constraint_link"),
];

impl ExportArgs {
    pub fn run(self) -> anyhow::Result<()> {
        let dataset = Dataset::open(&self.dataset)?;
        let episodes = dataset.episodes()?;
        let mut steps = dataset.steps()?.read(None)?;
        for task in dataset.manifest().episodes.keys() {
            let dir = self.out.join(environment(*task));
            fs::create_dir_all(&self.out)
                .and_then(|()| fs::create_dir(&dir))
                .with_context(|| format!("making {}", dir.display()))?;
            let mine: Vec<&EpisodeRecord> = episodes
                .iter()
                .filter(|episode| episode.outcome.task == *task)
                .collect();
            Export::create(&dir, &mine)
                .with_context(|| format!("writing to {}", dir.display()))?
                .write(&mine, &mut steps)
                .with_context(|| format!("writing to {}", dir.display()))?;
            write_json(&dir.join("violations.json"), &violations(&mine))?;
        }
        write_json(&self.out.join("results.json"), &results(&dataset)?)
    }
}

/// The task's name in 2023.
fn environment(task: Task) -> &'static str {
    match task {
        Task::Hit => "7dof-hit",
        Task::Defend => "7dof-defend",
        Task::Prepare => "7dof-prepare",
    }
}

/// The files of one task being written.
struct Export {
    transitions: Transitions<BufWriter<File>>,
    times: NpyWriter,
    constraints: Vec<(&'static str, NpyWriter)>,
}

impl Export {
    fn create(dir: &Path, episodes: &[&EpisodeRecord]) -> io::Result<Self> {
        let steps = episodes
            .iter()
            .map(|episode| u64::from(episode.outcome.steps))
            .sum();
        let constraints = CONSTRAINTS.map(|(name, column)| {
            NpyWriter::create(&dir.join(format!("{name}.npy")), &[steps, 1])
                .map(|writer| (column, writer))
        });
        Ok(Self {
            transitions: Transitions::new(BufWriter::new(File::create(dir.join("dataset.pkl"))?))?,
            times: NpyWriter::create(&dir.join("computation_time.npy"), &[steps])?,
            constraints: constraints.into_iter().collect::<io::Result<_>>()?,
        })
    }

    fn write(mut self, episodes: &[&EpisodeRecord], steps: &mut StepBatches) -> anyhow::Result<()> {
        for episode in episodes {
            let of = &episode.outcome;
            let pieces = steps.take_rows(of.steps as usize)?;
            self.episode(episode, &pieces)
                .with_context(|| format!("{}, episode {}", of.task, of.episode))?;
        }
        self.transitions.finish()?;
        self.times.finish()?;
        for (_, writer) in self.constraints {
            writer.finish()?;
        }
        Ok(())
    }

    fn episode(&mut self, episode: &EpisodeRecord, pieces: &[RecordBatch]) -> anyhow::Result<()> {
        let steps = episode.outcome.steps as usize;
        let absorbs = !matches!(
            episode.outcome.end,
            EpisodeEnd::Horizon | EpisodeEnd::AgentFault
        );
        let mut observations = Vec::new();
        for piece in pieces {
            observations.extend((0..piece.num_rows()).map(|row| observation(piece, row)));
        }
        ensure!(
            observations.len() == steps,
            "{} control steps are missing",
            steps - observations.len()
        );
        observations.push(episode.last_observation.clone());
        let shape = shape(episode)?;
        let mut step = 0;
        for piece in pieces {
            let times = piece["computation_time_ns"].as_primitive::<Int64Type>();
            let actions = piece["action"].as_list::<i32>();
            for row in 0..piece.num_rows() {
                let last = step + 1 == steps;
                let action = actions.value(row);
                self.transitions.push(&Transition {
                    state: &observations[step],
                    action: action.as_primitive::<Float64Type>().values(),
                    action_shape: shape,
                    // The challenge's evaluation gave none.
                    reward: 0.0,
                    next_state: &observations[step + 1],
                    absorbing: last && absorbs,
                    last,
                })?;
                self.times.push(times.value(row) as f64 / 1e9)?;
                for (column, writer) in &mut self.constraints {
                    writer.push(piece[*column].as_primitive::<Float64Type>().value(row))?;
                }
                step += 1;
            }
        }
        Ok(())
    }
}

/// The observation of a row, without what is absent.
fn observation(batch: &RecordBatch, row: usize) -> Vec<f64> {
    let schema = batch.schema();
    schema
        .fields()
        .iter()
        .zip(batch.columns())
        .filter(|(field, column)| field.name().starts_with("obs_") && column.is_valid(row))
        .map(|(_, column)| column.as_primitive::<Float64Type>().value(row))
        .collect()
}

fn shape(episode: &EpisodeRecord) -> anyhow::Result<&'static [usize]> {
    let code = match episode.interpolation.as_deref() {
        // It never answered: there is no action.
        None => return Ok(&[]),
        Some("null") => None,
        Some(code) => Some(
            code.parse()
                .with_context(|| format!("interpolation {code:?}"))?,
        ),
    };
    Ok(Interpolation::from_code(code)?.shape())
}

/// What was violated in which episode, in the words of 2023.
fn violations(episodes: &[&EpisodeRecord]) -> Value {
    let mut out = Map::new();
    let mut counts = [0u32; 5];
    let names = [
        "joint_pos_constr",
        "joint_vel_constr",
        "ee_constr",
        "link_constr",
        "Computation Time",
    ];
    for EpisodeRecord { outcome, .. } in episodes {
        let (v, time) = (outcome.violations, outcome.computation_time);
        let slow = if time.max_s > 0.2 {
            Some("max computation_time > 0.2s")
        } else if time.mean_s > 0.02 {
            Some("mean computation_time > 0.02s")
        } else if time.max_s > 0.1 {
            Some("max computation_time > 0.1s")
        } else if time.max_s > 0.02 {
            Some("max computation_time > 0.02s")
        } else {
            None
        };
        let mut broken: Vec<String> = Vec::new();
        for (index, violated) in [v.joint_pos, v.joint_vel, v.ee, v.link]
            .into_iter()
            .enumerate()
        {
            if violated {
                counts[index] += 1;
                broken.push(format!("{} violated", names[index]));
            }
        }
        if let Some(slow) = slow {
            counts[4] += 1;
            broken.push(slow.to_owned());
        }
        if !broken.is_empty() {
            out.insert(format!("Episode {}", outcome.episode), broken.into());
        }
    }
    let mut summary: Map<String, Value> = names
        .iter()
        .zip(counts)
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| ((*name).to_owned(), count.into()))
        .collect();
    summary.insert("Total".to_owned(), counts.iter().sum::<u32>().into());
    out.insert("violation summary".to_owned(), summary.into());
    out.into()
}

fn results(dataset: &Dataset) -> anyhow::Result<Value> {
    let result = dataset.results()?;
    let colour = |tier| match tier {
        Tier::Deployable => 0,
        Tier::Improvable => 1,
        Tier::NonDeployable => 2,
    };
    let mut out = Map::new();
    for (task, r) in &result.tasks {
        out.insert(
            environment(*task).to_owned(),
            json!({"Success": r.success_rate, "Penalty": r.penalty_points, "Color": colour(r.tier)}),
        );
    }
    out.insert(
        "Total Score".to_owned(),
        json!({
            "Score": result.score / 100.0,
            "Max Penalty": result.penalty_points,
            "Color": colour(result.tier),
        }),
    );
    Ok(out.into())
}

fn write_json(path: &Path, value: &Value) -> anyhow::Result<()> {
    let mut text = serde_json::to_string_pretty(value).context("writing JSON")?;
    text.push('\n');
    fs::write(path, text).with_context(|| format!("writing {}", path.display()))
}

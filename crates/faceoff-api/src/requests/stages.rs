//! The settings of a stage, a part of the season with its own rules, in requests and on the command line.

#[cfg(feature = "clap")]
mod options;
mod schema;

#[cfg(feature = "clap")]
pub use options::read_perturbations;

use super::double_option::{OrNull, deserialize_some};
use crate::objects_only;
use faceoff_types::{
    CountingResult, DayDeadline, IanaTimeZone, InvalidStageRules, Magnitudes, Profile, Publication,
    Retention, Ruleset, Runtimes, Schedule, StageLimits, StageRules, StageSettings,
    StageUploadLimits, Task, TaskWeights, TierBounds,
};
use jiff::Timestamp;
use serde::{Deserialize, Deserializer, Serialize, de::Error};
use utoipa::ToSchema;

/// Changes of a stage. Fields that are left out stay as they are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
#[schema(as = StageChange)]
pub struct StagePatch {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// When its first evaluation day may start. Default of a new stage: now. Changes only while the stage has not opened.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opens_at: Option<Timestamp>,
    /// From then on no evaluation day starts; null: no end, which is the default of a new stage. Changes only while the
    /// stage has not closed.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some"
    )]
    #[schema(value_type = Option<Timestamp>)]
    pub closes_at: Option<OrNull<Timestamp>>,
    /// Time zone of its days and its schedule. Changes only before the stage's first cutoff.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "NAME",
            help = "Time zone of the evaluation days and the schedule, e.g. Europe/Berlin"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<IanaTimeZone>,
    /// Perturbation profile of the simulator.
    #[cfg_attr(feature = "clap", arg(long, help = "Perturbation profile"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// Tasks, at least one, without duplicates. They run in the order of the competition.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tasks: Option<Vec<Task>>,
    /// Episodes of each task per evaluation.
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "episodes",
            value_name = "EPISODES",
            help = "Episodes per task and evaluation"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_task: Option<u32>,
    /// An evaluation with more agent faults than this fails, without a score.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            help = "Agent faults allowed in an evaluation; with more, it has no score"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_faults: Option<u32>,
    /// Weight of each task's success rate in the overall score.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<TaskWeights>,
    /// For each tier, the most penalty points per episode that it allows.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "BOUNDS",
            help = "Penalty points per episode up to which an agent is deployable and improvable, e.g. 0.5,1.5"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the perturbations that the profile switches on. Replaces all of them: those that are left out get
    /// the ruleset's values.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "FILE",
            value_parser = options::read_perturbations,
            help = "A JSON file with magnitudes of the perturbations; those left out are the ruleset's, so {} resets all of them"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Magnitudes>,
    /// Resource limits of agents. Replaces all of them: fields that are left out get the values of the server's
    /// configuration.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "JSON",
            value_parser = options::parse_json::<Box<StageLimits>>,
            help = "Limits of agents instead of the server's, e.g. '{\"memory_bytes\":4294967296,\"step_s\":0.5}'; {} resets them"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<Box<StageLimits>>,
    /// Runtimes that agents may use, out of those that the server offers; null: all of them.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "NAMES",
            value_parser = options::parse_runtimes,
            help = "Allowed runtimes, e.g. native,python3; `all`: all that the server offers"
        )
    )]
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some"
    )]
    #[schema(value_type = Option<Runtimes>)]
    pub runtimes: Option<OrNull<Runtimes>>,
    /// Upload limits per team while the stage is open. Replaces all of them: fields that are left out get the values of
    /// the server's configuration.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "JSON",
            value_parser = options::parse_json::<StageUploadLimits>,
            help = "Upload limits of each team instead of the server's, e.g. '{\"waiting\":2,\"day_bytes\":1073741824}'"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uploads: Option<StageUploadLimits>,
    /// When its evaluation days start; null: an organiser starts them, which is the default of a new stage.
    #[cfg_attr(feature = "clap", command(flatten))]
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some"
    )]
    #[schema(value_type = Option<Schedule>)]
    pub schedule: Option<OrNull<Schedule>>,
    /// Episodes per task and profile of the ablation that a scheduled day starts for each submission; 0: no ablation, which
    /// is the default of a new stage.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            help = "Episodes per task and profile of the ablation that the schedule starts for each submission; 0: none"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ablation_episodes: Option<u32>,
    /// Episodes per shard, which is the part of a task that one job runs.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            help = "Episodes per shard, the job that one slot runs at a time"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_shard: Option<u32>,
    /// Until when the evaluations of a day may run: "next_cut" (the next cutoff), "never" or {"hours":30}. Default of a new
    /// stage: the next cutoff. A change applies to running days, too.
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "deadline",
            value_name = "DEADLINE",
            help = "Deadline of an evaluation day: next-cut, never, or hours after its cutoff, e.g. 30h"
        )
    )]
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_deadline"
    )]
    pub day_deadline: Option<DayDeadline>,
    /// Whether only organisers see its scores. Default of a new stage: false. `false` reveals the scores of a blind stage,
    /// also after it has closed; once there are scores this is final. A stage becomes blind only before it has scores.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "true|false",
            help = "Hide the scores from everyone but organisers; `false` reveals them, permanently if there are any"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blind: Option<bool>,
    /// When its datasets become public. Default of a new stage: when it closes. After the stage has closed only an earlier
    /// time is accepted.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "TIME",
            help = "When datasets are published: never, at_close or at_release"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub publishes: Option<Publication>,
    /// Which of its files are kept. Replaces the whole setting; `{}` keeps all, which is the default of a new stage. Also
    /// accepted after the stage has closed or is signed off.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "JSON",
            value_parser = options::parse_json::<Retention>,
            help = "Retention of datasets and bundles, e.g. '{\"last\":5,\"days_after_sign_off\":90}' or '{\"until\":\"2027-06-01T00:00:00Z\"}'; {} keeps all files"
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retention: Option<Retention>,
    /// Which of a team's evaluations count for its board row. Default of a new stage: the newest one.
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "standings",
            value_name = "RESULT",
            help = "The result that counts for a team: latest, best, mean_of_last:N, or final"
        )
    )]
    #[serde(rename = "standings", skip_serializing_if = "Option::is_none")]
    pub counting_result: Option<CountingResult>,
    /// The stage's name. Required if the change starts a new revision of an open stage, reorders its board, or removes
    /// files.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Deserialises by way of a JSON value, so that a wrong deadline is reported as a wrong value and not as invalid JSON.
fn deserialize_deadline<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<DayDeadline>, D::Error> {
    let value = Option::<serde_json::Value>::deserialize(deserializer)?;
    let Some(value) = value else { return Ok(None) };
    objects_only::check::<DayDeadline>(&value).map_err(Error::custom)?;
    let parsed = serde_json::from_value(value);
    parsed.map(Some).map_err(Error::custom)
}

/// Replaces `value` if there is a new one. Returns whether there is.
fn replace<T: Clone>(value: &mut T, new: Option<&T>) -> bool {
    if let Some(new) = new {
        value.clone_from(new);
    }
    new.is_some()
}

impl StagePatch {
    /// Changes the rules and settings of a stage and checks the result. The name, the times and the time zone are not among them:
    /// the caller changes those. If the patch has rules, they are rules of `newest`, the ruleset of new evaluations; otherwise a
    /// stage keeps its ruleset when a newer server version brings another one.
    ///
    /// # Errors
    /// The first value that is invalid after the change.
    pub fn apply(
        &self,
        rules: &mut StageRules,
        settings: &mut StageSettings,
        newest: Ruleset,
    ) -> Result<(), InvalidStageRules> {
        let variation = &mut rules.variation;
        let new_rules = [
            replace(&mut rules.profile, self.profile.as_ref()),
            replace(&mut rules.tasks, self.tasks.as_ref()),
            replace(
                &mut rules.episodes_per_task,
                self.episodes_per_task.as_ref(),
            ),
            replace(&mut rules.max_faults, self.max_faults.as_ref()),
            replace(
                &mut variation.weights,
                self.weights.clone().map(Some).as_ref(),
            ),
            replace(
                &mut variation.tier_bounds,
                self.tier_bounds.map(Some).as_ref(),
            ),
            replace(&mut variation.perturbations, self.perturbations.as_ref()),
            replace(&mut rules.limits, self.limits.as_ref()),
            replace(
                &mut rules.runtimes,
                self.runtimes.as_ref().map(|new| &new.0),
            ),
        ];
        if new_rules.contains(&true) {
            rules.ruleset = newest;
        }
        replace(
            &mut settings.schedule,
            self.schedule.as_ref().map(|new| &new.0),
        );
        replace(
            &mut settings.ablation_episodes,
            self.ablation_episodes.as_ref(),
        );
        replace(
            &mut settings.episodes_per_shard,
            self.episodes_per_shard.as_ref(),
        );
        replace(&mut settings.day_deadline, self.day_deadline.as_ref());
        replace(&mut settings.blind, self.blind.as_ref());
        replace(&mut settings.publishes, self.publishes.as_ref());
        replace(&mut settings.counting_result, self.counting_result.as_ref());
        replace(&mut settings.uploads, self.uploads.as_ref());
        rules.check()?;
        settings.check()
    }
}

/// A stage to create.
#[derive(Debug, Clone, Serialize)]
pub struct NewStage {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    pub name: String,
    /// Its settings, without a name and a confirmation.
    #[serde(flatten)]
    pub settings: StagePatch,
}

/// The settings report unknown fields, which they could not do with `serde(flatten)`.
impl<'de> Deserialize<'de> for NewStage {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut settings = StagePatch::deserialize(deserializer)?;
        if settings.confirm.is_some() {
            return Err(Error::custom(
                "unknown field `confirm`: a new stage needs no confirmation",
            ));
        }
        let name = settings.name.take();
        Ok(Self {
            name: name.ok_or_else(|| Error::missing_field("name"))?,
            settings,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// Merges JSON objects.
    fn merge(objects: [Value; 2]) -> Value {
        let fields = objects.into_iter().flat_map(|object| match object {
            Value::Object(fields) => fields,
            other => panic!("not an object: {other}"),
        });
        Value::Object(fields.collect())
    }

    const NEWEST: Ruleset = Ruleset::new("airhockey-2023.3");

    #[test]
    fn patch_changes_every_rule_and_setting() {
        let rules: StageRules = serde_json::from_value(json!({
            "ruleset": NEWEST,
            "profile": "delay",
            "tasks": ["defend"],
            "episodes_per_task": 7,
            "max_faults": 2,
            "weights": { "hit": 0.5, "defend": 0.5, "prepare": 0 },
            "tier_bounds": { "deployable": 0.25, "improvable": 1 },
            "perturbations": { "tracking_loss": { "probability": 0.1 } },
            "limits": { "pids": 9 },
            "runtimes": ["native"],
        }))
        .unwrap();
        let settings = StageSettings {
            schedule: Some(Schedule::cron("0 6 * * 1-5").unwrap()),
            ablation_episodes: 3,
            episodes_per_shard: 4,
            day_deadline: DayDeadline::Hours(30),
            blind: true,
            publishes: Publication::Never,
            counting_result: CountingResult::Best,
            uploads: StageUploadLimits {
                waiting: Some(2),
                ..StageUploadLimits::default()
            },
        };
        let mut json = merge([
            serde_json::to_value(&rules).unwrap(),
            serde_json::to_value(&settings).unwrap(),
        ]);
        json.as_object_mut().unwrap().remove("ruleset");
        let patch: StagePatch = serde_json::from_value(json).unwrap();
        let mut changed_rules: StageRules = serde_json::from_value(json!({
            "ruleset": "airhockey-2023.2",
            "profile": "evaluation",
            "tasks": ["hit"],
            "episodes_per_task": 1,
            "max_faults": 0,
        }))
        .unwrap();
        let mut changed_settings = StageSettings::default();
        let unchanged = (changed_rules.clone(), changed_settings.clone());
        let applied =
            StagePatch::default().apply(&mut changed_rules, &mut changed_settings, NEWEST);
        assert_eq!(applied, Ok(()));
        assert_eq!(
            (&changed_rules, &changed_settings),
            (&unchanged.0, &unchanged.1)
        );
        let applied = patch.apply(&mut changed_rules, &mut changed_settings, NEWEST);
        assert_eq!(applied, Ok(()));
        assert_eq!((changed_rules, changed_settings), (rules, settings));
    }

    #[test]
    fn new_stage_has_the_fields_of_a_change() {
        let body =
            json!({ "name": "Final", "runtimes": null, "schedule": { "daily": "06:00:00" } });
        let new: NewStage = serde_json::from_value(body.clone()).unwrap();
        assert_eq!(new.settings.runtimes, Some(OrNull(None)));
        assert_eq!(serde_json::to_value(&new).unwrap(), body);
        for (body, words) in [
            (json!({}), "missing field `name`"),
            (
                json!({ "name": "Final", "deadline": "never" }),
                "unknown field `deadline`, expected one of `name`",
            ),
            (
                json!({ "name": "Final", "confirm": "Final" }),
                "unknown field `confirm`",
            ),
        ] {
            let error = serde_json::from_value::<NewStage>(body).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}

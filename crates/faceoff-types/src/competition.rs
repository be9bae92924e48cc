//! A competition: what the platform has to know of it in order to run and to show it. A stage of the season has *rules*, which may
//! replace some values of the competition: its *variation*.

use crate::{
    ACTION_LIMIT, ActionSpace, EpisodeEnd, InvalidMagnitude, InvalidStageRules, InvalidTournament,
    MagnitudeInfo, Magnitudes, Millionths, Profile, ProfileMap, RecordingColumns, Ruleset,
    StageRules, Task, TaskMap, TaskWeights, TierBounds, TournamentRules, UnknownProfile,
    UnknownRuleset, UnknownTask, Variation, ViolationCounts, ViolationName, Violations,
};
use std::collections::HashSet;

/// The description of a competition. Boards, tables, forms and files take their tasks, violations, profiles and tiers from it, recordings
/// their columns, and parsers of answers the layouts of actions.
#[derive(Debug, Clone, PartialEq)]
pub struct Competition {
    /// Letters, digits and dashes: identifies the competition in files and in [`Self::hash`].
    pub id: String,
    /// Its name for people.
    pub title: String,
    /// Its name in the heading of the board.
    pub short_title: String,
    /// What agents do, in running text, such as "robot air hockey".
    pub subject: String,
    /// What it is, as a sentence for visitors who have never heard of it.
    pub summary: String,
    /// Versions of its simulator and of its scoring, oldest first: at least one. New evaluations have the last one.
    pub rulesets: Vec<RulesetInfo>,
    /// Are there clips of its episodes, so that they can be replayed?
    pub has_replays: bool,
    /// Are there games of two agents, so that tournaments are possible?
    pub has_games: bool,
    /// In the order of boards.
    pub tasks: Vec<TaskInfo>,
    /// How episodes end, in the order in which pages list them.
    pub ends: Vec<EndInfo>,
    /// Kinds of violations of the agent's limits, in display order.
    pub violations: Vec<ViolationInfo>,
    /// The layouts of agents' actions.
    pub actions: ActionSpace,
    /// The columns of recordings.
    pub recording: RecordingColumns,
    /// The bounds of its tiers, unless a stage has others; `None`: a competition without tiers, whose boards rank by score alone.
    pub tiers: Option<TierBounds>,
    /// Sets of perturbations, in the order in which tables list them.
    pub profiles: Vec<ProfileInfo>,
    /// The profile of the simulator that teams have, with which ablations compare the others. It is one of `profiles`.
    pub ideal_profile: Profile,
    /// The profile of evaluations that count, unless a stage has another. It is one of `profiles`.
    pub counting_profile: Profile,
    /// Magnitudes of the perturbations, group by group, in the order of files.
    pub magnitudes: Vec<MagnitudeInfo>,
}

/// A version of a competition's simulator and of its scoring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RulesetInfo {
    pub ruleset: Ruleset,
    /// The largest magnitude of a number in a recorded action: at least [`ACTION_LIMIT`], at most `f64::MAX`, which only refuses
    /// infinite numbers.
    pub action_limit: f64,
}

/// A task of a competition.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskInfo {
    /// Its name in files, in the API and on the command line. Not `tournament`, which is the name of games, nor a column of all boards
    /// (`place`, `team`, `score`, `points`).
    pub task: Task,
    /// The heading of its board and of its columns.
    pub title: String,
    /// What the agent has to achieve, as a sentence.
    pub aim: String,
    /// What a success is called in running text, such as "goal".
    pub achievement: String,
    /// What happens in it: elements of an SVG drawing of 120 × 64 units; empty without a drawing. Strokes have the classes `path` and
    /// `arrow`, bodies `object`, `agent` and `other`, the surroundings `ground`.
    pub drawing: String,
    /// Share of its success rate in the overall score, unless a stage has other weights. The shares sum to 1.
    pub weight: Millionths,
    /// Control steps of the longest episode.
    pub max_steps: u32,
    /// Duration of a control step, in seconds.
    pub control_step_s: f64,
}

/// A way in which episodes end.
#[derive(Debug, Clone, PartialEq)]
pub struct EndInfo {
    /// Its name in files and queries.
    pub end: EpisodeEnd,
    /// Its name in lists, such as "time limit reached".
    pub title: String,
}

/// A kind of violation.
#[derive(Debug, Clone, PartialEq)]
pub struct ViolationInfo {
    /// Its name in files and queries.
    pub name: ViolationName,
    /// Its name in lists, such as "end effector".
    pub title: String,
    /// The heading of its columns, such as "joint position".
    pub column_heading: String,
    /// The heading of its columns in a terminal, of at most four letters.
    pub short: String,
    /// What has happened, such as "end effector out of bounds".
    pub description: String,
    /// What its size is in files, such as "metres beyond the bound".
    pub measure: String,
    /// The least and the most penalty points for it in one episode: multiples of one half. Only those of the computation time differ.
    pub points: [f64; 2],
}

/// A profile, that is, a set of perturbations.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileInfo {
    /// Its name in files, in the API and on the command line.
    pub profile: Profile,
    /// Its name in legends, such as "model mismatch".
    pub title: String,
    /// Its perturbations, as a sentence.
    pub description: String,
    /// Its letter in charts, where colour alone must not carry the meaning.
    pub letter: char,
    /// Do ablations evaluate submissions in this profile?
    pub is_in_ablations: bool,
}

impl Competition {
    /// Checks that its parts fit together.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self) -> Result<(), String> {
        let require = |holds: bool, problem: &str| match holds {
            true => Ok(()),
            false => Err(problem.to_owned()),
        };
        require(!self.rulesets.is_empty(), "it has no ruleset")?;
        let mut seen = HashSet::new();
        let is_new = |info: &RulesetInfo| seen.insert(info.ruleset);
        require(self.rulesets.iter().all(is_new), "a ruleset occurs twice")?;
        // Numbers of an agent beyond `ACTION_LIMIT` are refused when they arrive. So recordings must allow numbers up to it. Infinite
        // ones are refused always.
        let has_valid_limit =
            |info: &RulesetInfo| (ACTION_LIMIT..=f64::MAX).contains(&info.action_limit);
        require(
            self.rulesets.iter().all(has_valid_limit),
            "the action limit of a ruleset must be finite, and at least the largest number that an agent may send",
        )?;
        let mut defaults = Magnitudes::default();
        for info in &self.magnitudes {
            require(
                defaults.get(&info.group, &info.name).is_none(),
                "a magnitude occurs twice",
            )?;
            defaults.set(&info.group, &info.name, info.default);
        }
        let mut groups: Vec<&str> = self.magnitudes.iter().map(|info| &*info.group).collect();
        groups.dedup();
        let mut seen = HashSet::new();
        require(
            groups.into_iter().all(|group| seen.insert(group)),
            "the magnitudes of a group do not follow each other",
        )?;
        self.check_magnitudes(&mut defaults)
            .map_err(|error| format!("the default of a magnitude is invalid: {error}"))?;
        require(!self.tasks.is_empty(), "it has no tasks")?;
        let layouts = self.actions.layouts.len();
        require(layouts > 0, "it has no layout of actions")?;
        require(
            self.actions.agents_choose_layout || layouts == 1,
            "agents have to state one of several layouts",
        )?;
        let profiles = [self.ideal_profile, self.counting_profile];
        require(
            profiles.iter().all(|name| self.profile(*name).is_some()),
            "the ideal or the counting profile is none of its profiles",
        )?;
        let limits = &self.recording.limits;
        let all_recorded = self.world_violations().all(|name| limits.contains(&name));
        require(
            all_recorded && limits.len() == self.world_violations().count(),
            "its recordings do not have each limit once",
        )?;
        // In the filter of lists of episodes these words mean a violation of any kind, and late answers.
        let is_reserved = |name: ViolationName| matches!(name.as_str(), "any" | "late");
        require(
            !self.world_violations().any(is_reserved),
            "a kind of violation cannot be called `any` or `late`",
        )
    }

    /// BLAKE3 of what scores depend on, as 64 hexadecimal digits: id, tasks with weights and lengths, violations with points, bounds of
    /// tiers, profiles. Texts are not part of it. Nor are the constants and the defaults of magnitudes, which the name of a ruleset
    /// identifies.
    #[must_use]
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        // Each text is followed by a byte that none contains.
        let mut add = |text: &str| {
            hasher.update(text.as_bytes());
            hasher.update(&[0]);
        };
        add(&self.id);
        for task in &self.tasks {
            add(task.task.as_str());
            add(&task.weight.to_string());
            add(&task.max_steps.to_string());
        }
        for violation in &self.violations {
            add(violation.name.as_str());
            add(&violation.points_text());
        }
        // A text that no bounds have.
        let no_tiers = || "no tiers".to_owned();
        add(&self
            .tiers
            .map_or_else(no_tiers, |bounds| bounds.to_string()));
        for profile in self.profile_names() {
            add(profile.as_str());
        }
        hasher.finalize().to_string()
    }

    /// The ruleset of new evaluations.
    ///
    /// # Panics
    /// If the competition has no ruleset, which [`check`](Self::check) refuses.
    #[must_use]
    pub fn ruleset(&self) -> Ruleset {
        let newest = self.rulesets.last();
        newest.expect("a competition has a ruleset").ruleset
    }

    /// A ruleset of this competition from its name.
    ///
    /// # Errors
    /// If the competition has no such ruleset.
    pub fn find_ruleset(&self, name: &str) -> Result<&RulesetInfo, UnknownRuleset> {
        let known = || self.rulesets.iter();
        let found = known().find(|info| info.ruleset.as_str() == name);
        found.ok_or_else(|| UnknownRuleset::new(name, known().map(|info| info.ruleset)))
    }

    /// The tasks in the order of boards.
    pub fn task_names(&self) -> impl Iterator<Item = Task> + Clone + '_ {
        self.tasks.iter().map(|info| info.task)
    }

    /// The weights of the tasks under a stage's rules.
    #[must_use]
    pub fn weights(&self, variation: &Variation) -> TaskWeights {
        let defaults = || self.tasks.iter().map(|info| (info.task, info.weight));
        match &variation.weights {
            // JSON objects have no order, so the order of a stored map is replaced by that of the tasks.
            Some(weights) => weights
                .in_order(self.task_names())
                .unwrap_or_else(|_| weights.clone()),
            None => TaskWeights::unchecked(defaults().collect()),
        }
    }

    /// The bounds of the tiers under a stage's rules; `None` if the competition has no tiers.
    #[must_use]
    pub fn tier_bounds(&self, variation: &Variation) -> Option<TierBounds> {
        let default = self.tiers?;
        Some(variation.tier_bounds.unwrap_or(default))
    }

    /// These counts, and 0 for all other kinds of violations.
    #[must_use]
    pub fn violation_counts(&self, counts: &[(ViolationName, u32)]) -> ViolationCounts {
        let zeros = self.violations.iter().map(|info| (info.name, 0));
        zeros.chain(counts.iter().copied()).collect()
    }

    /// The kinds of violations that worlds report: all but the computation time, which the platform measures.
    pub fn world_violations(&self) -> impl Iterator<Item = ViolationName> + Clone + '_ {
        let is_of_world = |name: &ViolationName| *name != ViolationName::COMPUTATION_TIME;
        self.violations
            .iter()
            .map(|info| info.name)
            .filter(is_of_world)
    }

    /// The title of a kind of violation; its name if the competition has no such kind.
    #[must_use]
    pub fn violation_title(&self, name: ViolationName) -> String {
        let info = self.violation(name);
        info.map_or_else(|| name.to_string(), |info| info.title.clone())
    }

    /// The description of a kind of violation; `None` if the competition has no such kind.
    #[must_use]
    pub fn violation(&self, name: ViolationName) -> Option<&ViolationInfo> {
        self.violations.iter().find(|info| info.name == name)
    }

    /// Penalty points for the limits that an episode violated, without those for its computation times.
    #[must_use]
    pub fn violation_points(&self, violations: &Violations) -> f64 {
        let points = |name| self.violation(name).map_or(0.0, |info| info.points[1]);
        violations.violated().map(points).sum()
    }

    /// A task of this competition from its name.
    ///
    /// # Errors
    /// If the competition has no such task.
    pub fn find_task(&self, name: &str) -> Result<Task, UnknownTask> {
        let found = self.task_names().find(|task| task.as_str() == name);
        found.ok_or_else(|| UnknownTask::new(name, self.task_names()))
    }

    /// The profiles in the order in which tables list them.
    pub fn profile_names(&self) -> impl Iterator<Item = Profile> + Clone + '_ {
        self.profiles.iter().map(|info| info.profile)
    }

    /// The profiles that an ablation plays, in the order in which tables list them. The ideal one is always among them.
    pub fn ablation_profiles(&self) -> impl Iterator<Item = Profile> + Clone + '_ {
        let is_played =
            |info: &&ProfileInfo| info.is_in_ablations || info.profile == self.ideal_profile;
        self.profiles
            .iter()
            .filter(is_played)
            .map(|info| info.profile)
    }

    /// A profile of this competition from its name.
    ///
    /// # Errors
    /// If the competition has no such profile.
    pub fn find_profile(&self, name: &str) -> Result<Profile, UnknownProfile> {
        let found = self
            .profile_names()
            .find(|profile| profile.as_str() == name);
        found.ok_or_else(|| UnknownProfile::new(name, self.profile_names()))
    }

    /// The description of a profile; `None` if the competition has no such profile.
    #[must_use]
    pub fn profile(&self, profile: Profile) -> Option<&ProfileInfo> {
        self.profiles.iter().find(|info| info.profile == profile)
    }

    /// Brings a map into the order of the competition's profiles. Profiles that the competition does not have come last.
    pub fn sort_profiles<V>(&self, map: &mut ProfileMap<V>) {
        let position = |profile: &Profile| {
            let found = self.profile_names().position(|other| other == *profile);
            found.unwrap_or(usize::MAX)
        };
        map.sort_by(|a, _, b, _| position(a).cmp(&position(b)));
    }

    /// Checks magnitudes, and completes them in the order of files. If all have the competition's defaults, `magnitudes` becomes empty.
    ///
    /// # Errors
    /// The first magnitude that is unknown or out of range.
    pub fn check_magnitudes(&self, magnitudes: &mut Magnitudes) -> Result<(), InvalidMagnitude> {
        magnitudes.complete(&self.magnitudes)
    }

    /// Checks that evaluations are possible under these rules, and brings tasks and weights into the order of the competition.
    /// Weights and bounds of tiers that are those of the competition are left out.
    ///
    /// # Errors
    /// The first invalid field.
    pub fn check_and_normalise_rules(
        &self,
        rules: &mut StageRules,
    ) -> Result<(), InvalidStageRules> {
        rules.check()?;
        self.find_ruleset(rules.ruleset.as_str())?;
        for task in &rules.tasks {
            self.find_task(task.as_str())?;
        }
        self.find_profile(rules.profile.as_str())?;
        self.check_magnitudes(&mut rules.variation.perturbations)?;
        let order = |task: &Task| self.task_names().position(|other| other == *task);
        rules.tasks.sort_by_key(order);
        if let Some(weights) = &rules.variation.weights {
            let weights = weights.in_order(self.task_names())?;
            let is_default = weights == self.weights(&Variation::default());
            rules.variation.weights = (!is_default).then_some(weights);
        }
        if let Some(bounds) = rules.variation.tier_bounds {
            let default = self.tiers.ok_or(InvalidStageRules::NoTiers(bounds))?;
            rules.variation.tier_bounds = (bounds != default).then_some(bounds);
        }
        Ok(())
    }

    /// The rules of a tournament unless organisers choose others.
    #[must_use]
    pub fn tournament_rules(&self) -> TournamentRules {
        TournamentRules::new(self.ruleset(), self.counting_profile)
    }

    /// Checks that games are possible under these rules, and completes their magnitudes.
    ///
    /// # Errors
    /// The first invalid field.
    pub fn check_tournament(&self, rules: &mut TournamentRules) -> Result<(), InvalidTournament> {
        rules.check()?;
        if !self.has_games {
            return Err(InvalidTournament::NoGames);
        }
        self.find_ruleset(rules.ruleset.as_str())?;
        self.find_profile(rules.profile.as_str())?;
        Ok(self.check_magnitudes(&mut rules.perturbations)?)
    }

    /// The tasks of a map in the order of the competition, whatever the order of the map.
    ///
    /// # Errors
    /// If the competition does not have a task of the map.
    pub fn tasks_in_order<V>(&self, map: &TaskMap<V>) -> Result<Vec<Task>, UnknownTask> {
        for task in map.keys() {
            self.find_task(task.as_str())?;
        }
        let is_in_map = |task: &Task| map.contains_key(task);
        Ok(self.task_names().filter(is_in_map).collect())
    }

    /// Control steps of the longest episode of a task; 0 if the competition has no such task.
    #[must_use]
    pub fn max_steps(&self, task: Task) -> u32 {
        self.task(task).map_or(0, |info| info.max_steps)
    }

    /// Duration of these control steps of a task, in seconds.
    #[must_use]
    pub fn duration_s(&self, task: Task, steps: u32) -> f64 {
        let step_s = self.task(task).map_or(0.0, |info| info.control_step_s);
        f64::from(steps) * step_s
    }

    /// Duration of the longest episode of any task, in seconds.
    #[must_use]
    pub fn longest_episode_s(&self) -> f64 {
        let tasks = self.tasks.iter();
        let durations = tasks.map(|info| f64::from(info.max_steps) * info.control_step_s);
        durations.fold(0.0, f64::max)
    }

    /// Control steps of the longest episode.
    #[must_use]
    pub fn longest_episode_steps(&self) -> u32 {
        let steps = self.tasks.iter().map(|info| info.max_steps);
        steps.max().unwrap_or_default()
    }

    /// The description of a task; `None` if the competition has no such task.
    #[must_use]
    pub fn task(&self, task: Task) -> Option<&TaskInfo> {
        self.tasks.iter().find(|info| info.task == task)
    }
}

impl ViolationInfo {
    /// The penalty points as text: `3`, or `0.5 to 2`.
    #[must_use]
    pub fn points_text(&self) -> String {
        let [least, most] = self.points;
        if least == most {
            most.to_string()
        } else {
            format!("{least} to {most}")
        }
    }

    /// Do its penalty points depend on its size, as those of the computation time do?
    #[must_use]
    pub fn has_range(&self) -> bool {
        self.points[0] != self.points[1]
    }

    /// The penalty points with their unit: `1 point`, or `0.5 to 2 points`.
    #[must_use]
    pub fn points_with_unit(&self) -> String {
        let points = self.points_text();
        let unit = if points == "1" { "point" } else { "points" };
        format!("{points} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDEAL: Profile = Profile::new("ideal");

    fn competition(tiers: Option<TierBounds>) -> Competition {
        Competition {
            id: "points".to_owned(),
            title: "Points".to_owned(),
            short_title: "Points".to_owned(),
            subject: "points".to_owned(),
            summary: "A summary.".to_owned(),
            rulesets: vec![RulesetInfo {
                ruleset: Ruleset::new("points-1"),
                action_limit: ACTION_LIMIT,
            }],
            has_replays: false,
            has_games: false,
            tasks: vec![TaskInfo {
                task: Task::new("reach"),
                title: "Reach".to_owned(),
                aim: "Reach the target.".to_owned(),
                achievement: "success".to_owned(),
                drawing: String::new(),
                weight: Millionths::new(1_000_000),
                max_steps: 100,
                control_step_s: 0.1,
            }],
            ends: Vec::new(),
            violations: Vec::new(),
            tiers,
            profiles: vec![ProfileInfo {
                profile: IDEAL,
                title: "ideal".to_owned(),
                description: "No perturbations.".to_owned(),
                letter: 'I',
                is_in_ablations: true,
            }],
            ideal_profile: IDEAL,
            counting_profile: IDEAL,
            magnitudes: Vec::new(),
            actions: ActionSpace {
                agents_choose_layout: false,
                layouts: Vec::new(),
            },
            recording: RecordingColumns::default(),
        }
    }

    /// Stage rules with the tier bounds `bounds`, after their check by a competition whose own bounds are `tiers`.
    fn checked(tiers: Option<&str>, bounds: Option<&str>) -> Result<StageRules, InvalidStageRules> {
        let parsed = |text: &str| text.parse().unwrap();
        let mut rules = StageRules {
            runtimes: None,
            ruleset: Ruleset::new("points-1"),
            profile: IDEAL,
            tasks: vec![Task::new("reach")],
            episodes_per_task: 1,
            max_faults: 0,
            variation: Variation {
                tier_bounds: bounds.map(parsed),
                ..Variation::default()
            },
            limits: Default::default(),
        };
        let competition = competition(tiers.map(parsed));
        competition
            .check_and_normalise_rules(&mut rules)
            .map(|()| rules)
    }

    #[test]
    fn competition_without_tiers_refuses_tier_bounds() {
        assert_eq!(checked(None, None).unwrap().variation.tier_bounds, None);
        let refused = checked(None, Some("0.1,0.2")).unwrap_err();
        assert_eq!(refused.field(), "tier_bounds");
        assert_eq!(
            refused.to_string(),
            "tier_bounds: the competition has no tiers, got the bounds 0.1,0.2; leave them out"
        );
        let variation = Variation {
            tier_bounds: Some("0.1,0.2".parse().unwrap()),
            ..Variation::default()
        };
        assert_eq!(competition(None).tier_bounds(&variation), None);
    }

    #[test]
    fn tier_bounds_of_the_competition_are_left_out() {
        let own = Some("0.5,1.5");
        assert_eq!(checked(own, own).unwrap().variation.tier_bounds, None);
        let other = checked(own, Some("0.1,0.2")).unwrap().variation;
        assert_eq!(other.tier_bounds, Some("0.1,0.2".parse().unwrap()));
        let competition = competition(own.map(|text| text.parse().unwrap()));
        assert_eq!(competition.tier_bounds(&other), other.tier_bounds);
        let unchanged = competition.tier_bounds(&Variation::default());
        assert_eq!(unchanged, competition.tiers);
    }

    #[test]
    fn unknown_ruleset_error_lists_all_known_names() {
        let mut competition = competition(None);
        competition.rulesets.push(RulesetInfo {
            ruleset: Ruleset::new("points-1.1"),
            action_limit: f64::MAX,
        });
        assert_eq!(competition.ruleset().as_str(), "points-1.1");
        let first = competition.find_ruleset("points-1").unwrap();
        assert_eq!(first.action_limit, ACTION_LIMIT);
        assert_eq!(
            competition
                .find_ruleset("points-2")
                .unwrap_err()
                .to_string(),
            "unknown ruleset \"points-2\": this version knows points-1, points-1.1"
        );
    }

    #[test]
    fn hash_covers_tiers() {
        let hash =
            |tiers: Option<&str>| competition(tiers.map(|text| text.parse().unwrap())).hash();
        assert_ne!(hash(None), hash(Some("0.5,1.5")));
        assert_ne!(hash(Some("0.1,1.5")), hash(Some("0.5,1.5")));
    }
}

//! A competition: what the platform has to know of it in order to run and to show it.

use crate::{Millionths, Task};

/// The description of a competition. Boards, tables, forms and files take their tasks and violations from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Competition {
    /// Letters, digits and dashes. It tells competitions apart.
    pub id: String,
    /// Its name for people.
    pub title: String,
    /// In the order of boards.
    pub tasks: Vec<TaskInfo>,
    /// Kinds of violations of the agent's limits, in the order of tables.
    pub violations: Vec<ViolationInfo>,
}

/// A task of a competition.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskInfo {
    /// Its name in files, in the API and on the command line.
    pub task: Task,
    /// The heading of its board and of its columns.
    pub title: String,
    /// What the agent has to achieve, as a sentence.
    pub aim: String,
    /// Share of its success rate in the overall score, unless a stage has other weights. The shares sum to 1.
    pub weight: Millionths,
    /// Control steps of the longest episode.
    pub max_steps: u32,
}

/// A kind of violation.
#[derive(Debug, Clone, PartialEq)]
pub struct ViolationInfo {
    /// Its name in files and queries.
    pub name: String,
    /// Its name in lists, such as "end effector".
    pub title: String,
    /// What has happened, such as "end effector out of bounds".
    pub breach: String,
    /// The least and the most penalty points for it in one episode.
    pub points: [f64; 2],
}

impl Competition {
    /// BLAKE3 of what scores depend on, as 64 hexadecimal digits: id, tasks with weights and lengths, violations with points. Texts
    /// are not part of it.
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
            add(&violation.name);
            add(&violation.points_text());
        }
        hasher.finalize().to_string()
    }

    /// The tasks in the order of boards.
    pub fn task_names(&self) -> impl Iterator<Item = Task> + Clone + '_ {
        self.tasks.iter().map(|info| info.task)
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
}

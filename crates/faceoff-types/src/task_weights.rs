//! Weights of the tasks' success rates in the overall score.

use crate::{Millionths, Task, TaskMap, millionths::NotMillionths};
use serde::{
    Deserialize, Serialize,
    de::{Deserializer, Error as _, MapAccess, Visitor},
};
use std::fmt::{self, Write as _};

/// Weights of the tasks' success rates in the overall score: fractions that sum to 1. Their text is the numbers with commas
/// between them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct TaskWeights(TaskMap<Millionths>);

/// Invalid weights of tasks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidWeights {
    #[error("expected weights that sum to 1, got {0}")]
    Sum(String),
    /// Not one weight for each task.
    #[error("expected a weight for each of {expected}, got {got}")]
    Tasks {
        /// Names of tasks.
        expected: String,
        /// Names of tasks.
        got: String,
    },
    /// Too many or too few numbers, or text that is not a number.
    #[error(
        "expected {tasks} numbers with commas between them, one for each of {names}, got {got:?}"
    )]
    Count {
        tasks: usize,
        /// Names of the tasks.
        names: String,
        /// The text as it was given.
        got: String,
    },
    #[error(transparent)]
    Number(#[from] NotMillionths),
}

const MILLIONTHS_PER_ONE: u64 = 1_000_000;

impl TaskWeights {
    /// From the weight of each task.
    ///
    /// # Errors
    /// If they do not sum to 1.
    pub fn new(weights: TaskMap<Millionths>) -> Result<Self, InvalidWeights> {
        let sum: u64 = weights
            .values()
            .map(|weight| u64::from(weight.count()))
            .sum();
        if sum == MILLIONTHS_PER_ONE {
            return Ok(Self(weights));
        }
        let got = weights
            .iter()
            .map(|(task, weight)| format!("{weight} ({task})"));
        Err(InvalidWeights::Sum(listed(got, "and")))
    }

    /// Weights whose sum the caller knows to be 1, so that it is not checked.
    pub(crate) const fn unchecked(weights: TaskMap<Millionths>) -> Self {
        Self(weights)
    }

    /// All weight on one task.
    #[must_use]
    pub fn of(task: Task) -> Self {
        Self([(task, Millionths::ONE)].into())
    }

    /// From numbers with commas between them, such as `0.4,0.4,0.2`, in the order of the tasks.
    ///
    /// # Errors
    /// If there is not a number for each task, or they do not sum to 1.
    pub fn parse(text: &str, tasks: impl Iterator<Item = Task>) -> Result<Self, InvalidWeights> {
        let tasks: Vec<Task> = tasks.collect();
        let numbers = text.split(',').map(|part| part.trim().parse::<f64>());
        let numbers: Option<Vec<f64>> = numbers.collect::<Result<_, _>>().ok();
        let Some(numbers) = numbers.filter(|numbers| numbers.len() == tasks.len()) else {
            return Err(InvalidWeights::Count {
                tasks: tasks.len(),
                names: listed(tasks.iter(), "and"),
                got: text.to_owned(),
            });
        };
        let weights = tasks.into_iter().zip(numbers);
        let weights = weights.map(|(task, number)| Ok((task, Millionths::try_from(number)?)));
        Self::new(weights.collect::<Result<_, NotMillionths>>()?)
    }

    /// The tasks in their order.
    pub fn tasks(&self) -> impl Iterator<Item = Task> + Clone + '_ {
        self.0.keys().copied()
    }

    /// The weight of a task; 0 if it has none.
    #[must_use]
    pub fn weight(&self, task: Task) -> Millionths {
        self.0.get(&task).copied().unwrap_or(Millionths::new(0))
    }

    /// The same weights in the order of `tasks`.
    ///
    /// # Errors
    /// If there is not a weight for each of `tasks`, and for no other.
    pub fn in_order(
        &self,
        tasks: impl Iterator<Item = Task> + Clone,
    ) -> Result<Self, InvalidWeights> {
        let sorted: TaskMap<Millionths> = tasks
            .clone()
            .filter_map(|task| Some((task, *self.0.get(&task)?)))
            .collect();
        let expected: Vec<Task> = tasks.collect();
        if sorted.len() == expected.len() && sorted.len() == self.0.len() {
            Ok(Self(sorted))
        } else {
            Err(InvalidWeights::Tasks {
                expected: listed(expected.iter(), "and"),
                got: listed(self.0.keys(), "and"),
            })
        }
    }
}

impl<'de> Deserialize<'de> for TaskWeights {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Weights;
        impl<'de> Visitor<'de> for Weights {
            type Value = TaskWeights;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the weight of each task")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<TaskWeights, A::Error> {
                let mut weights = TaskMap::new();
                while let Some((task, weight)) = map.next_entry::<Task, Millionths>()? {
                    if weights.insert(task, weight).is_some() {
                        return Err(A::Error::custom(format_args!("{task} occurs twice")));
                    }
                }
                TaskWeights::new(weights).map_err(A::Error::custom)
            }
        }
        deserializer.deserialize_map(Weights)
    }
}

impl fmt::Display for TaskWeights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, weight) in self.0.values().enumerate() {
            if index > 0 {
                f.write_char(',')?;
            }
            weight.fmt(f)?;
        }
        Ok(())
    }
}

/// A list in words: `a, b and c`.
pub(crate) fn listed(items: impl IntoIterator<Item = impl ToString>, conjunction: &str) -> String {
    let items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    match &items[..] {
        [] => "none".to_owned(),
        [only] => only.clone(),
        [rest @ .., last] => format!("{} {conjunction} {last}", rest.join(", ")),
    }
}

#[cfg(feature = "openapi")]
mod schema {
    use super::TaskWeights;
    use utoipa::{
        PartialSchema, ToSchema,
        openapi::{ObjectBuilder, RefOr, Schema, Type},
    };

    impl PartialSchema for TaskWeights {
        fn schema() -> RefOr<Schema> {
            let weight = ObjectBuilder::new()
                .schema_type(Type::Number)
                .description(Some("From 0 to 1, with at most six decimals"))
                .minimum(Some(0.0))
                .maximum(Some(1.0));
            ObjectBuilder::new()
                .schema_type(Type::Object)
                .additional_properties(Some(weight))
                .into()
        }
    }

    impl ToSchema for TaskWeights {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tasks() -> impl Iterator<Item = Task> + Clone {
        ["push", "catch", "rest"].map(Task::new).into_iter()
    }

    #[test]
    fn weights_are_numbers_in_the_order_of_tasks() {
        let weights = TaskWeights::parse("0.4, 0.4,0.2", tasks()).unwrap();
        assert_eq!(weights.weight(Task::new("rest")), Millionths::new(200_000));
        assert_eq!(weights.weight(Task::new("jump")), Millionths::new(0));
        assert_eq!(weights.to_string(), "0.4,0.4,0.2");
        let text = r#"{"push":0.4,"catch":0.4,"rest":0.2}"#;
        assert_eq!(serde_json::to_string(&weights).unwrap(), text);
        let reversed = r#"{"rest":0.2,"catch":0.4,"push":0.4}"#;
        let read: TaskWeights = serde_json::from_str(reversed).unwrap();
        assert_eq!(read.to_string(), "0.2,0.4,0.4");
        assert_eq!(read.in_order(tasks()).unwrap().to_string(), "0.4,0.4,0.2");
    }

    #[test]
    fn weights_sum_to_one() {
        for (wrong, words) in [
            (
                "0.4,0.4,0.3",
                "sum to 1, got 0.4 (push), 0.4 (catch) and 0.3 (rest)",
            ),
            ("1,1,-1", "at most six decimals"),
            ("0.33333333,0.33333333,0.33333334", "at most six decimals"),
            ("0.5,0.5", "3 numbers"),
            ("a,b,c", "one for each of push, catch and rest"),
        ] {
            let error = TaskWeights::parse(wrong, tasks()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn repeated_task_is_refused() {
        let twice = r#"{"push":0.4,"catch":0.5,"push":0.5}"#;
        let error = serde_json::from_str::<TaskWeights>(twice)
            .unwrap_err()
            .to_string();
        assert!(error.contains("push occurs twice"), "{error}");
    }

    #[test]
    fn each_task_of_the_competition_has_a_weight() {
        for wrong in [
            r#"{"push":0.5,"catch":0.5}"#,
            r#"{"push":0.5,"catch":0.3,"rest":0.1,"jump":0.1}"#,
            r#"{"push":0.5,"catch":0.3,"jump":0.2}"#,
        ] {
            let weights: TaskWeights = serde_json::from_str(wrong).unwrap();
            let error = weights.in_order(tasks()).unwrap_err().to_string();
            assert!(error.contains("push, catch and rest"), "{error}");
        }
    }
}

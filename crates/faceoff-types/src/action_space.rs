//! The actions of agents: nested arrays of numbers, in one of the layouts of the competition.

use std::fmt;

/// Dimensions of the deepest action.
const MAX_DIMENSIONS: usize = 4;

/// The actions that a competition takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ActionSpace {
    /// Does each agent choose a layout, by sending its code as `interpolation` in `ready`? If not, all have the first.
    pub agents_choose_layout: bool,
    /// At least one.
    pub layouts: Vec<ActionLayout>,
}

/// A layout of actions: its code, and the lengths of the nested arrays. In air hockey it follows from the *interpolation* that an agent
/// chooses: how the numbers of an action become a trajectory.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ActionLayout {
    /// The code by which agents choose it: a number, or `null`.
    code: Option<i64>,
    lengths: [usize; MAX_DIMENSIONS],
    dimensions: usize,
}

impl ActionLayout {
    /// A layout from its code and the lengths of its nested arrays, outermost first.
    ///
    /// # Panics
    /// If there are no lengths, or more than four.
    #[must_use]
    pub const fn new(code: Option<i64>, shape: &[usize]) -> Self {
        assert!(
            !shape.is_empty() && shape.len() <= MAX_DIMENSIONS,
            "an action has one to four dimensions"
        );
        let mut lengths = [0; MAX_DIMENSIONS];
        let mut index = 0;
        while index < shape.len() {
            lengths[index] = shape[index];
            index += 1;
        }
        Self {
            code,
            lengths,
            dimensions: shape.len(),
        }
    }

    /// The code by which agents state it; `None` is the protocol's null.
    #[must_use]
    pub const fn code(self) -> Option<i64> {
        self.code
    }

    /// Lengths of an action's nested arrays, outermost first.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.lengths[..self.dimensions]
    }

    /// Numbers in an action: the product of its shape.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "an action is never empty")]
    pub fn len(&self) -> usize {
        self.shape().iter().product()
    }
}

/// The code: a number, or `null`.
impl fmt::Display for ActionLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.code {
            Some(code) => code.fmt(f),
            None => f.write_str("null"),
        }
    }
}

impl fmt::Debug for ActionLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}, {:?}", self.shape())
    }
}

impl ActionSpace {
    /// The layout of all agents; `None` if each agent chooses its layout.
    #[must_use]
    pub fn only_layout(&self) -> Option<ActionLayout> {
        let first = || self.layouts.first().copied();
        if self.agents_choose_layout {
            None
        } else {
            first()
        }
    }

    /// The codes of all layouts.
    pub fn codes(&self) -> impl Iterator<Item = Option<i64>> + '_ {
        self.layouts.iter().map(|layout| layout.code)
    }

    /// The layout with a code.
    #[must_use]
    pub fn find(&self, code: Option<i64>) -> Option<ActionLayout> {
        self.layouts
            .iter()
            .copied()
            .find(|layout| layout.code == code)
    }

    /// The layout whose code has this text, as recordings have it.
    #[must_use]
    pub fn parse(&self, text: &str) -> Option<ActionLayout> {
        match text {
            "null" => self.find(None),
            number => self.find(Some(number.parse().ok()?)),
        }
    }

    /// The codes for error messages: `1, 2, 3 or null`.
    #[must_use]
    pub fn codes_text(&self) -> String {
        let codes: Vec<String> = self.layouts.iter().map(ToString::to_string).collect();
        match codes.split_last() {
            Some((last, others)) if !others.is_empty() => {
                format!("{} or {last}", others.join(", "))
            }
            Some((last, _)) => last.clone(),
            None => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_found_by_code_and_by_text() {
        let several_layouts = ActionSpace {
            agents_choose_layout: true,
            layouts: vec![
                ActionLayout::new(Some(1), &[2]),
                ActionLayout::new(Some(-1), &[3, 2]),
                ActionLayout::new(None, &[4, 3, 2]),
            ],
        };
        assert_eq!(several_layouts.codes_text(), "1, -1 or null");
        assert_eq!(several_layouts.only_layout(), None);
        for (text, len) in [("1", 2), ("-1", 6), ("null", 24)] {
            let layout = several_layouts.parse(text).unwrap();
            assert_eq!((layout.len(), layout.to_string().as_str()), (len, text));
            assert_eq!(several_layouts.find(layout.code()), Some(layout));
        }
        for unknown in ["2", "", "NaN"] {
            assert_eq!(several_layouts.parse(unknown), None);
        }
        let single = ActionSpace {
            agents_choose_layout: false,
            layouts: vec![ActionLayout::new(None, &[1])],
        };
        assert_eq!(single.only_layout().unwrap().shape(), [1]);
    }
}

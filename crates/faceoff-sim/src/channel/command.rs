//! The command that a robot receives for a control step: its agent's answer, or the lack of one.

/// An agent's answer for a control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command<'a> {
    /// An action: one number per joint in each row, row-major, of length [`Interpolation::len`], finite.
    ///
    /// [`Interpolation::len`]: crate::Interpolation::len
    Act(&'a [f64]),
    /// No answer arrived in time. The arm is commanded to hold its previous commanded position, with zero velocity. With
    /// [`Perturbation::Delay`] it instead continues its last trajectory at constant velocity for 80 ms, then stops.
    ///
    /// [`Perturbation::Delay`]: crate::Perturbation::Delay
    Late,
}

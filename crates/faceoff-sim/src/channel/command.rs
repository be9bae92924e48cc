/// An agent's answer for a control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command<'a> {
    /// An action: row-major, of length [`Interpolation::len`], finite.
    ///
    /// [`Interpolation::len`]: faceoff_types::Interpolation::len
    Act(&'a [f64]),
    /// No answer arrived in time. The previous position is commanded again, with zero velocity. Under
    /// [`Factor::Delay`] the last trajectory continues at constant velocity for 80 ms, then stops.
    ///
    /// [`Factor::Delay`]: faceoff_types::Factor::Delay
    Late,
}

//! Drawings of the tasks for visitors: the table from above, with the agent on the left. They are elements of an SVG drawing of
//! 120 × 64 units, with the classes of [`TaskInfo::drawing`](faceoff_types::TaskInfo::drawing).

/// Rim, middle line and goals.
macro_rules! table {
    () => {
        "<rect class=\"ground\" x=\"4\" y=\"5\" width=\"112\" height=\"54\" rx=\"5\"/><path class=\"ground\" d=\"M60 5V59\"/>\
         <path class=\"ground goal\" d=\"M4 24V40M116 24V40\"/>"
    };
}

/// The mallet drives the puck past the goalkeeper.
pub(crate) const HIT: &str = concat!(
    table!(),
    "<circle class=\"other\" cx=\"106\" cy=\"40\" r=\"6\"/><path class=\"path\" d=\"M43 38L106 29\"/>\
     <path class=\"arrow\" d=\"M112 28L103.500 25.500L104.500 33Z\"/><circle class=\"object\" cx=\"43\" cy=\"38\" r=\"4\"/>\
     <circle class=\"agent\" cx=\"31\" cy=\"40\" r=\"6\"/>"
);

/// The mallet stops a puck that comes towards the agent's goal.
pub(crate) const DEFEND: &str = concat!(
    table!(),
    "<path class=\"path\" d=\"M102 14L38 33\"/><path class=\"arrow\" d=\"M30.500 35L39.500 36.500L37.500 28.500Z\"/>\
     <circle class=\"object\" cx=\"102\" cy=\"14\" r=\"4\"/><circle class=\"agent\" cx=\"21\" cy=\"36\" r=\"6\"/>"
);

/// The mallet moves a puck from the rim to the middle of the agent's side.
pub(crate) const PREPARE: &str = concat!(
    table!(),
    "<path class=\"path\" d=\"M48 53Q50 43 42 35\"/><path class=\"arrow\" d=\"M38.500 31L38 39.500L45 35Z\"/>\
     <circle class=\"object\" cx=\"48\" cy=\"53\" r=\"4\"/><circle class=\"other\" cx=\"36\" cy=\"28\" r=\"4\"/>\
     <circle class=\"agent\" cx=\"58\" cy=\"51\" r=\"6\"/>"
);

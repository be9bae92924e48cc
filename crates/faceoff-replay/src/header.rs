//! The header of a clip (the recording of an episode or a part of a game for replays): JSON with everything but the columns'
//! numbers. A *sample* is the state after a control step.

use crate::constraint::Constraint;
use faceoff_sim::model::CONTROL_STEP_S;
use faceoff_types::EpisodeEnd;
use serde::{Deserialize, Serialize};

/// Name and version of a clip's layout. Readers ignore unknown fields; a change of meaning is a new version.
pub(crate) const CLIP_FORMAT: &str = "faceoff-clip/1";

/// The kinds of clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClipKind {
    /// The public motion of puck and robots.
    Motion,
    /// A side's observations, commands and computation times.
    Observed,
}

/// A clip's header, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// `faceoff-clip/1`.
    pub format: String,
    pub kind: ClipKind,
    /// The episode's task (`hit`, `defend`, `prepare`), or `game`.
    pub contest: String,
    /// Index of the episode within the evaluation; absent in games.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episode: Option<u32>,
    /// The side of the observations and commands, 0 or 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<u32>,
    /// Index of the clip's first sample; sample k is the state after k control steps.
    pub first: u32,
    /// Number of samples.
    pub samples: u32,
    /// Length of a control step, s.
    pub step_s: f64,
    /// The columns, in the order of the payload.
    pub columns: Vec<ColumnHeader>,
    /// Contacts of the puck, in order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<Contact>,
    /// Violations of constraints, in the order of their first sample.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub violations: Vec<ViolationSpan>,
    /// Ends of rallies of a game.
    #[serde(default, rename = "breaks", skip_serializing_if = "Vec::is_empty")]
    pub rally_ends: Vec<RallyEndEvent>,
    /// In games: the score at the first sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub score: Option<[u32; 2]>,
    /// Samples whose answer took longer than a control step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub late: Vec<u32>,
    /// Spans in which the simulated tracking had lost the puck.
    #[serde(default, rename = "lost", skip_serializing_if = "Vec::is_empty")]
    pub tracking_gaps: Vec<TrackingGap>,
    /// How an episode ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<EpisodeEndSummary>,
}

impl Header {
    /// The header of a clip of the true motion, so far without columns and events.
    pub(crate) fn new(contest: &str, first: u32, samples: u32) -> Self {
        Self {
            format: CLIP_FORMAT.to_owned(),
            kind: ClipKind::Motion,
            contest: contest.to_owned(),
            episode: None,
            side: None,
            first,
            samples,
            step_s: CONTROL_STEP_S,
            columns: Vec::new(),
            contacts: Vec::new(),
            violations: Vec::new(),
            rally_ends: Vec::new(),
            score: None,
            late: Vec::new(),
            tracking_gaps: Vec::new(),
            end: None,
        }
    }
}

/// The header of a column, with the fields of [`crate::Column`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColumnHeader {
    pub name: String,
    pub unit: String,
    /// The value of one count.
    pub scale: f64,
    /// Order of the differences.
    pub order: u8,
    /// The sample of the first value, from 0 at the clip's start.
    #[serde(default)]
    pub first: u32,
    pub count: u32,
    /// Length in the payload, in bytes.
    pub bytes: u32,
}

/// The start of a contact of the puck.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Time since sample 0 of the episode or game, s.
    pub t: f64,
    #[serde(rename = "what")]
    pub body: ContactWith,
    /// True x of the puck at that time, m, table frame.
    pub x: f64,
    /// True y of the puck at that time, m, table frame.
    pub y: f64,
}

/// The body that the puck touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactWith {
    /// A rim of the table.
    Rim,
    /// The mallet of the first robot: in an episode the agent's own, in a game that of the first side.
    Mallet,
    /// The mallet of the second robot.
    OpponentMallet,
}

/// A violation of a constraint over some samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViolationSpan {
    /// The side, 0 or 1.
    pub side: u32,
    #[serde(rename = "group")]
    pub constraint: Constraint,
    /// The first sample of the violation.
    pub from: u32,
    /// The last sample of the violation.
    pub to: u32,
    /// Largest excess over the limit: rad, rad/s or m.
    #[serde(rename = "worst")]
    pub max_excess: f64,
}

/// The end of a rally; the next sample is the first of the next rally.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RallyEndEvent {
    /// The rally's last sample.
    pub sample: u32,
    #[serde(rename = "what")]
    pub kind: RallyEndKind,
    /// The side that scored or committed the foul, 0 or 1.
    pub by: Option<u32>,
    /// The score after the rally.
    pub score: [u32; 2],
}

/// Why a rally ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RallyEndKind {
    Goal,
    Foul,
    /// The puck lay out of reach.
    Stuck,
    /// The puck left the table beside the goals.
    LeftTable,
    /// The commands of a side made the simulated world diverge.
    Diverged,
    /// The game is over.
    GameOver,
}

/// A span in which the simulated tracking had lost the puck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackingGap {
    /// The first sample of the span.
    pub from: u32,
    /// The last sample of the span.
    pub to: u32,
}

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeEndSummary {
    pub end: EpisodeEnd,
    pub success: bool,
    /// Description of the end, for readers.
    #[serde(rename = "why")]
    pub description: String,
    /// Control steps played.
    pub steps: u32,
}

//! The layout of a dataset: which files and columns it has, and how they are written. The manifest of each dataset names it.

use faceoff_wire::dataset::DATASET_SCHEMA;

/// The layouts that this version reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Sealed by a hash in the archive's comment. Its tables split integers by bytes and have no page index. Mean
    /// computation times were summed in ascending order.
    Two,
    /// Host interference (time that other programs on the evaluator's machine took) is not recorded separately from an
    /// answer's time. Mean computation times are summed in order of play, as in all later layouts.
    Three,
    /// The layout that this version writes.
    Four,
}

impl Layout {
    const ALL: [Self; 3] = [Self::Two, Self::Three, Self::Four];

    /// The layout's name in manifests.
    #[must_use]
    pub const fn schema(self) -> &'static str {
        match self {
            Self::Two => "faceoff-dataset/2",
            Self::Three => "faceoff-dataset/3",
            Self::Four => DATASET_SCHEMA,
        }
    }

    pub(super) fn from_schema(schema: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|layout| layout.schema() == schema)
    }

    pub(super) fn schema_list() -> String {
        Self::ALL.map(Self::schema).join(", ")
    }
}

//! Profiles: named sets of perturbations, that is, of deliberate differences between the evaluator's simulator and the one that teams have.

use crate::short_name::short_name;
use indexmap::IndexMap;

/// Values by profile, in the order of the competition's profiles.
pub type ProfileMap<V> = IndexMap<Profile, V>;

short_name! {
    /// The name of a profile, a set of perturbations. [`Competition`](crate::Competition) defines which profiles exist, and their order.
    Profile, "a profile"
}

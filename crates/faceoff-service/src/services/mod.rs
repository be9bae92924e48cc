//! Operations that the API and the pages share.

pub mod bundle_stream;
pub mod decisions;
pub mod tournament_rounds;
pub mod entrants;
pub mod submissions;
pub mod invitations;
pub mod accounts;
pub mod tokens;
pub mod users;
pub mod registrations;
pub mod rulings;
pub mod stage_results;
pub mod sessions;
pub mod stages;
pub mod teams;
pub mod announcements;
pub mod evaluations;
pub mod uploads;
pub mod workers;

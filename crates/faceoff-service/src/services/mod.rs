//! Operations that the API and the pages share, one file per resource: each checks its input, changes the store, and logs the
//! change.

pub mod accounts;
pub mod announcements;
pub mod bundle_stream;
pub mod clock_step;
pub mod decision_preview;
pub mod departures;
pub mod entrants;
pub mod evaluations;
pub mod games;
pub mod invitations;
pub mod organiser_decisions;
pub mod partial_uploads;
pub mod registrations;
pub mod sessions;
pub mod stage_results;
pub mod stages;
pub mod submissions;
pub mod teams;
pub mod tokens;
pub mod tournament_rounds;
pub mod tournaments;
mod upload_limits;
pub mod uploads;
pub mod users;
pub mod workers;

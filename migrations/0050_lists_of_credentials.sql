-- Lists of tokens and invitations are read a page at a time, the newest first, without reading other rows.
CREATE INDEX tokens_by_age ON tokens (created_at, id);
CREATE INDEX tokens_of_team_by_age ON tokens (team_id, created_at, id) WHERE team_id IS NOT NULL;
CREATE INDEX tokens_of_person_by_age ON tokens (person_id, created_at, id) WHERE person_id IS NOT NULL;
CREATE INDEX tokens_valid_of_owner ON tokens (owner, team_id, person_id) WHERE revoked_at IS NULL;
CREATE INDEX tokens_not_revoked ON tokens (created_at) WHERE revoked_at IS NULL;
CREATE INDEX tokens_of_host ON tokens (created_at) WHERE owner = 'host';
CREATE INDEX invitations_by_age ON invitations (created_at, id);
CREATE INDEX invitations_of_team_by_age ON invitations (team_id, created_at, id) WHERE team_id IS NOT NULL;

-- What has ended is forgotten after a while, except accepted invitations: they say who invited whom.
CREATE INDEX tokens_by_end ON tokens (coalesce(revoked_at, expires_at));
CREATE INDEX invitations_by_end ON invitations (coalesce(revoked_at, expires_at)) WHERE accepted_at IS NULL;

-- Bundles whose files exist.
CREATE INDEX bundles_stored ON submissions (bundle_key) WHERE bundle_gone = 0;

-- The logs of a team's invalid submissions, the newest of which are kept.
CREATE INDEX submissions_invalid_with_log ON submissions (team_id, created_at, id) WHERE state = 'invalid' AND log <> '';

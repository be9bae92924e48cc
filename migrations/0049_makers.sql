-- Who made a credential, or gave it its current secret, and with which token. It ends with that user's account, and when the user gets a
-- new password or new access. Without a user: the host, a team's token or the server.
ALTER TABLE tokens ADD COLUMN made_by TEXT REFERENCES people (id);
ALTER TABLE tokens ADD COLUMN made_with TEXT;
ALTER TABLE invitations ADD COLUMN made_by TEXT REFERENCES people (id);
ALTER TABLE invitations ADD COLUMN made_with TEXT;
ALTER TABLE webhooks ADD COLUMN made_by TEXT REFERENCES people (id);
ALTER TABLE webhooks ADD COLUMN made_with TEXT;

CREATE INDEX tokens_made_by ON tokens (made_by) WHERE made_by IS NOT NULL;
CREATE INDEX tokens_made_with ON tokens (made_with) WHERE made_with IS NOT NULL;
CREATE INDEX invitations_made_by ON invitations (made_by) WHERE made_by IS NOT NULL;
CREATE INDEX invitations_made_with ON invitations (made_with) WHERE made_with IS NOT NULL;
CREATE INDEX invitations_of_person ON invitations (person_id) WHERE person_id IS NOT NULL;

-- The log knows who made those of earlier versions. Of the columns beside MAX(id), SQLite takes those of the row with the maximum.
UPDATE tokens SET made_by = substr(made.actor, 8)
FROM (
    SELECT json_extract(payload, '$.token') AS token, actor, MAX(id)
    -- a team's token that renews itself stays what its maker has made
    FROM events WHERE kind IN ('token_created', 'token_rotated') AND actor NOT LIKE 'team:%' GROUP BY 1
) made
WHERE made.token = tokens.id AND substr(made.actor, 8) IN (SELECT id FROM people) AND made.actor LIKE 'person:%';

UPDATE invitations SET made_by = substr(made.actor, 8)
FROM (
    SELECT json_extract(payload, '$.invitation') AS invitation, actor, MAX(id)
    FROM events WHERE kind = 'invited' GROUP BY 1
) made
WHERE made.invitation = invitations.id AND substr(made.actor, 8) IN (SELECT id FROM people) AND made.actor LIKE 'person:%';

UPDATE webhooks SET made_by = substr(made.actor, 8)
FROM (
    SELECT json_extract(payload, '$.webhook') AS webhook, actor, MAX(id)
    -- whether a change was one of the address is not in the log
    FROM events WHERE kind = 'webhook_created' GROUP BY 1
) made
WHERE made.webhook = webhooks.id AND substr(made.actor, 8) IN (SELECT id FROM people) AND made.actor LIKE 'person:%';

-- The first token of a user comes with the invitation, and sessions with a password.
UPDATE tokens SET made_by = person_id WHERE made_by IS NULL AND person_id IS NOT NULL;

-- Links with which a user gets access again are valid for a day, and only the newest one.
UPDATE invitations SET expires_at = min(expires_at, created_at + 24 * 3600 * 1000) WHERE role = 'return';
UPDATE invitations SET expires_at = min(expires_at, created_at + 1)
WHERE role = 'return' AND EXISTS (
    SELECT 1 FROM invitations newer
    WHERE newer.person_id = invitations.person_id AND newer.role = 'return' AND newer.created_at > invitations.created_at
);

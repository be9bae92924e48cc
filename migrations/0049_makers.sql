-- Who made a credential, or gave it its current secret, and with which token. It ends when that person's account is closed. Without a
-- person: the host, a team's token, a visitor or the server.
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
    FROM events WHERE kind IN ('token_created', 'token_rotated') GROUP BY 1
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
    FROM events WHERE kind IN ('webhook_created', 'webhook_changed', 'webhook_rotated') GROUP BY 1
) made
WHERE made.webhook = webhooks.id AND substr(made.actor, 8) IN (SELECT id FROM people) AND made.actor LIKE 'person:%';

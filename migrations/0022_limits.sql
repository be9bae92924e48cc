-- What agents are held to, where that is not the server's configuration: JSON.
ALTER TABLE runs ADD COLUMN limits TEXT;

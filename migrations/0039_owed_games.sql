-- What is still owed of a tournament's rounds is asked at each end of a game, and by whatever waits for a round's end.
CREATE INDEX games_without_result ON games (tournament_id, round, meeting) WHERE purpose = 'round' AND state <> 'played';

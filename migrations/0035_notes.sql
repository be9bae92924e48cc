-- What a team writes about one of its submissions, for itself and the organiser.
ALTER TABLE submissions ADD COLUMN note TEXT;

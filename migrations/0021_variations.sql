-- Weights, bounds of the tiers and magnitudes of the perturbations, where they are not the ruleset's: JSON.
ALTER TABLE runs ADD COLUMN variation TEXT;

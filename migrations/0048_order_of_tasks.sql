-- Tasks of runs and of stages' rules are in the order hit, defend, prepare. Earlier versions stored them as an organiser had given
-- them, and sorted them when shards were made.

UPDATE runs SET tasks = (
    SELECT json_group_array(value ORDER BY CASE value WHEN 'hit' THEN 0 WHEN 'defend' THEN 1 ELSE 2 END)
    FROM json_each(runs.tasks)
)
WHERE tasks NOT IN (
    '["hit"]', '["defend"]', '["prepare"]', '["hit","defend"]', '["hit","prepare"]', '["defend","prepare"]',
    '["hit","defend","prepare"]'
);

UPDATE stage_revisions SET rules = json_set(rules, '$.tasks', json((
    SELECT json_group_array(value ORDER BY CASE value WHEN 'hit' THEN 0 WHEN 'defend' THEN 1 ELSE 2 END)
    FROM json_each(stage_revisions.rules, '$.tasks')
)))
WHERE json_extract(rules, '$.tasks') NOT IN (
    '["hit"]', '["defend"]', '["prepare"]', '["hit","defend"]', '["hit","prepare"]', '["defend","prepare"]',
    '["hit","defend","prepare"]'
);

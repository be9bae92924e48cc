-- Holds the pose in which an episode starts. It needs the module cjson.
local json = require("cjson")

-- Whatever a library prints goes to the log: standard output is for answers.
function print(...)
  local words = table.pack(...)
  for i = 1, words.n do words[i] = tostring(words[i]) end
  io.stderr:write(table.concat(words, "\t"), "\n")
end

local function say(message)
  io.stdout:write(json.encode(message), "\n")
  io.stdout:flush()
end

print("hold in " .. _VERSION)
local joints, pose

for line in io.stdin:lines() do
  local message = json.decode(line)
  if message.type == "hello" then
    joints = message.env.joint_pos_ids
    say({ type = "ready", protocol = 1, interpolation = 3 })
  elseif message.type == "reset" then
    pose = nil
    say({ type = "ready", episode = message.episode })
  elseif message.type == "step" then
    local rest = {}
    pose = pose or (function()
      local start = {}
      -- Lua counts from 1.
      for i, index in ipairs(joints) do start[i] = message.obs[index + 1] end
      return start
    end)()
    for i in ipairs(joints) do rest[i] = 0 end
    say({ type = "act", step = message.step, action = { pose, rest } })
  elseif message.type == "bye" then
    break
  end
end

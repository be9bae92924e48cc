// Holds the pose in which an episode starts. It needs Node's own modules only.
"use strict";
const fs = require("node:fs");
const net = require("node:net");
const os = require("node:os");
const readline = require("node:readline");

const questions = readline.createInterface({ input: new net.Socket({ fd: 3, readable: true }) });
const say = (message) => fs.writeSync(4, JSON.stringify(message) + "\n");

console.log("interfaces:", Object.keys(os.networkInterfaces()).join(), "memory:", os.totalmem());

let joints = [];
let pose = null;

questions.on("line", (line) => {
  const message = JSON.parse(line);
  switch (message.type) {
    case "hello":
      joints = message.env.joint_pos_ids;
      say({ type: "ready", protocol: 1, interpolation: 3 });
      break;
    case "reset":
      pose = null;
      say({ type: "ready", episode: message.episode });
      break;
    case "step":
      pose ??= joints.map((index) => message.obs[index]);
      say({ type: "act", step: message.step, action: [pose, pose.map(() => 0)] });
      break;
    case "bye":
      process.exit(0);
  }
});

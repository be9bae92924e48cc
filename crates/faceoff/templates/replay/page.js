// Animates the table of a replay: `motion` has the positions (m) of puck, observed puck and mallets after each control step.
const motion = JSON.parse(document.getElementById("motion").textContent);
const element = (id) => document.getElementById(id);
const last = motion.puck.length - 1;
// Time (ms) at which the animation was started; null: it is paused.
let startedAt = null;
// Step from which it was started.
let firstStep = 0;

// Shows the state after `step` control steps, and moves the cursor in the plots.
function show(step) {
  const current = Math.min(last, Math.floor(step));
  for (const name of ["puck", "observed", "mallet", "opponent"]) {
    const positions = motion[name];
    const disc = element(name);
    if (!disc || positions.length === 0) continue;
    const [x, y] = positions[Math.min(current, positions.length - 1)];
    disc.setAttribute("cx", x);
    disc.setAttribute("cy", y);
  }
  element("step").value = current;
  element("time").textContent = `step ${current}, ${(current * motion.step_s).toFixed(2)} s`;
  const plots = element("plots");
  const scale = plots.firstElementChild.getBoundingClientRect().width / plots.firstElementChild.viewBox.baseVal.width;
  const fraction = last === 0 ? 0 : current / last;
  element("cursor").style.left = `${scale * (axis[0] + fraction * (axis[1] - axis[0]))}px`;
}

function frame(now) {
  if (startedAt === null) return;
  const step = firstStep + ((now - startedAt) / 1000) * Number(element("speed").value) / motion.step_s;
  show(step);
  if (step < last) requestAnimationFrame(frame);
  else stop();
}

function stop() {
  startedAt = null;
  element("play").textContent = "play";
}

function start() {
  firstStep = Number(element("step").value) >= last ? 0 : Number(element("step").value);
  startedAt = performance.now();
  element("play").textContent = "pause";
  requestAnimationFrame(frame);
}

element("play").addEventListener("click", () => (startedAt === null ? start() : stop()));
element("step").addEventListener("input", () => { stop(); show(Number(element("step").value)); });
element("speed").addEventListener("change", () => { if (startedAt !== null) start(); });
element("controls").hidden = false;
element("cursor").hidden = false;
show(last);

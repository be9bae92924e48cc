// Animates a game. Sample k is the state after k control steps. `motion` has the differences of the positions (mm) of puck and mallets,
// the first and last sample of each rally with the score before it, and of each side the samples with a violation.
const motion = JSON.parse(document.getElementById("motion").textContent);
const element = (id) => document.getElementById(id);
const columns = motion.positions.map((differences) => {
  let sum = 0;
  return Float32Array.from(differences, (difference) => (sum += difference) / 1000);
});
const bodies = [["puck", "trail-puck"], ["mallet-1", "trail-1"], ["mallet-2", "trail-2"]]
  .map((ids, body) => ({ disc: element(ids[0]), trail: element(ids[1]), x: columns[2 * body], y: columns[2 * body + 1] }));
const last = columns[0].length - 1;
const trailSteps = Math.round(2 / motion.step_s);
// Time (ms) at which the animation was started; null: it is paused.
let startedAt = null;
// Sample from which it was started.
let firstStep = 0;

// The last of the sorted `spans` that begins before `step`; 0 if none does.
function spanBefore(spans, step) {
  let [low, high] = [0, spans.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (spans[middle][0] < step) low = middle;
    else high = middle;
  }
  return low;
}

function clock(step) {
  const tenths = Math.floor(step * motion.step_s * 10 + 1e-6);
  return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}

// Shows the state after `step` control steps.
function show(step) {
  const current = Math.max(0, Math.min(last, Math.floor(step)));
  const rally = spanBefore(motion.rallies, current);
  const [rallyStart, rallyEnd] = motion.rallies[rally];
  const next = motion.rallies[rally + 1];
  const score = current < rallyEnd ? motion.rallies[rally].slice(2) : next ? next.slice(2) : motion.score;
  // The sample at a rally's start is the end of the rally before.
  const trailStart = Math.max(current - trailSteps, rally === 0 ? 0 : rallyStart + 1);
  for (const { disc, trail, x, y } of bodies) {
    disc.setAttribute("cx", x[current]);
    disc.setAttribute("cy", y[current]);
    const points = [];
    for (let k = trailStart; k <= current; k++) points.push(`${x[k].toFixed(3)},${y[k].toFixed(3)}`);
    trail.setAttribute("points", points.join(" "));
  }
  motion.violations.forEach((spans, side) => {
    const span = spans[spanBefore(spans, current + 1)];
    const violating = span !== undefined && span[0] <= current && current <= span[1];
    element(`mallet-${side + 1}`).classList.toggle("violating", violating);
  });
  element("step").value = current;
  element("rally").selectedIndex = rally;
  element("time").textContent = `${clock(current)}, step ${current}, ${score[0]} : ${score[1]}`;
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

// The sample that the address names, such as #t=83.20; null: none.
function linkedStep() {
  const found = /^#t=(\d+(\.\d+)?)$/.exec(location.hash);
  return found === null ? null : Math.round(Number(found[1]) / motion.step_s);
}

function playLinked(event) {
  const link = event.target.closest("a[href^='#t=']");
  if (link === null) return;
  event.preventDefault();
  history.replaceState(null, "", link.getAttribute("href"));
  show(linkedStep());
  start();
  element("table").scrollIntoView({ block: "nearest" });
}

element("play").addEventListener("click", () => (startedAt === null ? start() : stop()));
element("step").addEventListener("input", () => { stop(); show(Number(element("step").value)); });
element("speed").addEventListener("change", () => { if (startedAt !== null) start(); });
element("rally").addEventListener("change", () => { stop(); show(Number(element("rally").value)); });
document.addEventListener("click", playLinked);
for (const id of ["controls", "state", "trails"]) element(id).hidden = false;
for (const id of ["shown", "paths"]) element(id).remove();
show(linkedStep() ?? Number(element("controls").dataset.start));

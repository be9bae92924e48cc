// Live updates. A page names the kinds of events that change it (its topics). This script follows the event stream of the API,
// loads the page again after such an event, and replaces the marked regions that differ. Without the script or the stream a page
// stays as it was loaded. The script also adds the visitor's local time to times, counts down to the next evaluation, and moves the
// drawing of the front page.

const STREAM = "/api/v1/events/stream";
// Wait before reconnecting to the stream; it doubles after each failure.
const MIN_RECONNECT_MS = 1000;
const MAX_RECONNECT_MS = 300000;
// Changes within a short time cause one reload; the random part spreads the reloads of many visitors.
const DEBOUNCE_MS = 200;
const RANDOM_DELAY_MS = 800;

// Interval between two updates of the time until the next evaluation.
const COUNTDOWN_INTERVAL_MS = 10000;

const main = document.querySelector("main");
const topics = main?.dataset.liveTopics;
// The page of a running game follows the stream of the game instead of the season.
const streamAddress = main?.dataset.liveStream ?? `${STREAM}?about=${encodeURIComponent(topics)}`;
const statusLine = document.querySelector("[data-live-status]");

const localTimeFormat = new Intl.DateTimeFormat(undefined, { weekday: "short", hour: "2-digit", minute: "2-digit", timeZoneName: "short" });

function addLocalTimes(root) {
  for (const time of root.querySelectorAll("time[datetime*='T']")) {
    const instant = new Date(time.dateTime);
    if (Number.isNaN(instant.valueOf()) || instant.getTimezoneOffset() === 0 || time.querySelector(".local")) continue;
    const local = document.createElement("span");
    local.className = "local";
    local.textContent = ` (${localTimeFormat.format(instant)})`;
    time.append(local);
  }
}

// As the server writes it (countdown.rs).
function timeUntil(milliseconds) {
  const minutes = Math.ceil(milliseconds / 60000);
  if (minutes <= 0) return "now";
  const hours = Math.floor(minutes / 60);
  if (hours === 0) return `in ${minutes} min`;
  const days = Math.floor(hours / 24);
  if (days === 0) return `in ${hours} h ${minutes % 60} min`;
  return `in ${days === 1 ? "1 day" : `${days} days`} ${hours % 24} h`;
}

function updateCountdowns() {
  for (const element of document.querySelectorAll("[data-countdown]")) {
    const text = timeUntil(Date.parse(element.dataset.countdown) - Date.now());
    if (element.textContent !== text) element.textContent = text;
  }
}

// The moving drawing of the front page. It stays still for visitors who asked for less motion, until they press the button.
function startHighlight() {
  const figure = document.querySelector("[data-highlight]");
  const button = figure?.querySelector("[data-highlight-pause]");
  const drawing = figure?.querySelector("svg");
  if (!button || !drawing.pauseAnimations) return;
  let isRunning = false;
  const run = (isToRun) => {
    if (isToRun && button.dataset.started === undefined) {
      button.dataset.started = "";
      for (const animation of drawing.querySelectorAll("animate")) animation.beginElement();
    }
    if (isToRun) drawing.unpauseAnimations();
    else drawing.pauseAnimations();
    isRunning = isToRun;
    button.textContent = isRunning ? "Pause" : "Play";
  };
  button.hidden = false;
  button.addEventListener("click", () => run(!isRunning));
  run(!matchMedia("(prefers-reduced-motion: reduce)").matches);
}

const regionsOf = (page) => [...page.querySelectorAll("[data-live-region]")];
const nameOf = (region) => region.dataset.liveRegion;
// HTML of the regions as sent by the server, without local times.
const sentHtml = new Map(regionsOf(document).map((region) => [nameOf(region), region.outerHTML]));
addLocalTimes(document);
updateCountdowns();
setInterval(updateCountdowns, COUNTDOWN_INTERVAL_MS);
startHighlight();

// Describes an element, so that `find` finds it in the new version of its region.
function locate(element, region) {
  if (element.id) return `#${CSS.escape(element.id)}`;
  const href = element.getAttribute("href");
  const selector = element.localName + (href ? `[href="${CSS.escape(href)}"]` : "");
  const index = [...region.querySelectorAll(selector)].indexOf(element);
  return { selector, index };
}

function find(description, region) {
  if (typeof description === "string") return region.querySelector(description);
  return region.querySelectorAll(description.selector)[description.index];
}

function replace(old, next) {
  const focused = old.contains(document.activeElement) ? locate(document.activeElement, old) : null;
  const open = [...old.querySelectorAll("details")].map((details) => details.open);
  const scrolled = [...old.querySelectorAll(".wide")].map((wide) => wide.scrollLeft);
  // The visible part of the page must not move.
  const inView = [...old.querySelectorAll("a[href], h2")].find((element) => element.getBoundingClientRect().top >= 0);
  const anchor = inView && { description: locate(inView, old), top: inView.getBoundingClientRect().top };
  const box = old.getBoundingClientRect();

  const region = document.adoptNode(next);
  [...region.querySelectorAll("details")].forEach((details, index) => { if (open[index]) details.open = true; });
  addLocalTimes(region);
  old.replaceWith(region);
  updateCountdowns();
  [...region.querySelectorAll(".wide")].forEach((wide, index) => { wide.scrollLeft = scrolled[index] ?? 0; });

  const moved = anchor && find(anchor.description, region);
  if (moved && window.scrollY > 0) window.scrollBy(0, moved.getBoundingClientRect().top - anchor.top);
  else if (window.scrollY > 0 && box.bottom < 0) window.scrollBy(0, region.getBoundingClientRect().height - box.height);
  if (focused) find(focused, region)?.focus({ preventScroll: true });
}

let isReloading = false;
// Must the page be loaded, or loaded once more after the reload in progress?
let isReloadNeeded = false;

async function reload() {
  isReloadNeeded = true;
  if (isReloading) return;
  isReloading = true;
  try {
    while (isReloadNeeded) {
      isReloadNeeded = false;
      const response = await fetch(location.href, { headers: { accept: "text/html" }, cache: "no-cache" });
      if (!response.ok || response.redirected) return;
      const page = new DOMParser().parseFromString(await response.text(), "text/html");
      const next = page.querySelector("main")?.dataset;
      if (main.dataset.liveStream !== undefined && next && next.liveStream === undefined) {
        // The game is over: the page now has other content, such as the replay.
        stopStream();
        location.reload();
        return;
      }
      if (next?.liveTopics === undefined) return;
      show(page);
    }
  } catch {
    // The server is not reachable: the stream reconnects and triggers the next reload.
  } finally {
    isReloading = false;
    schedulePolling();
  }
}

function show(page) {
  const announcements = [];
  for (const next of regionsOf(page)) {
    const name = nameOf(next);
    const old = regionsOf(document).find((region) => nameOf(region) === name);
    const html = next.outerHTML;
    if (!old || sentHtml.get(name) === html) continue;
    sentHtml.set(name, html);
    const announcement = next.dataset.liveAnnouncement;
    if (announcement && announcement !== old.dataset.liveAnnouncement) announcements.push(announcement);
    replace(old, next);
  }
  document.title = page.title;
  if (announcements.length > 0 && statusLine) statusLine.textContent = announcements.join(" ");
}

// Moves puck and mallets of a live game between two reloads. Positions: x and y in metres, y up; the drawing uses millimetres, y down.
function movePieces({ puck, mallets }) {
  for (const [name, [x, y]] of [["puck", puck], ["mallet-1", mallets[0]], ["mallet-2", mallets[1]]]) {
    const piece = document.querySelector(`[data-live-piece="${name}"]`);
    piece?.setAttribute("cx", Math.round(1000 * x));
    piece?.setAttribute("cy", Math.round(-1000 * y));
  }
}

let stream = null;
let reconnectMs = MIN_RECONNECT_MS;
let reloadTimer = 0;
let reconnectTimer = 0;
let pollTimer = 0;

function scheduleReload() {
  if (reloadTimer === 0) {
    reloadTimer = setTimeout(() => {
      reloadTimer = 0;
      reload();
    }, DEBOUNCE_MS + RANDOM_DELAY_MS * Math.random());
  }
}

// Some values change without an event: the page says how often to poll them.
function schedulePolling() {
  clearTimeout(pollTimer);
  const seconds = Number(document.querySelector("[data-live-poll-seconds]")?.dataset.livePollSeconds);
  if (stream && seconds > 0) pollTimer = setTimeout(reload, seconds * 1000);
}

function followStream() {
  stopStream();
  stream = new EventSource(streamAddress);
  stream.addEventListener("open", () => { reconnectMs = MIN_RECONNECT_MS; });
  // The stream of the season sends now, change and reset; the stream of a game sends the others, and position.
  for (const name of ["now", "change", "reset", "snapshot", "happening", "waiting", "over"]) stream.addEventListener(name, scheduleReload);
  stream.addEventListener("position", (event) => movePieces(JSON.parse(event.data)));
  stream.addEventListener("error", () => {
    // In other states the browser reconnects automatically.
    if (stream?.readyState !== EventSource.CLOSED) return;
    stopStream();
    reconnectTimer = setTimeout(followStream, reconnectMs * (0.5 + Math.random()));
    reconnectMs = Math.min(2 * reconnectMs, MAX_RECONNECT_MS);
  });
}

function stopStream() {
  stream?.close();
  stream = null;
  for (const timer of [reloadTimer, reconnectTimer, pollTimer]) clearTimeout(timer);
  reloadTimer = 0;
}

if (topics && "EventSource" in window) {
  // Hidden pages close their stream, since the number of streams is limited.
  document.addEventListener("visibilitychange", () => (document.hidden ? stopStream() : followStream()));
  window.addEventListener("pagehide", stopStream);
  window.addEventListener("pageshow", (event) => { if (event.persisted) followStream(); });
  if (!document.hidden) followStream();
}

// Live updates: a page names its topics, this script follows the event stream of the API, loads the page again after a change,
// and replaces the regions that differ. Without the script or the stream a page stays as it was loaded. The script also adds the
// visitor's local time to times.

const STREAM = "/api/v1/events/stream";
const MIN_WAIT_MS = 1000;
const MAX_WAIT_MS = 300000;
// Changes within a short time cause one reload; the random part spreads the reloads of many visitors.
const DEBOUNCE_MS = 200;
const SPREAD_MS = 800;

const main = document.querySelector("main");
const topics = main?.dataset.live;
// The page of a running game follows the stream of the game instead of the season.
const address = main?.dataset.liveStream ?? `${STREAM}?about=${encodeURIComponent(topics)}`;
const status = document.querySelector("[data-live-said]");

const clock = new Intl.DateTimeFormat(undefined, { weekday: "short", hour: "2-digit", minute: "2-digit", timeZoneName: "short" });

function addLocalTimes(root) {
  for (const time of root.querySelectorAll("time[datetime*='T']")) {
    const at = new Date(time.dateTime);
    if (Number.isNaN(at.valueOf()) || at.getTimezoneOffset() === 0 || time.querySelector(".local")) continue;
    const local = document.createElement("span");
    local.className = "local";
    local.textContent = ` (${clock.format(at)})`;
    time.append(local);
  }
}

const regionsOf = (page) => [...page.querySelectorAll("[data-live-region]")];
const nameOf = (region) => region.dataset.liveRegion;
// HTML of the regions as sent by the server, without local times.
const sent = new Map(regionsOf(document).map((region) => [nameOf(region), region.outerHTML]));
addLocalTimes(document);

// Describes an element so that it can be found in the new version of its region.
function describe(element, region) {
  if (element.id) return `#${CSS.escape(element.id)}`;
  const href = element.getAttribute("href");
  const selector = element.localName + (href ? `[href="${CSS.escape(href)}"]` : "");
  const at = [...region.querySelectorAll(selector)].indexOf(element);
  return { selector, at };
}

function find(description, region) {
  if (typeof description === "string") return region.querySelector(description);
  return region.querySelectorAll(description.selector)[description.at];
}

function replace(old, next) {
  const focused = old.contains(document.activeElement) ? describe(document.activeElement, old) : null;
  const open = [...old.querySelectorAll("details")].map((details) => details.open);
  const scrolled = [...old.querySelectorAll(".wide")].map((wide) => wide.scrollLeft);
  // The visible part of the page must not move.
  const inView = [...old.querySelectorAll("a[href], h2")].find((element) => element.getBoundingClientRect().top >= 0);
  const anchor = inView && { found: describe(inView, old), top: inView.getBoundingClientRect().top };
  const box = old.getBoundingClientRect();

  const region = document.adoptNode(next);
  [...region.querySelectorAll("details")].forEach((details, at) => { if (open[at]) details.open = true; });
  addLocalTimes(region);
  old.replaceWith(region);
  [...region.querySelectorAll(".wide")].forEach((wide, at) => { wide.scrollLeft = scrolled[at] ?? 0; });

  const now = anchor && find(anchor.found, region);
  if (now && window.scrollY > 0) window.scrollBy(0, now.getBoundingClientRect().top - anchor.top);
  else if (window.scrollY > 0 && box.bottom < 0) window.scrollBy(0, region.getBoundingClientRect().height - box.height);
  if (focused) find(focused, region)?.focus({ preventScroll: true });
}

let isLoading = false;
let isWanted = false;

async function load() {
  isWanted = true;
  if (isLoading) return;
  isLoading = true;
  try {
    while (isWanted) {
      isWanted = false;
      const response = await fetch(location.href, { headers: { accept: "text/html" }, cache: "no-cache" });
      if (!response.ok || response.redirected) return;
      const page = new DOMParser().parseFromString(await response.text(), "text/html");
      const next = page.querySelector("main")?.dataset;
      if (main.dataset.liveStream !== undefined && next && next.liveStream === undefined) {
        // The game is over: the page now has other content, such as the replay.
        stop();
        location.reload();
        return;
      }
      if (next?.live === undefined) return;
      show(page);
    }
  } catch {
    // The server is not reachable: the stream reconnects and triggers the next load.
  } finally {
    isLoading = false;
    schedulePolling();
  }
}

function show(page) {
  const texts = [];
  for (const next of regionsOf(page)) {
    const name = nameOf(next);
    const old = regionsOf(document).find((region) => nameOf(region) === name);
    const html = next.outerHTML;
    if (!old || sent.get(name) === html) continue;
    sent.set(name, html);
    const says = next.dataset.liveSays;
    if (says && says !== old.dataset.liveSays) texts.push(says);
    replace(old, next);
  }
  document.title = page.title;
  if (texts.length > 0 && status) status.textContent = texts.join(" ");
}

// Moves puck and mallets between two loads. Input: table frame in metres; the drawing uses millimetres.
function movePieces({ puck, mallets }) {
  for (const [name, [x, y]] of [["puck", puck], ["mallet-1", mallets[0]], ["mallet-2", mallets[1]]]) {
    const mark = document.querySelector(`[data-live-place="${name}"]`);
    mark?.setAttribute("cx", Math.round(1000 * x));
    mark?.setAttribute("cy", Math.round(-1000 * y));
  }
}

let stream = null;
let wait = MIN_WAIT_MS;
let loadTimer = 0;
let reconnectTimer = 0;
let pollTimer = 0;

function scheduleLoad() {
  if (loadTimer === 0) {
    loadTimer = setTimeout(() => {
      loadTimer = 0;
      load();
    }, DEBOUNCE_MS + SPREAD_MS * Math.random());
  }
}

// Some values change without an event: the page says how often to poll them.
function schedulePolling() {
  clearTimeout(pollTimer);
  const every = Number(document.querySelector("[data-live-every]")?.dataset.liveEvery);
  if (stream && every > 0) pollTimer = setTimeout(load, every * 1000);
}

function follow() {
  stop();
  stream = new EventSource(address);
  stream.addEventListener("open", () => { wait = MIN_WAIT_MS; });
  for (const name of ["now", "change", "reset", "snapshot", "happening", "waiting", "over"]) stream.addEventListener(name, scheduleLoad);
  stream.addEventListener("position", (event) => movePieces(JSON.parse(event.data)));
  stream.addEventListener("error", () => {
    // In other states the browser reconnects automatically.
    if (stream?.readyState !== EventSource.CLOSED) return;
    stop();
    reconnectTimer = setTimeout(follow, wait * (0.5 + Math.random()));
    wait = Math.min(2 * wait, MAX_WAIT_MS);
  });
}

function stop() {
  stream?.close();
  stream = null;
  for (const timer of [loadTimer, reconnectTimer, pollTimer]) clearTimeout(timer);
  loadTimer = 0;
}

if (topics && "EventSource" in window) {
  // Hidden pages close their stream, since the number of streams is limited.
  document.addEventListener("visibilitychange", () => (document.hidden ? stop() : follow()));
  window.addEventListener("pagehide", stop);
  window.addEventListener("pageshow", (event) => { if (event.persisted) follow(); });
  if (!document.hidden) follow();
}

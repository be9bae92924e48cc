// Keeps a page as the server has it, where the page says what it is about: it follows the API's stream of changes, loads
// the page again when something of that has changed, and replaces the regions that differ. Without it, or without the stream, the
// page is what it was when it was loaded. It also tells moments by the visitor's clock.

const STREAM = "/api/v1/events/stream";
const FIRST_WAIT_MS = 1000;
const LONGEST_WAIT_MS = 300000;
// What happens close together is loaded once, and not by all visitors in the same moment.
const TOGETHER_MS = 200;
const SPREAD_MS = 800;

const main = document.querySelector("main");
const about = main?.dataset.live;
// A page about a game under way follows the game's own stream in place of the season's.
const address = main?.dataset.liveStream ?? `${STREAM}?about=${encodeURIComponent(about)}`;
const said = document.querySelector("[data-live-said]");

const clock = new Intl.DateTimeFormat(undefined, { weekday: "short", hour: "2-digit", minute: "2-digit", timeZoneName: "short" });

function tellLocalTimes(root) {
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
// As the server sent them, before anything was added.
const sent = new Map(regionsOf(document).map((region) => [nameOf(region), region.outerHTML]));
tellLocalTimes(document);

// How an element is found again in a region that was replaced.
function describe(element, region) {
  if (element.id) return `#${CSS.escape(element.id)}`;
  const href = element.getAttribute("href");
  const own = element.localName + (href ? `[href="${CSS.escape(href)}"]` : "");
  const at = [...region.querySelectorAll(own)].indexOf(element);
  return { own, at };
}

function find(description, region) {
  if (typeof description === "string") return region.querySelector(description);
  return region.querySelectorAll(description.own)[description.at];
}

function replace(old, next) {
  const focused = old.contains(document.activeElement) ? describe(document.activeElement, old) : null;
  const open = [...old.querySelectorAll("details")].map((details) => details.open);
  const scrolled = [...old.querySelectorAll(".wide")].map((wide) => wide.scrollLeft);
  // What the visitor looks at stays where it is.
  const inView = [...old.querySelectorAll("a[href], h2")].find((element) => element.getBoundingClientRect().top >= 0);
  const anchor = inView && { found: describe(inView, old), top: inView.getBoundingClientRect().top };
  const place = old.getBoundingClientRect();

  const region = document.adoptNode(next);
  [...region.querySelectorAll("details")].forEach((details, at) => { if (open[at]) details.open = true; });
  tellLocalTimes(region);
  old.replaceWith(region);
  [...region.querySelectorAll(".wide")].forEach((wide, at) => { wide.scrollLeft = scrolled[at] ?? 0; });

  const now = anchor && find(anchor.found, region);
  if (now && window.scrollY > 0) window.scrollBy(0, now.getBoundingClientRect().top - anchor.top);
  else if (window.scrollY > 0 && place.bottom < 0) window.scrollBy(0, region.getBoundingClientRect().height - place.height);
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
      const answer = await fetch(location.href, { headers: { accept: "text/html" }, cache: "no-cache" });
      if (!answer.ok || answer.redirected) return;
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      const next = page.querySelector("main")?.dataset;
      if (main.dataset.liveStream !== undefined && next && next.liveStream === undefined) {
        // The game is over: what is shown of it from now on, its replay among it, is another page.
        stop();
        location.reload();
        return;
      }
      if (next?.live === undefined) return;
      show(page);
    }
  } catch {
    // The server cannot be reached: the stream notices, and looks again.
  } finally {
    isLoading = false;
    lookAgain();
  }
}

function show(page) {
  const words = [];
  for (const next of regionsOf(page)) {
    const name = nameOf(next);
    const old = regionsOf(document).find((region) => nameOf(region) === name);
    const html = next.outerHTML;
    if (!old || sent.get(name) === html) continue;
    sent.set(name, html);
    const says = next.dataset.liveSays;
    if (says && says !== old.dataset.liveSays) words.push(says);
    replace(old, next);
  }
  document.title = page.title;
  if (words.length > 0 && said) said.textContent = words.join(" ");
}

// Where puck and mallets are, between what is loaded: table frame, metres; drawn are millimetres, y upwards.
function place({ puck, mallets }) {
  for (const [name, [x, y]] of [["puck", puck], ["mallet-1", mallets[0]], ["mallet-2", mallets[1]]]) {
    const mark = document.querySelector(`[data-live-place="${name}"]`);
    mark?.setAttribute("cx", Math.round(1000 * x));
    mark?.setAttribute("cy", Math.round(-1000 * y));
  }
}

let stream = null;
let wait = FIRST_WAIT_MS;
let soonTimer = 0;
let againTimer = 0;
let lookTimer = 0;

function soon() {
  if (soonTimer === 0) {
    soonTimer = setTimeout(() => {
      soonTimer = 0;
      load();
    }, TOGETHER_MS + SPREAD_MS * Math.random());
  }
}

// Of what moves without a change that is told, the page says how often it is looked at.
function lookAgain() {
  clearTimeout(lookTimer);
  const every = Number(document.querySelector("[data-live-every]")?.dataset.liveEvery);
  if (stream && every > 0) lookTimer = setTimeout(load, every * 1000);
}

function follow() {
  stop();
  stream = new EventSource(address);
  stream.addEventListener("open", () => { wait = FIRST_WAIT_MS; });
  for (const name of ["now", "change", "reset", "snapshot", "happening", "waiting", "over"]) stream.addEventListener(name, soon);
  stream.addEventListener("position", (event) => place(JSON.parse(event.data)));
  stream.addEventListener("error", () => {
    // Otherwise the browser comes again by itself.
    if (stream?.readyState !== EventSource.CLOSED) return;
    stop();
    againTimer = setTimeout(follow, wait * (0.5 + Math.random()));
    wait = Math.min(2 * wait, LONGEST_WAIT_MS);
  });
}

function stop() {
  stream?.close();
  stream = null;
  for (const timer of [soonTimer, againTimer, lookTimer]) clearTimeout(timer);
  soonTimer = 0;
}

if (about && "EventSource" in window) {
  // Who does not look takes nobody's place.
  document.addEventListener("visibilitychange", () => (document.hidden ? stop() : follow()));
  window.addEventListener("pagehide", stop);
  window.addEventListener("pageshow", (event) => { if (event.persisted) follow(); });
  if (!document.hidden) follow();
}

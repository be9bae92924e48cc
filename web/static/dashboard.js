// Script of the dashboards, the signed-in pages of teams and organisers: a progress bar for uploads, drag and drop, forms that are sent
// once, and sections that update while work is in progress. Without JavaScript all of it works with forms and reloading.

// Interval between two reloads of a page that shows a validation run or evaluations in progress.
const RELOAD_INTERVAL_MS = 3000;
// A form that was sent can be sent again after this time.
const RESEND_AFTER_MS = 10000;

function showStatus(form, text) {
  let line = form.querySelector("[role=status]");
  if (!line) {
    line = document.createElement("p");
    line.setAttribute("role", "status");
    form.append(line);
  }
  line.textContent = text;
}

function addProgressBar(form) {
  const progress = document.createElement("progress");
  progress.setAttribute("aria-label", "Uploaded");
  // The bar tells its value itself: the number beside it is for the eye only.
  const percent = document.createElement("span");
  percent.className = "percent";
  percent.setAttribute("aria-hidden", "true");
  form.append(progress, percent);
  return { progress, percent };
}

// The error message in the HTML of a response; null if the page has none.
function findRefusal(html) {
  const page = new DOMParser().parseFromString(html, "text/html");
  return page.querySelector("[role=alert]") ?? page.querySelector("main section p");
}

function showRefusal(form, alert, status) {
  document.querySelector(".refused")?.remove();
  const box = document.createElement("div");
  box.className = "refused";
  box.setAttribute("role", "alert");
  if (alert) {
    box.append(...Array.from(alert.childNodes, (node) => document.importNode(node, true)));
  } else {
    box.textContent = `The server refused the upload (status ${status}).`;
  }
  form.before(box);
}

function upload(form, event) {
  event.preventDefault();
  const button = form.querySelector("button");
  const { progress, percent } = addProgressBar(form);
  const request = new XMLHttpRequest();
  const done = () => {
    progress.remove();
    percent.remove();
    button.disabled = false;
  };
  button.disabled = true;
  showStatus(form, "Uploading …");
  request.upload.addEventListener("progress", (sent) => {
    if (!sent.lengthComputable) return;
    progress.max = sent.total;
    progress.value = sent.loaded;
    const text = `${Math.floor((100 * sent.loaded) / sent.total)} %`;
    progress.setAttribute("aria-valuetext", text);
    percent.textContent = text;
  });
  request.upload.addEventListener("load", () => showStatus(form, "Sent. The server is storing the bundle …"));
  request.addEventListener("load", () => {
    if (request.status >= 200 && request.status < 300) {
      location.assign(request.responseURL);
      return;
    }
    done();
    showStatus(form, "Upload failed.");
    showRefusal(form, findRefusal(request.responseText), request.status);
  });
  request.addEventListener("error", () => {
    done();
    showStatus(form, "The connection was lost and nothing was stored. Upload again.");
  });
  request.open("POST", form.action);
  request.send(new FormData(form));
}

function acceptDrops(form) {
  const input = form.querySelector("input[type=file]");
  const hint = document.createElement("p");
  hint.className = "note";
  hint.textContent = "Or drop the bundle here.";
  input.after(hint);
  const highlight = (isOver) => form.classList.toggle("drag-over", isOver);
  form.addEventListener("dragover", (event) => {
    event.preventDefault();
    highlight(true);
  });
  form.addEventListener("dragleave", () => highlight(false));
  form.addEventListener("drop", (event) => {
    event.preventDefault();
    highlight(false);
    if (event.dataTransfer.files.length !== 1) {
      showStatus(form, "Drop one bundle at a time.");
      return;
    }
    input.files = event.dataTransfer.files;
    form.requestSubmit();
  });
}

// Replaces each changed section by its current content while the page marks work in progress. Nothing is replaced while a fold is
// open; a section with the focus stays as it is.
async function reloadSections() {
  if (!document.querySelector("[data-in-progress]")) return;
  const isBusy = document.hidden || document.querySelector("[data-live-section] details[open]");
  if (!isBusy) {
    try {
      const address = new URL(location.href);
      address.searchParams.delete("done");
      const response = await fetch(address, { headers: { accept: "text/html" } });
      if (response.ok && !response.redirected) {
        const page = new DOMParser().parseFromString(await response.text(), "text/html");
        for (const old of document.querySelectorAll("[data-live-section]")) {
          const fresh = page.querySelector(`[data-live-section="${old.dataset.liveSection}"]`);
          const hasFocus = old.contains(document.activeElement);
          if (fresh && !hasFocus && fresh.innerHTML !== old.innerHTML) {
            old.replaceWith(document.importNode(fresh, true));
          }
        }
      }
    } catch {
      // The server is not reachable at the moment: the next attempt follows.
    }
  }
  setTimeout(reloadSections, RELOAD_INTERVAL_MS);
}

// Sends a form once: a second click while the page waits for the answer sends nothing. The server does not rely on it.
function sendOnce(event) {
  const form = event.target;
  if (event.defaultPrevented || form.method !== "post") return;
  if (form.dataset.sent) {
    event.preventDefault();
    return;
  }
  form.dataset.sent = "yes";
  // The visitor may have stopped the browser from waiting for the answer.
  setTimeout(() => delete form.dataset.sent, RESEND_AFTER_MS);
}

// After the back button a page may come from the browser's memory: its forms can be sent again.
function allowSending() {
  for (const form of document.querySelectorAll("form[data-sent]")) delete form.dataset.sent;
}

document.addEventListener("submit", sendOnce);
addEventListener("pageshow", allowSending);
for (const form of document.querySelectorAll("form[data-upload]")) {
  form.addEventListener("submit", (event) => upload(form, event));
  acceptDrops(form);
}
setTimeout(reloadSections, RELOAD_INTERVAL_MS);

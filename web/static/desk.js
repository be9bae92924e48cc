// What the desks gain where scripts run: a bar for an upload, files dropped onto its form, and states that follow
// a running validation. Without it all of it works by forms and by loading the page anew.

const EVERY_MS = 3000;

function say(form, words) {
  let line = form.querySelector("[role=status]");
  if (!line) {
    line = document.createElement("p");
    line.setAttribute("role", "status");
    form.append(line);
  }
  line.textContent = words;
}

function bar(form) {
  const progress = document.createElement("progress");
  progress.setAttribute("aria-label", "Uploaded");
  form.append(progress);
  return progress;
}

// The server's refusal, as it stands on the page that it answers.
function refusal(text) {
  const page = new DOMParser().parseFromString(text, "text/html");
  return page.querySelector("[role=alert]") ?? page.querySelector("main section p");
}

function refuse(form, alert, status) {
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
  const progress = bar(form);
  const request = new XMLHttpRequest();
  const done = () => {
    progress.remove();
    button.disabled = false;
  };
  button.disabled = true;
  say(form, "Uploading …");
  request.upload.addEventListener("progress", (sent) => {
    if (!sent.lengthComputable) return;
    progress.max = sent.total;
    progress.value = sent.loaded;
    const percent = Math.floor((100 * sent.loaded) / sent.total);
    progress.setAttribute("aria-valuetext", `${percent} %`);
  });
  request.upload.addEventListener("load", () => say(form, "Sent; the server stores it …"));
  request.addEventListener("load", () => {
    if (request.status >= 200 && request.status < 300) {
      location.assign(request.responseURL);
      return;
    }
    done();
    say(form, "Not uploaded.");
    refuse(form, refusal(request.responseText), request.status);
  });
  request.addEventListener("error", () => {
    done();
    say(form, "The connection broke off; nothing was stored. Send it again.");
  });
  request.open("POST", form.action);
  request.send(new FormData(form));
}

function takesDrops(form) {
  const input = form.querySelector("input[type=file]");
  const hint = document.createElement("p");
  hint.className = "note";
  hint.textContent = "Or drop the archive here.";
  input.after(hint);
  const over = (is) => form.classList.toggle("over", is);
  form.addEventListener("dragover", (event) => {
    event.preventDefault();
    over(true);
  });
  form.addEventListener("dragleave", () => over(false));
  form.addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    if (event.dataTransfer.files.length !== 1) {
      say(form, "Drop one archive at a time.");
      return;
    }
    input.files = event.dataTransfer.files;
    form.requestSubmit();
  });
}

// Sections whose state moves are replaced by what the page says now. What somebody has opened or is typing in stays.
async function follow() {
  if (!document.querySelector("[data-moving]")) return;
  const isBusy = document.hidden || document.querySelector("[data-live] details[open]");
  if (!isBusy) {
    try {
      const here = new URL(location.href);
      here.searchParams.delete("done");
      const answer = await fetch(here, { headers: { accept: "text/html" } });
      if (answer.ok && !answer.redirected) {
        const page = new DOMParser().parseFromString(await answer.text(), "text/html");
        for (const old of document.querySelectorAll("[data-live]")) {
          const fresh = page.querySelector(`[data-live="${old.dataset.live}"]`);
          const hasFocus = old.contains(document.activeElement);
          if (fresh && !hasFocus && fresh.innerHTML !== old.innerHTML) {
            old.replaceWith(document.importNode(fresh, true));
          }
        }
      }
    } catch {
      // The server is away for a moment; it is asked again.
    }
  }
  setTimeout(follow, EVERY_MS);
}

for (const form of document.querySelectorAll("form[data-upload]")) {
  form.addEventListener("submit", (event) => upload(form, event));
  takesDrops(form);
}
setTimeout(follow, EVERY_MS);

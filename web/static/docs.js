// Script of the documentation: buttons that copy listings, and a list of all pages that begins near the current one. Without
// JavaScript the pages are complete.

const COPIED_MS = 2000;

// Without TLS, browsers only copy a selection.
async function copy(text) {
  if (navigator.clipboard) return navigator.clipboard.writeText(text);
  const field = document.createElement("textarea");
  field.value = text;
  field.style.position = "fixed";
  document.body.append(field);
  field.select();
  const copied = document.execCommand("copy");
  field.remove();
  if (!copied) throw new Error("the browser does not copy");
}

// Of a session only the commands, without prompts and output.
function textOf(listing) {
  const commands = Array.from(listing.querySelectorAll(".command"), (command) => command.textContent);
  return commands.length > 0 ? `${commands.join("\n")}\n` : listing.textContent;
}

function addButton(listing) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "copy";
  button.textContent = "Copy";
  button.setAttribute("aria-label", `Copy ${listing.getAttribute("aria-label")}`);
  const status = document.querySelector("[data-live-status]");
  button.addEventListener("click", async () => {
    const done = await copy(textOf(listing)).then(() => "Copied", () => "Failed");
    button.textContent = done;
    status.textContent = done === "Copied" ? "Copied" : "The browser refused to copy. Select the text instead.";
    button.focus();
    setTimeout(() => {
      button.textContent = "Copy";
      status.textContent = "";
    }, COPIED_MS);
  });
  listing.after(button);
}

// Scrolls the list, not the page.
function showCurrent(list) {
  const current = list.querySelector("[aria-current]");
  if (!current) return;
  list.scrollTop += current.getBoundingClientRect().top - list.getBoundingClientRect().top - list.clientHeight / 4;
}

document.querySelectorAll(".listing > pre").forEach(addButton);
for (const list of document.querySelectorAll(".side-list")) {
  showCurrent(list);
  list.parentElement.addEventListener("toggle", () => showCurrent(list));
}

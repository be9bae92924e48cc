// Uploads an archive, follows it until it has its verdict and downloads it again, by openapi-fetch with the types that
// openapi-typescript has made of the server's document.
// node out/follow.js URL TOKEN ARCHIVE DOWNLOADED; prints the submission.

import { readFile, writeFile } from "node:fs/promises";
import { setTimeout as pause } from "node:timers/promises";
import createClient from "openapi-fetch";
import type { components, paths } from "./api.js";

const [url, token, archive, downloaded] = process.argv.slice(2);
if (!url || !token || !archive || !downloaded) {
  throw new Error("expected URL TOKEN ARCHIVE DOWNLOADED");
}
const client = createClient<paths>({ baseUrl: url, headers: { Authorization: `Bearer ${token}` } });

const refused = (problem: components["schemas"]["Problem"]) => new Error(`${problem.type}: ${problem.detail}`);

const bytes = await readFile(archive);
const sent = await client.POST("/api/v1/submissions", {
  params: { query: { file_name: "hold.tar.gz" } },
  headers: { "Content-Type": "application/octet-stream" },
  // TypeScript has no word for bytes in JSON: what is declared as a string is sent as it is.
  body: bytes as unknown as string,
  bodySerializer: (body) => body as unknown as Uint8Array<ArrayBuffer>,
});
if (sent.error) throw refused(sent.error);

const path = { id: sent.data.id };
let seen: components["schemas"]["SubmissionView"] = sent.data;
while (seen.state === "validating") {
  await pause(100);
  const answer = await client.GET("/api/v1/submissions/{id}", { params: { path } });
  if (answer.error) throw refused(answer.error);
  seen = answer.data;
}

const file = await client.GET("/api/v1/submissions/{id}/archive", { params: { path }, parseAs: "arrayBuffer" });
if (file.error) throw refused(file.error);
await writeFile(downloaded, new Uint8Array(file.data));
console.log(JSON.stringify(seen));

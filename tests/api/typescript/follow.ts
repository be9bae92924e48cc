// Uploads an archive, polls until its validation has ended, and downloads it again. It uses openapi-fetch with the types that
// openapi-typescript generates from the server's document.
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

const problemError = (problem: components["schemas"]["Problem"]) => new Error(`${problem.type}: ${problem.detail}`);

const bytes = await readFile(archive);
const sent = await client.POST("/api/v1/submissions", {
  params: { query: { file_name: "hold.tar.gz" } },
  headers: { "Content-Type": "application/octet-stream" },
  // The generated type of a binary body is string; the serialiser sends the bytes unchanged.
  body: bytes as unknown as string,
  bodySerializer: (body) => body as unknown as Uint8Array<ArrayBuffer>,
});
if (sent.error) throw problemError(sent.error);

const path = { id: sent.data.id };
let submission: components["schemas"]["SubmissionView"] = sent.data;
while (submission.state === "validating") {
  await pause(100);
  const response = await client.GET("/api/v1/submissions/{id}", { params: { path } });
  if (response.error) throw problemError(response.error);
  submission = response.data;
}

const file = await client.GET("/api/v1/submissions/{id}/bundle", { params: { path }, parseAs: "arrayBuffer" });
if (file.error) throw problemError(file.error);
await writeFile(downloaded, new Uint8Array(file.data));
console.log(JSON.stringify(submission));

import { readFileSync } from "node:fs";
import { defineConfig } from "vitest/config";

const LICENSED = ["three"];

/** Emits the licences of bundled packages, which the licences require. */
function licences() {
  return {
    name: "licences",
    generateBundle(this: { emitFile(file: { type: "asset"; fileName: string; source: string }): unknown }) {
      const texts = LICENSED.map((name) => {
        const root = new URL(`node_modules/${name}/`, import.meta.url);
        const { version } = JSON.parse(readFileSync(new URL("package.json", root), "utf8")) as {
          version: string;
        };
        return `${name} ${version}\n\n${readFileSync(new URL("LICENSE", root), "utf8").trim()}\n`;
      });
      this.emitFile({
        type: "asset",
        fileName: "LICENSES.txt",
        source: `replay.js contains:\n\n${texts.join("\n")}`,
      });
    },
  };
}

// One file with a fixed name: the server embeds it and adds the hash of its content to the address.
export default defineConfig({
  publicDir: false,
  build: {
    target: "es2022",
    modulePreload: { polyfill: false },
    sourcemap: false,
    chunkSizeWarningLimit: 900,
    rolldownOptions: {
      input: "src/replay/main.ts",
      output: { format: "es", entryFileNames: "replay.js", codeSplitting: false },
    },
  },
  plugins: [licences()],
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});

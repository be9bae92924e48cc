import { readFileSync } from "node:fs";
import { defineConfig } from "vitest/config";

const LICENSED = ["three"];

/** The licences of what is bundled, beside the bundle, as they ask for. */
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

// One file with a plain name: the server embeds it and adds the hash of its bytes to the address.
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

// Builds the page into one folder of files that hueline-console serves. Nothing is fetched at run time, and no file has
// script or style inside HTML, because the server's Content-Security-Policy refuses both.
import { defineConfig } from "vite";

export default defineConfig({
  base: "./",
  build: { target: "es2022", modulePreload: { polyfill: false }, chunkSizeWarningLimit: 1500 },
  esbuild: { jsx: "automatic", jsxImportSource: "preact", legalComments: "inline" },
});

// Bundles src into ../static, or into the folder given as the first argument.
import { copyFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const target = resolve(process.argv[2] ?? join(here, "..", "static"));

await build({
  absWorkingDir: here,
  entryPoints: { page: "src/page.js" },
  outdir: target,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "eof",
  charset: "utf8",
  logLevel: "warning",
});
copyFileSync(join(here, "node_modules", "three", "LICENSE"), join(target, "three-license.txt"));
for (const name of ["index.html", "favicon.svg"]) copyFileSync(join(here, "src", name), join(target, name));

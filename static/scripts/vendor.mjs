// Copies the browser libraries that the lock file names into the ignored folder `vendor/`, from where
// the server serves them. Only what the page loads is copied, with its licence beside it.
import { copyFile, mkdir, rm, stat } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(dirname(fileURLToPath(import.meta.url)));

/** From the package's folder to the vendor folder. */
const FILES = [
  ["leaflet/dist/leaflet.js", "leaflet/leaflet.js"],
  ["leaflet/dist/leaflet.css", "leaflet/leaflet.css"],
  ["leaflet/LICENSE", "leaflet/LICENSE"],
];

const vendor = join(here, "vendor");
await rm(vendor, { recursive: true, force: true });
for (const [from, to] of FILES) {
  const source = join(here, "node_modules", from);
  await stat(source).catch(() => {
    console.error(`${from} is not installed: run \`npm ci\` in static/ first.`);
    process.exit(1);
  });
  await mkdir(dirname(join(vendor, to)), { recursive: true });
  await copyFile(source, join(vendor, to));
}
console.log(`static/vendor: ${FILES.length} files`);

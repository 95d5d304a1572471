// Bundles the tests of a folder and runs them with node's own test runner: node test/run.mjs unit|e2e
import { spawnSync } from "node:child_process";
import { mkdirSync, readdirSync, rmSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const root = fileURLToPath(new URL("..", import.meta.url));
const folder = process.argv[2];
const outdir = `${root}out/test-${folder}`;
rmSync(outdir, { recursive: true, force: true });
mkdirSync(outdir, { recursive: true });
const entryPoints = readdirSync(`${root}test/${folder}`).filter((name) => name.endsWith(".test.ts")).map((name) => `${root}test/${folder}/${name}`);
await build({ entryPoints, outdir, bundle: true, platform: "node", format: "esm", target: "node18", packages: "external", outExtension: { ".js": ".mjs" }, logLevel: "warning" });
const files = readdirSync(outdir).map((name) => `${outdir}/${name}`);
const { status } = spawnSync(process.execPath, ["--test", "--test-concurrency=1", ...files], { stdio: "inherit", cwd: root, env: { ...process.env, VIEWER: root } });
process.exit(status ?? 1);

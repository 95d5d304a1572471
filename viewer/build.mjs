// Bundles src/ into one self-contained page, ../assets/report/template.html: the same bytes on every machine.
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const target = process.argv[2] ?? here("../assets/report/template.html");

const bundle = async (entry) => {
    const result = await build({
        entryPoints: [here(entry)],
        bundle: true,
        minify: true,
        write: false,
        format: "iife",
        target: "es2022",
        charset: "utf8",
        legalComments: "none",
        loader: { ".glsl": "text" },
    });
    return result.outputFiles[0].text.trim();
};

const script = await bundle("src/main.ts");
const style = await bundle("src/style.css");
for (const [name, text] of [["script", script], ["style", style]]) {
    if (/<\/(script|style)|<!--/i.test(text)) throw new Error(`the ${name} holds a sequence that would end its element`);
}
const page = await readFile(here("src/page.html"), "utf8");
const licence = (await readFile(here("node_modules/three/LICENSE"), "utf8")).trim();
const whole = page
    .replace("/*STYLE*/", () => style)
    .replace("/*SCRIPT*/", () => `/* contains three.js:\n${licence} */\n${script}`);
await mkdir(here("../assets/report"), { recursive: true });
await writeFile(target, whole);
console.log(`${target}: ${Math.round(whole.length / 1024)} KiB`);

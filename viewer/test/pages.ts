/** Writes report pages as the program does: data in the place of the template's marks. */
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import type { Report } from "../src/data/report.ts";
import { sampleRecording } from "./sample.ts";

/** The folder of this project. */
export const HERE = resolve(process.env["VIEWER"] ?? ".");

/** A page out of the template: report, recordings by label. */
export function page(report: Report | string, recordings: { label: string; bytes: Uint8Array }[]): string {
    const template = readFileSync(resolve(HERE, "../assets/report/template.html"), "utf8");
    const json = typeof report === "string" ? report : JSON.stringify(report).replaceAll("<", "\\u003c");
    const several = recordings.length > 1;
    const blocks = recordings.map(({ label, bytes }, index) =>
        `<script type="application/octet-stream" id="recording${several ? `-${index}` : ""}" data-label="${label}">${Buffer.from(bytes).toString("base64")}</script>`);
    return template
        .replace("<!--TROPISM:TITLE-->", () => "sample")
        .replace("<!--TROPISM:REPORT-->", () => `<script type="application/json" id="report">${json}</script>`)
        .replace("<!--TROPISM:RECORDINGS-->", () => blocks.join("\n"));
}

/** Writes a page into viewer/out and gives its address. */
export function writePage(name: string, html: string): string {
    const folder = resolve(HERE, "out");
    mkdirSync(folder, { recursive: true });
    writeFileSync(resolve(folder, name), html);
    return `file://${resolve(folder, name)}`;
}

/** The report that goes with sample recordings. */
export const SAMPLE_REPORT: Report = {
    kind: "run",
    title: "sample",
    description: "A synthetic run: a tissue that stretches, axons that converge",
    scenario: { seed: 1, tissue: { outline: { rectangle: { width: 800, height: 600 } } } },
    notes: ["cue `repellent`: edges of about 25 um are long for a decay length of 55 um; a quarter is advised"],
    command: "tropism scenarios/sample.json",
    cite: "cff-version: 1.2.0\ntitle: tropism",
    version: "0.1.0",
    linkage_distance: 10,
};

/** A chart of two methods. */
export const SAMPLE_CHART: Report["chart"] = {
    factors: [{
        title: "Steps in time",
        sentence: "Of the settings tried, midpoint is faster at every error.",
        x_label: "error of the tips (um)",
        y_label: "time (s)",
        methods: [
            { name: "euler", points: [1, 2, 4, 8].map((n) => ({ time_s: 0.1 * n, error: 3 / n, setting: `step = ${60 / n} min`, front: n === 1, default: false })) },
            { name: "midpoint", points: [1, 2, 4, 8].map((n) => ({ time_s: 0.17 * n, error: 0.6 / n ** 2, setting: `step = ${60 / n} min`, front: true, default: n === 2 })) },
        ],
    }],
};

/** The small sample recording. */
export const smallSample = (seed = 1): Uint8Array => sampleRecording({ axons: 500, vertices: 60, frames: 37, columns: 32, struck: 0.1 }, seed);

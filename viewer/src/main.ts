/** Reads the page's data and builds the page, or says in it what is wrong. */
import { bytesOfBase64, openContainer } from "./data/container.ts";
import { readRecording } from "./data/recording.ts";
import { embeddedRecordings, readReport, type Report } from "./data/report.ts";
import { chartFigures } from "./ui/chart.ts";
import { documents } from "./ui/documents.ts";
import { h } from "./ui/dom.ts";
import { type Run, Runs } from "./ui/runs.ts";
import { Theme } from "./ui/theme.ts";

const app = document.getElementById("app") as HTMLElement;
let runs: Runs | null = null;
const theme = new Theme(() => runs?.restyle());

async function readRuns(): Promise<Run[]> {
    const blocks = embeddedRecordings(document);
    return Promise.all(blocks.map(async ({ label, base64 }) => ({ label, recording: readRecording(await openContainer(bytesOfBase64(base64))) })));
}

function failure(error: unknown): HTMLElement {
    const text = error instanceof Error ? error.message : String(error);
    return h("section", { class: "failure", role: "alert" }, h("h2", {}, "This report cannot be shown whole"), h("p", {}, text),
        h("p", {}, "What else the file holds stands below. Run the scene again for a new report."));
}

function header(report: Report, run: Run | undefined): HTMLElement {
    const description = report.description || run?.recording.description;
    const { seed } = run?.recording ?? {};
    const about = [run ? `${run.recording.axonCount} axons` : "", typeof seed === "number" ? `seed ${seed}` : ""].filter(Boolean).join(", ");
    return h("header", {},
        h("div", {}, h("h1", {}, report.title || run?.recording.scene || "tropism"), description ? h("p", {}, description) : null, about ? h("p", { class: "small" }, about) : null),
        h("button", { type: "button", class: "theme", id: "theme", "aria-label": "Dark or light", title: "Dark or light", click: theme.switch }, "◐"));
}

async function start(): Promise<void> {
    const faults: unknown[] = [];
    let report: Report = {};
    let all: Run[] = [];
    try {
        report = readReport(document);
        all = await readRuns();
    } catch (error) {
        faults.push(error);
    }
    const factors = report.chart?.factors ?? [];
    if (faults.length === 0 && all.length === 0 && factors.length === 0) faults.push(new Error("The file holds neither a recording nor a chart."));
    app.replaceChildren(header(report, all[0]));
    if (all.length > 0) {
        try {
            runs = new Runs(all, report, theme);
            app.append(runs.element);
            runs.start();
        } catch (error) {
            faults.push(new Error(`The picture needs WebGL 2, which this browser did not give: ${(error as Error).message}`));
        }
    }
    app.append(...faults.map(failure), ...(factors.length > 0 ? [chartFigures(factors)] : []), h("div", { class: "documents" }, ...documents(report)));
    document.documentElement.dataset["ready"] = "true";
}

void start();

/** What lies in the page beside the recordings: every key may be absent. */

/** One setting that was tried in a chart. */
export interface ChartPoint {
    time_s: number;
    error: number;
    setting?: string;
    /** Whether nothing is both faster and more accurate. */
    front?: boolean;
    /** Whether it is what the program does unless told otherwise. */
    default?: boolean;
}

/** The settings of one method. */
export interface ChartMethod {
    name: string;
    points: ChartPoint[];
}

/** One comparison of methods. */
export interface ChartFactor {
    title?: string;
    sentence?: string;
    x_label?: string;
    y_label?: string;
    methods?: ChartMethod[];
}

/** The document beside the recordings. */
export interface Report {
    kind?: string;
    title?: string;
    description?: string;
    scenario?: unknown;
    summary?: unknown;
    notes?: string[];
    command?: string;
    cite?: string;
    version?: string;
    linkage_distance?: number;
    measures?: Record<string, number[]>;
    chart?: { factors?: ChartFactor[] };
}

/** A recording that the page holds, still as text. */
export interface Embedded {
    label: string;
    base64: string;
}

/** Reads the document of the page; a page without one has an empty report. */
export function readReport(page: Document): Report {
    const text = page.getElementById("report")?.textContent ?? "";
    if (text.trim() === "") return {};
    const report: unknown = JSON.parse(text);
    return typeof report === "object" && report !== null ? (report as Report) : {};
}

/** The recordings of the page in order: `recording`, or `recording-0`, `recording-1`, … */
export function embeddedRecordings(page: Document): Embedded[] {
    const blocks = [...page.querySelectorAll<HTMLScriptElement>('script[id^="recording"]')];
    return blocks.map((block) => ({ label: block.dataset["label"] ?? "", base64: block.textContent ?? "" }));
}

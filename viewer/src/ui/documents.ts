/** What stands around the picture: warnings, scenario, summary, how to run again and how to cite. */
import type { Report } from "../data/report.ts";
import { h } from "./dom.ts";

/** All parts that the report has. */
export function documents(report: Report): HTMLElement[] {
    const notes = report.notes ?? [];
    return [
        notes.length > 0 ? h("section", { class: "notes" }, h("h2", {}, "Warnings and notes"), h("ul", {}, ...notes.map((note) => h("li", {}, ...said(note))))) : null,
        report.command ? h("section", {}, h("h2", {}, "Run again"),
            copyable("Run again", report.command),
            report.version ? h("p", { class: "small" }, `Made by tropism ${report.version}.`) : null) : null,
        folded("Cite", report.cite || null),
        folded("Scenario", report.scenario),
        folded("Summary", report.summary),
    ].filter((part) => part !== null);
}

/** A note of the program as it is printed: what stands between backticks as code, µm for um. */
function said(note: string): (Node | string)[] {
    return note.split("`").map((part, i) => (i % 2 === 1 ? h("code", {}, part) : part.replace(/(?<=\d )um\b/g, "µm")));
}

function folded(title: string, value: unknown): HTMLElement | null {
    if (value === undefined || value === null) return null;
    const text = typeof value === "string" ? value : JSON.stringify(value, null, 2);
    return h("section", {}, h("details", {}, h("summary", {}, h("h2", {}, title)), copyable(title, text)));
}

function copyable(label: string, text: string): HTMLElement {
    const block = h("pre", { tabindex: 0, "aria-label": label }, text);
    const button = h("button", { type: "button", class: "copy", click: () => void copy() }, "Copy");
    const copy = async (): Promise<void> => {
        try {
            await navigator.clipboard.writeText(text);
            button.textContent = "Copied";
        } catch {
            window.getSelection()?.selectAllChildren(block);
            button.textContent = "Selected";
        }
    };
    return h("div", { class: "copyable" }, block, button);
}

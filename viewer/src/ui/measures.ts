/** The measures over time: one small figure each, counts together, with the present time marked. */
import { statusLook } from "../gl/cones.ts";
import { CATEGORIES, css } from "../numbers/colours.ts";
import { framesAround } from "../numbers/moment.ts";
import { roundUp, written } from "../numbers/scales.ts";
import { h, svg } from "./dom.ts";
import { type Frame, frame } from "./plot.ts";

/** The measures of one run: columns over `time`. */
export interface Measures {
    label: string;
    columns: Record<string, number[]>;
}

interface Line {
    name: string;
    times: number[];
    values: number[];
}

const COUNTS = ["born", "growing", "arrived", "stalled", "left", "retracting", "withdrawn"];
const UNITS: [RegExp, string][] = [[/_um$/, "µm"], [/_h$/, "h"], [/_deg$/, "°"], [/length/, "µm"], [/speed/, "µm/h"]];
const DASHES = ["", "6 3", "2 2.5", "8 3 2 3", "1 3"];

/** The figures of all measures. */
export class MeasureFigures {
    readonly element = h("div", { class: "plots" });
    private readonly figures: { frame: Frame; lines: Line[]; cursor: SVGElement; values: HTMLElement[] }[] = [];

    constructor(runs: Measures[], private readonly goTo: (time: number) => void) {
        const names = [...new Set(runs.flatMap(({ columns }) => Object.keys(columns)))].filter((name) => name !== "time");
        const column = (run: Measures, name: string): Line => ({ name, times: run.columns["time"] ?? [], values: run.columns[name] ?? [] });
        const counts = COUNTS.filter((name) => names.includes(name) && runs.some(({ columns }) => (columns[name] ?? []).some((value) => value > 0)));
        if (runs.length === 1 && counts.length > 1) this.add("Axons", "axons", counts.map((name) => column(runs[0], name)));
        for (const name of names) {
            if (COUNTS.includes(name) && (runs.length === 1 ? counts.length > 1 : !counts.includes(name))) continue;
            const lines = runs.filter(({ columns }) => columns[name]).map((run) => ({ ...column(run, name), name: runs.length > 1 ? run.label : name }));
            this.add(words(name), COUNTS.includes(name) ? "axons" : unitOf(name), lines);
        }
    }

    /** Marks the present time. */
    show(time: number): void {
        for (const { frame: { x, root }, cursor, lines, values } of this.figures) {
            const at = x(time);
            cursor.setAttribute("d", `M${at} 8V${root.viewBox.baseVal.height - 34}`);
            lines.forEach((line, i) => (values[i].textContent = written(valueAt(line, time))));
        }
    }

    private add(title: string, unit: string, all: Line[]): void {
        const lines = all.filter(({ times, values }) => times.length > 1 && values.length === times.length);
        const finite = lines.flatMap(({ values }) => values).filter((value) => Number.isFinite(value));
        if (finite.length === 0) return;
        const [least, most] = finite.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [0, -Infinity]);
        const times = lines.map((line) => line.times);
        const x = { low: Math.min(...times.map((list) => list[0])), high: Math.max(...times.map((list) => list[list.length - 1])), logarithmic: false, label: "time (h)" };
        const y = { low: least < 0 ? -roundUp(-least) : 0, high: most > 0 ? nicely(most) : 1, logarithmic: false, label: unit };
        const figure = frame(320, 190, x, y, `${title} over time`);
        lines.forEach((line, i) => figure.root.append(svg("path", { d: path(line, figure), class: "line", style: `--tone:${colourOf(line.name, i)}`, "stroke-dasharray": DASHES[Math.floor(i / CATEGORIES.length) % DASHES.length] })));
        const cursor = svg("path", { class: "cursor" });
        figure.root.append(cursor);
        const pick = (event: PointerEvent): void => { if (event.buttons & 1) this.goTo(figure.valueAt(event.clientX)); };
        figure.root.addEventListener("pointerdown", pick);
        figure.root.addEventListener("pointermove", pick);
        const values = lines.map(() => h("b", {}));
        const keys = lines.map(({ name }, i) => h("li", {}, h("span", { class: "swatch line", style: `--tone:${colourOf(name, i)}` }), `${words(name)} `, values[i]));
        this.figures.push({ frame: figure, lines, cursor, values });
        this.element.append(h("figure", {}, h("figcaption", {}, title.charAt(0).toUpperCase() + title.slice(1)), figure.root, h("ul", { class: "marks" }, ...keys)));
    }
}

function path({ times, values }: Line, { x, y }: Frame): string {
    let pen = "M";
    return values.map((value, i) => {
        if (!Number.isFinite(value)) { pen = "M"; return ""; }
        const piece = `${pen}${x(times[i]).toFixed(1)} ${y(value).toFixed(1)}`;
        pen = "L";
        return piece;
    }).join("");
}

function valueAt({ times, values }: Line, time: number): number {
    const { before, after, share } = framesAround(times, time);
    return values[before] + share * (values[after] - values[before]);
}

/** The next round number with two digits' freedom, so that lines use the height. */
function nicely(value: number): number {
    const unit = 10 ** Math.floor(Math.log10(value));
    return [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10].map((step) => step * unit).find((step) => step >= value * 0.999) ?? value;
}

/** Counts have the colours of their cones, births blue, everything else its turn. */
function colourOf(name: string, index: number): string {
    return css(name === "retracting" ? CATEGORIES[3] : name !== "born" && COUNTS.includes(name) ? statusLook(name).colour : CATEGORIES[index % CATEGORIES.length]);
}

function words(name: string): string {
    return name.replace(/_(um|h|deg)$/, "").replaceAll("_", " ");
}

function unitOf(name: string): string {
    return UNITS.find(([pattern]) => pattern.test(name))?.[1] ?? "";
}

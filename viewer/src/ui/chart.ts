/** Work-precision figures: time over error, a mark a setting; hovering or focusing a mark tells its setting. */
import type { ChartFactor, ChartPoint } from "../data/report.ts";
import { CATEGORIES, css } from "../numbers/colours.ts";
import { written } from "../numbers/scales.ts";
import { h, svg } from "./dom.ts";
import { frame } from "./plot.ts";

const SYMBOLS = ["M0-5a5 5 0 1 0 .01 0z", "M0-6l6 6-6 6-6-6z", "M-4.5-4.5h9v9h-9z", "M0-5.8l6 10.4h-12z", "M0 5.8l6-10.4h-12z", "M-6-2h4v-4h4v4h4v4h-4v4h-4v-4h-4z"];

/** The figures of all factors. */
export function chartFigures(factors: ChartFactor[]): HTMLElement {
    return h("div", { class: "charts" }, ...factors.map(factorFigure));
}

function factorFigure(factor: ChartFactor): HTMLElement {
    const methods = (factor.methods ?? []).map(({ name, points }) => ({ name, points: points.filter(({ time_s, error }) => time_s > 0 && error > 0) }));
    const points = methods.flatMap((method) => method.points);
    const heading = h("h2", {}, factor.title ?? "Error against time");
    const sentence = factor.sentence ? h("p", {}, factor.sentence) : null;
    if (points.length === 0) return h("section", { class: "chart" }, heading, sentence, h("p", {}, "No setting has both a time and an error."));
    const ends = (values: number[]): { low: number; high: number } => ({ low: Math.min(...values) / 1.6, high: Math.max(...values) * 1.6 });
    const x = { ...ends(points.map(({ error }) => error)), logarithmic: true, label: factor.x_label ?? "error" };
    const y = { ...ends(points.map(({ time_s }) => time_s)), logarithmic: true, label: factor.y_label ?? "time (s)" };
    const figure = frame(560, 380, x, y, `${factor.title ?? "Chart"}: time over error`);
    const told = h("p", { class: "told", "aria-live": "polite" }, "Point at a mark for its setting.");
    methods.forEach(({ name, points: settings }, i) => {
        const colour = css(CATEGORIES[i % CATEGORIES.length]);
        const line = [...settings].sort((a, b) => a.error - b.error).map(({ time_s, error }, k) => `${k ? "L" : "M"}${figure.x(error).toFixed(1)} ${figure.y(time_s).toFixed(1)}`).join("");
        figure.root.append(svg("path", { d: line, class: "line thin", style: `--tone:${colour}` }));
        for (const point of settings) figure.root.append(mark(name, point, i, colour, figure.x(point.error), figure.y(point.time_s), told));
    });
    const keys = methods.map(({ name }, i) => h("li", {}, svg("svg", { viewBox: "-7 -7 14 14", class: "mark" }, svg("path", { d: SYMBOLS[i % SYMBOLS.length], fill: css(CATEGORIES[i % CATEGORIES.length]) })), name));
    const notes = [
        points.some(({ front }) => front) ? h("li", {}, svg("svg", { viewBox: "-7 -7 14 14", class: "mark" }, svg("path", { d: SYMBOLS[0], class: "front" })), "nothing is both faster and more accurate") : null,
        points.some((point) => point.default) ? h("li", {}, svg("svg", { viewBox: "-12 -12 24 24", class: "mark" }, svg("circle", { r: 10, class: "default" })), "the default") : null,
    ];
    return h("section", { class: "chart" }, heading, sentence, figure.root, told, h("ul", { class: "marks" }, ...keys, ...notes));
}

function mark(name: string, point: ChartPoint, index: number, colour: string, x: number, y: number, told: HTMLElement): SVGElement {
    const text = `${name}${point.setting ? `, ${point.setting}` : ""}: ${written(point.time_s)} s, error ${written(point.error)}${point.default ? " (the default)" : ""}`;
    const tell = (): void => { told.textContent = text; };
    return svg("g", { transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})`, tabindex: 0, role: "img", "aria-label": text, class: "setting", pointerenter: tell, focus: tell, click: tell },
        svg("title", {}, text),
        point.default ? svg("circle", { r: 10, class: "default" }) : null,
        svg("path", { d: SYMBOLS[index % SYMBOLS.length], fill: colour, class: point.front ? "front" : "" }),
        svg("circle", { r: 12, fill: "transparent" }));
}

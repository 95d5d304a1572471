/** The legend: what the tissue's colours, the axons' colours and the cones' shapes mean, with units. */
import { type Shape, statusLook } from "../gl/cones.ts";
import type { Look } from "../gl/pane.ts";
import type { Shown } from "../gl/tissue.ts";
import type { LegendEntry } from "../numbers/axon_colours.ts";
import { css, cssGradient, mapColour } from "../numbers/colours.ts";
import { decades, powerOfTen, ticks, written } from "../numbers/scales.ts";
import { h, svg } from "./dom.ts";

/** All entries. */
export function legend(look: Look, axons: LegendEntry[], statuses: string[], sentence: string): HTMLElement {
    const { attract, repel } = look.cues;
    const bars = look.layers.tissue
        ? ([["attract", attract], ["repel", repel]] as const).flatMap(([effect, shown]) => (shown ? [cueBar(look, effect, shown)] : []))
        : [];
    const marks = look.layers.cones ? statuses.map((word) => h("li", {}, mark(word, look.colour === "ink"), word)) : [];
    return h("div", { class: "legend" },
        ...bars,
        ...axons.filter((entry) => "bar" in entry).map((entry) => bar(entry)),
        h("ul", { class: "marks" }, ...axons.flatMap((entry) => ("swatch" in entry ? [h("li", {}, h("span", { class: "swatch", style: `background:${entry.swatch}` }), entry.text)] : [])), ...marks,
            look.layers.targets ? h("li", {}, lineKey("5 3.5"), "target") : null,
            look.layers.start ? h("li", {}, lineKey("2 3"), "outline at the start") : null),
        sentence ? h("p", { class: "small" }, sentence) : null,
    );
}

function cueBar(look: Look, effect: "attract" | "repel", { range, cues }: Shown): HTMLElement {
    const { map, logarithmic } = look.cues;
    const caption = cues.length === 1 ? `${cues[0]}, c (nM)` : `${effect === "attract" ? "attractive" : "repulsive"} cues, sum of c (nM)`;
    const low = logarithmic ? range.low : 0;
    const place = (value: number): number => 100 * (logarithmic ? Math.log(value / range.low) / Math.log(range.high / range.low) : value / range.high);
    const values = logarithmic ? decades(range.low, range.high) : ticks(0, range.high, 4);
    const text = (value: number): string => (logarithmic ? `${value <= low * 1.001 ? "≤" : ""}${powerOfTen(value)}` : written(value));
    return h("figure", { class: "bar" },
        h("figcaption", {}, caption),
        h("div", { class: "ramp", style: `background:${cssGradient((share) => mapColour(map, effect, share, look.dark))}` }),
        h("div", { class: "ticks" }, ...values.map((value) => h("span", { style: `left:${place(value).toFixed(1)}%` }, text(value)))),
    );
}

function bar(entry: { bar: string; text: string; ends: [string, string] }): HTMLElement {
    return h("figure", { class: "bar" },
        h("figcaption", {}, entry.text),
        h("div", { class: "ramp", style: `background:${entry.bar}` }),
        h("div", { class: "ticks" }, h("span", { style: "left:0" }, entry.ends[0]), h("span", { style: "left:100%" }, entry.ends[1])),
    );
}

const PATHS: Record<Shape, string> = {
    circle: "M6 2a4 4 0 1 0 .01 0z",
    diamond: "M6 1.2l4.8 4.8-4.8 4.8-4.8-4.8z",
    square: "M2.4 2.4h7.2v7.2h-7.2z",
    triangle: "M6 1.5l4.8 8.6h-9.6z",
};

function mark(word: string, coloured: boolean): SVGElement {
    const { shape, colour } = statusLook(word);
    return svg("svg", { viewBox: "0 0 12 12", class: "mark", "aria-hidden": "true" }, svg("path", { d: PATHS[shape], fill: coloured ? css(colour) : "currentColor" }));
}

function lineKey(dashes: string): SVGElement {
    return svg("svg", { viewBox: "0 0 20 12", class: "key", "aria-hidden": "true" }, svg("path", { d: "M0 6h20", stroke: "currentColor", "stroke-width": 1.6, "stroke-dasharray": dashes }));
}

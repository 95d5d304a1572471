/** The frame of a small figure in SVG: axes with ticks, and the place of a value on either. */
import { decades, powerOfTen, ticks, written } from "../numbers/scales.ts";
import { svg } from "./dom.ts";

/** One axis. */
export interface Axis {
    low: number;
    high: number;
    logarithmic: boolean;
    label: string;
}

/** A figure to draw into, and where values lie. */
export interface Frame {
    root: SVGSVGElement;
    x(value: number): number;
    y(value: number): number;
    /** The value under a place of the page. */
    valueAt(clientX: number): number;
}

const MARGIN = { left: 46, right: 12, top: 8, bottom: 34 };

/** A figure of some size with axes, ticks and labels. */
export function frame(width: number, height: number, x: Axis, y: Axis, label: string): Frame {
    const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label, class: "plot" });
    const [left, right, top, bottom] = [MARGIN.left, width - MARGIN.right, MARGIN.top, height - MARGIN.bottom];
    const placeX = (value: number): number => left + (right - left) * share(x, value);
    const placeY = (value: number): number => bottom - (bottom - top) * share(y, value);
    for (const [value, text] of marks(x, 5)) {
        const at = placeX(value);
        root.append(svg("path", { d: `M${at} ${top}V${bottom}`, class: "grid" }), svg("text", { x: at, y: bottom + 13, "text-anchor": "middle" }, text));
    }
    for (const [value, text] of marks(y, 4)) {
        const at = placeY(value);
        root.append(svg("path", { d: `M${left} ${at}H${right}`, class: "grid" }), svg("text", { x: left - 5, y: at + 3.5, "text-anchor": "end" }, text));
    }
    root.append(
        svg("path", { d: `M${left} ${top}V${bottom}H${right}`, class: "axis" }),
        svg("text", { x: (left + right) / 2, y: height - 5, "text-anchor": "middle", class: "label" }, x.label),
        svg("text", { x: 10, y: (top + bottom) / 2, "text-anchor": "middle", class: "label", transform: `rotate(-90 10 ${(top + bottom) / 2})` }, y.label),
    );
    const valueAt = (clientX: number): number => {
        const { left: edge, width: extent } = root.getBoundingClientRect();
        const at = (((clientX - edge) / extent) * width - left) / (right - left);
        return x.logarithmic ? x.low * (x.high / x.low) ** at : x.low + at * (x.high - x.low);
    };
    return { root, x: placeX, y: placeY, valueAt };
}

function share(axis: Axis, value: number): number {
    if (axis.logarithmic) return Math.log(value / axis.low) / Math.log(axis.high / axis.low);
    return axis.high > axis.low ? (value - axis.low) / (axis.high - axis.low) : 0.5;
}

function marks(axis: Axis, count: number): [number, string][] {
    if (!axis.logarithmic) return ticks(axis.low, axis.high, count).map((value) => [value, written(value)]);
    const all = decades(axis.low, axis.high);
    const every = Math.max(1, Math.ceil(all.length / (count + 2)));
    return all.filter((_, i) => i % every === 0).map((value) => [value, powerOfTen(value)]);
}

/** Scales: round numbers, ticks, ranges of concentration, and how numbers are written. */

/** The largest of 1, 2, 5 times a power of ten that is at most a positive value. */
export function roundDown(value: number): number {
    const decade = 10 ** Math.floor(Math.log10(value) + 1e-12);
    return [5, 2, 1].map((step) => step * decade).find((step) => step <= value * (1 + 1e-12)) ?? decade;
}

/** Evenly spaced round numbers within a range, about `count` of them. */
export function ticks(low: number, high: number, count: number): number[] {
    if (!(high > low)) return [low];
    const step = roundUp((high - low) / count);
    const first = Math.ceil(low / step - 1e-9);
    return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** The smallest of 1, 2, 5 times a power of ten that is at least a positive value. */
export function roundUp(value: number): number {
    const decade = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].map((step) => step * decade).find((step) => step >= value * (1 - 1e-9)) ?? 10 * decade;
}

/** The powers of ten within a range of positive numbers. */
export function decades(low: number, high: number): number[] {
    const first = Math.ceil(Math.log10(low) - 1e-9);
    const last = Math.floor(Math.log10(high) + 1e-9);
    return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => 10 ** (first + i));
}

/** A range of concentrations in nM. */
export interface Range {
    low: number;
    high: number;
}

/** The range of a cue, as in the program's figures: up to just above the maximum, down to two decades below. */
export function concentrationRange(least: number, most: number): Range {
    if (!(most > 0)) return { low: 0.01, high: 1 };
    const high = roundUp(most);
    const lowest = Math.min(Math.max(least, 1e-2 * most), 0.1 * high) * (1 + 1e-9);
    return { low: 10 ** Math.floor(Math.log10(lowest)), high };
}

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** A power of ten in digits where that is short, else with a superscript. */
export function powerOfTen(value: number): string {
    const exponent = Math.round(Math.log10(value));
    if (exponent >= -3 && exponent <= 3) return String(Number(value.toPrecision(3)));
    const digits = String(Math.abs(exponent)).replace(/\d/g, (digit) => SUPERSCRIPTS[Number(digit)]);
    return `10${exponent < 0 ? "⁻" : ""}${digits}`;
}

/** A number with about three digits; an en dash for none. */
export function written(value: number | null | undefined, digits = 3): string {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
        const exponent = Math.floor(Math.log10(size));
        return `${Number((value / 10 ** exponent).toFixed(1))} × ${powerOfTenExact(exponent)}`;
    }
    const rounded = size >= 10 ** digits ? Math.round(value) : Number(value.toPrecision(digits));
    return String(rounded).replace("-", "−");
}

function powerOfTenExact(exponent: number): string {
    const digits = String(Math.abs(exponent)).replace(/\d/g, (digit) => SUPERSCRIPTS[Number(digit)]);
    return `10${exponent < 0 ? "⁻" : ""}${digits}`;
}

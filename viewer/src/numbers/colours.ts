/**
 * Colours. Tints of cues are built in OKLab as in the program's figures: purple for attraction, light blue for repulsion,
 * set apart in hue and lightness so that red-green-blind readers tell them apart. Categories are Okabe and Ito's.
 */

/** Red, green, blue, 0…255. */
export type Rgb = [number, number, number];

/** Okabe and Ito's colours for the colour-blind, without black and yellow (too weak on white). */
export const CATEGORIES: Rgb[] = [
    [0x00, 0x72, 0xb2], [0xd5, 0x5e, 0x00], [0x00, 0x9e, 0x73], [0xcc, 0x79, 0xa7], [0xe6, 0x9f, 0x00], [0x56, 0xb4, 0xe9],
];

/** The maps a cue can be drawn with. */
export const MAPS = ["tint", "viridis", "cividis"] as const;
export type MapName = (typeof MAPS)[number];

const VIRIDIS = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"].map(hexadecimal);

/** Viridis at a share 0…1. */
export function viridis(share: number): Rgb {
    const position = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
    const below = Math.min(Math.floor(position), VIRIDIS.length - 2);
    return mixed(VIRIDIS[below], VIRIDIS[below + 1], position - below);
}

/** Cividis at a share 0…1, by the polynomials of d3-scale-chromatic. */
export function cividis(share: number): Rgb {
    const t = Math.min(Math.max(share, 0), 1);
    const channel = (value: number): number => Math.round(Math.min(Math.max(value, 0), 255));
    return [
        channel(-4.54 - t * (35.34 - t * (2381.73 - t * (6402.7 - t * (7024.72 - t * 2710.57))))),
        channel(32.49 + t * (170.73 + t * (52.82 - t * (131.46 - t * (176.58 - t * 67.37))))),
        channel(81.24 + t * (442.36 - t * (2482.43 - t * (6167.24 - t * (6614.94 - t * 2475.67))))),
    ];
}

/** A colour of the circle of hues at a share 0…1 of the turn, of even lightness. */
export function cyclic(share: number, dark: boolean): Rgb {
    return okLch(dark ? 0.75 : 0.58, 0.125, 360 * share + 20);
}

/** Tissue without cues. */
export function tissueColour(dark: boolean): Rgb {
    return dark ? [0x26, 0x25, 0x2a] : [0xf7, 0xf5, 0xf1];
}

/** The tint of an effect on bare tissue at a share 0…1. */
export function tint(effect: "attract" | "repel", share: number, dark: boolean): Rgb {
    const full = effect === "attract" ? { light: 0.68, chroma: 0.14, hue: 300 } : { light: 0.88, chroma: 0.08, hue: 210 };
    const base = tissueColour(dark).map(toLinear);
    if (dark) {
        const top = okLch(effect === "attract" ? 0.55 : 0.6, full.chroma, full.hue).map(toLinear);
        return base.map((channel, i) => toEncoded(channel + share ** 1.6 * (top[i] - channel))) as Rgb;
    }
    const ink = okLch(1 - share * (1 - full.light), share * full.chroma, full.hue).map(toLinear);
    return base.map((channel, i) => toEncoded(channel * ink[i])) as Rgb;
}

/** The table of a map over 256 shares, RGBA. */
export function mapTable(map: MapName, effect: "attract" | "repel", dark: boolean): Uint8Array<ArrayBuffer> {
    const table = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) table.set([...mapColour(map, effect, i / 255, dark), 255], 4 * i);
    return table;
}

/** The colour of a map at a share. */
export function mapColour(map: MapName, effect: "attract" | "repel", share: number, dark: boolean): Rgb {
    return map === "viridis" ? viridis(share) : map === "cividis" ? cividis(share) : tint(effect, share, dark);
}

/** `rgb(…)` of a colour. */
export function css([r, g, b]: Rgb): string {
    return `rgb(${r} ${g} ${b})`;
}

/** A CSS gradient from left to right through a map. */
export function cssGradient(colour: (share: number) => Rgb): string {
    return `linear-gradient(90deg, ${Array.from({ length: 17 }, (_, i) => css(colour(i / 16))).join(", ")})`;
}

/** A colour between two. */
export function mixed(one: Rgb, other: Rgb, share: number): Rgb {
    return one.map((channel, i) => Math.round(channel + share * (other[i] - channel))) as Rgb;
}

function hexadecimal(text: string): Rgb {
    return [0, 2, 4].map((at) => Number.parseInt(text.slice(at, at + 2), 16)) as Rgb;
}

function toLinear(channel: number): number {
    const encoded = channel / 255;
    return encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4;
}

function toEncoded(linear: number): number {
    const channel = Math.min(Math.max(linear, 0), 1);
    return Math.round(255 * (channel <= 0.0031308 ? 12.92 * channel : 1.055 * channel ** (1 / 2.4) - 0.055));
}

/** Lightness 0…1, chroma and hue in degrees of OKLab (B. Ottosson, 2020). */
function okLch(lightness: number, chroma: number, hue: number): Rgb {
    const [a, b] = [chroma * Math.cos((hue * Math.PI) / 180), chroma * Math.sin((hue * Math.PI) / 180)];
    const long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
    const medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
    const short = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
    return [
        toEncoded(4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short),
        toEncoded(-1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short),
        toEncoded(-0.0041960863 * long - 0.7034186147 * medium + 1.707614701 * short),
    ];
}

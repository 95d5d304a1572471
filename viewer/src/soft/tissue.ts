/** The tissue painted by the processor: triangles, coloured by the concentrations at their corners. */
import type { CueChoice } from "../gl/tissue.ts";
import { mapColour, type Rgb, tissueColour } from "../numbers/colours.ts";
import type { Range } from "../numbers/scales.ts";
import { packed, type Raster } from "./raster.ts";

/** Steps of a colour map, and of a concentration in it. */
const STEPS = 128;
const FINE = 8192;

/** The colours of pairs of concentrations, and the painting with them. */
export class PaintedTissue {
    /** Colours of two steps of the maps: repelling, then attracting. */
    private readonly palette = new Int32Array(STEPS * STEPS);
    /** Steps of the maps for concentrations of 0…{@link FINE}. */
    private steps: [Uint8Array, Uint8Array] = [new Uint8Array(FINE + 1), new Uint8Array(FINE + 1)];
    /** From nM to 0…{@link FINE}. */
    private scales: [number, number] = [0, 0];
    /** Corners of the triangle in hand, kept so that painting makes no garbage. */
    private readonly xs = new Float64Array(3);
    private readonly ys = new Float64Array(3);
    private readonly ones = new Float64Array(3);
    private readonly others = new Float64Array(3);

    /** Prepares colours. */
    choose({ attract, repel, map, logarithmic }: CueChoice, dark: boolean): void {
        const colours = (effect: "attract" | "repel"): Rgb[] => Array.from({ length: STEPS }, (_, i) => mapColour(map, effect, i / (STEPS - 1), dark));
        const [one, other, base] = [colours("attract"), colours("repel"), tissueColour(dark)];
        for (let i = 0; i < STEPS * STEPS; i++) {
            const [a, b] = [one[i % STEPS], other[Math.floor(i / STEPS)]];
            const both = (channel: number): number => {
                const [x, y, z] = [a, b, base].map((colour) => (colour[channel] / 255) ** 2.2);
                return Math.round(255 * Math.min(Math.max(dark ? x + y - z : (x * y) / z, 0), 1) ** (1 / 2.2));
            };
            const colour = attract && repel ? [both(0), both(1), both(2)] : attract ? a : repel ? b : base;
            this.palette[i] = packed(colour[0], colour[1], colour[2]);
        }
        this.steps = [stepsOf(attract?.range, logarithmic), stepsOf(repel?.range, logarithmic)];
        this.scales = [FINE / (attract?.range.high ?? 1), FINE / (repel?.range.high ?? 1)];
    }

    /** Paints cells on a mesh given in pixels; `concentrations` are [vertices, 4] with the cues in the last two. */
    paint(raster: Raster, cells: Uint32Array, meshPixels: Float32Array, concentrations: Float32Array): void {
        const { xs, ys, ones, others, scales } = this;
        for (let cell = 0; cell < cells.length; cell += 3) {
            for (let k = 0; k < 3; k++) {
                const vertex = cells[cell + k];
                xs[k] = meshPixels[2 * vertex];
                ys[k] = meshPixels[2 * vertex + 1];
                ones[k] = concentrations[4 * vertex + 2] * scales[0];
                others[k] = concentrations[4 * vertex + 3] * scales[1];
            }
            this.paintCell(raster);
        }
    }

    private paintCell(raster: Raster): void {
        const { xs, ys, ones, others, palette } = this;
        const [first, second] = this.steps;
        const { pixels, width } = raster;
        const x1 = xs[1] - xs[0];
        const x2 = xs[2] - xs[0];
        const y1 = ys[1] - ys[0];
        const y2 = ys[2] - ys[0];
        const area = x1 * y2 - x2 * y1;
        if (area === 0) return;
        const oneX = ((ones[1] - ones[0]) * y2 - (ones[2] - ones[0]) * y1) / area;
        const oneY = ((ones[2] - ones[0]) * x1 - (ones[1] - ones[0]) * x2) / area;
        const otherX = ((others[1] - others[0]) * y2 - (others[2] - others[0]) * y1) / area;
        const otherY = ((others[2] - others[0]) * x1 - (others[1] - others[0]) * x2) / area;
        const bottom = raster.rowsBelow(Math.max(ys[0], ys[1], ys[2]));
        for (let y = raster.rowsBelow(Math.min(ys[0], ys[1], ys[2])); y < bottom; y++) {
            raster.cut(xs, ys, y);
            const { from } = raster;
            let one = ones[0] + oneX * (from + 0.5 - xs[0]) + oneY * (y + 0.5 - ys[0]);
            let other = others[0] + otherX * (from + 0.5 - xs[0]) + otherY * (y + 0.5 - ys[0]);
            for (let at = y * width + from, end = y * width + raster.to; at < end; at++, one += oneX, other += otherX) {
                const column = first[one > FINE ? FINE : one < 0 ? 0 : one | 0];
                pixels[at] = palette[STEPS * second[other > FINE ? FINE : other < 0 ? 0 : other | 0] + column];
            }
        }
    }
}

/** Steps of the map for concentrations of 0…1 of the highest. */
function stepsOf(range: Range | undefined, logarithmic: boolean): Uint8Array {
    const table = new Uint8Array(FINE + 1);
    if (!range) return table;
    const low = range.low / range.high;
    for (let i = 0; i <= FINE; i++) {
        const share = logarithmic ? Math.max(0, Math.log(i / FINE / low) / Math.log(1 / low)) : i / FINE;
        table[i] = Math.round((STEPS - 1) * share);
    }
    return table;
}

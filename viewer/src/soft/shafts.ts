/** Shafts painted by the processor. */
import type { Recording } from "../data/recording.ts";
import { type Camera, pixelOf, type Size } from "../numbers/camera.ts";
import type { Moment } from "../numbers/moment.ts";
import { packed, type Raster } from "./raster.ts";

/** Vertices that may be painted in one picture while something moves. */
export const BUDGET = 100_000;

/** Every how many-th vertex of each shaft is painted while something moves: so many that the budget holds. */
export const movingStride = (vertices: number): number => Math.max(1, Math.ceil(vertices / BUDGET));

/** How shafts are painted. */
export interface ShaftPaint {
    /** [axons, 4] colours; no opacity where hidden. */
    colours: Uint8Array;
    /** Colours of directions where shafts are coloured by them, four bytes each. */
    hues: Uint8Array | null;
    /** Opacity of shafts. */
    opacity: number;
    /** Every how many-th vertex is painted. */
    stride: number;
    /** Whether lines have the nearest dots alone, without smooth edges. */
    rough: boolean;
}

/** The shafts of one recording. */
export class PaintedShafts {
    /** [vertices, 3] where the corners of each vertex's cell stand in a list of x and y by turns. */
    private readonly corners: Uint32Array;

    constructor(private readonly recording: Recording) {
        const { shafts, cells } = recording;
        this.corners = new Uint32Array(3 * shafts.cell.length);
        shafts.cell.forEach((cell, i) => { for (let corner = 0; corner < 3; corner++) this.corners[3 * i + corner] = 2 * cells[3 * cell + corner]; });
    }

    /** Paints all that are seen on a mesh given in pixels, and tells how many vertices that took. */
    paint(raster: Raster, meshPixels: Float32Array, moment: Moment, camera: Camera, size: Size, paint: ShaftPaint): number {
        let vertices = 0;
        for (let axon = 0; axon < this.recording.axonCount; axon++) {
            if (!moment.visible[axon] || paint.colours[4 * axon + 3] === 0) continue;
            const tip = pixelOf(camera, size, [moment.tips[2 * axon], moment.tips[2 * axon + 1]]);
            vertices += this.paintOne(raster, meshPixels, moment.tick, axon, tip[0], tip[1], paint);
        }
        return vertices;
    }

    /** One shaft; vertices nearer than a dot to the last drawn one, or than two where not all are painted, are passed over. */
    private paintOne(raster: Raster, meshPixels: Float32Array, tick: number, axon: number, tipX: number, tipY: number, paint: ShaftPaint): number {
        const { corners } = this;
        const { start, weights, time, end } = this.recording.shafts;
        const { stride, rough, hues, colours } = paint;
        const beyond = start[axon + 1];
        const least = stride > 1 ? 4 : 1;
        const opacity = Math.round(256 * paint.opacity);
        const unit = 1 / 65535;
        let colour = packed(colours[4 * axon], colours[4 * axon + 1], colours[4 * axon + 2]);
        let fromX = 0;
        let fromY = 0;
        let vertices = 0;
        for (let i = start[axon]; ; i += stride) {
            const isTip = i >= beyond || time[i] > tick;
            if (!isTip && end !== null && end[i] !== 65535 && tick >= end[i]) continue;
            let x = tipX;
            let y = tipY;
            if (!isTip) {
                const one = weights[2 * i] * unit;
                const two = weights[2 * i + 1] * unit;
                const a = corners[3 * i];
                const b = corners[3 * i + 1];
                const c = corners[3 * i + 2];
                const zero = 1 - one - two;
                x = zero * meshPixels[a] + one * meshPixels[b] + two * meshPixels[c];
                y = zero * meshPixels[a + 1] + one * meshPixels[b + 1] + two * meshPixels[c + 1];
            }
            const dx = x - fromX;
            const dy = y - fromY;
            if (vertices === 0) {
                fromX = x;
                fromY = y;
            } else if (dx * dx + dy * dy >= least) {
                if (hues) colour = hue(hues, Math.atan2(-dy, dx));
                raster.line(fromX, fromY, x, y, colour, opacity, rough);
                fromX = x;
                fromY = y;
            }
            if (isTip) return vertices;
            vertices++;
        }
    }
}

function hue(hues: Uint8Array, angle: number): number {
    const count = hues.length / 4;
    const at = 4 * (((Math.round((angle / (2 * Math.PI)) * count) % count) + count) % count);
    return packed(hues[at], hues[at + 1], hues[at + 2]);
}

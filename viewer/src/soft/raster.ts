/** A picture in memory, and the few things painted into it: filled triangles, lines of one pixel, stamps. */
import { RIMMED } from "../gl/cones.ts";

/** Red, green, blue of 0…255 in one number, as the picture holds it. */
export function packed(red: number, green: number, blue: number): number {
    return 0xff000000 | (blue << 16) | (green << 8) | red;
}

/** A picture of opaque pixels, upper left first. */
export class Raster {
    readonly pixels: Int32Array;
    /** What {@link cut} found: the first pixel, and the one beyond the last. */
    from = 0;
    to = 0;

    constructor(readonly width: number, readonly height: number, buffer: ArrayBuffer) {
        this.pixels = new Int32Array(buffer, 0, width * height);
    }

    /** Lays a colour over a pixel that exists, with an opacity of 0…256. */
    blend(at: number, colour: number, opacity: number): void {
        const below = this.pixels[at];
        const rest = 256 - opacity;
        const sides = ((Math.imul(below & 0xff00ff, rest) + Math.imul(colour & 0xff00ff, opacity)) >>> 8) & 0xff00ff;
        const green = ((Math.imul(below & 0xff00, rest) + Math.imul(colour & 0xff00, opacity)) >>> 8) & 0xff00;
        this.pixels[at] = 0xff000000 | sides | green;
    }

    /**
     * A smooth line of one pixel's width (X. Wu, 1991): two pixels in each column or row whose middle it passes, so that
     * joined lines neither leave gaps nor darken where they meet. A rough line has the nearer pixel alone.
     */
    line(x0: number, y0: number, x1: number, y1: number, colour: number, opacity: number, rough: boolean): void {
        const { width, height } = this;
        if (Math.max(x0, x1) < 0 || Math.max(y0, y1) < 0 || Math.min(x0, x1) >= width || Math.min(y0, y1) >= height) return;
        const flat = Math.abs(x1 - x0) >= Math.abs(y1 - y0);
        const along0 = flat ? x0 : y0;
        const along1 = flat ? x1 : y1;
        if (along0 === along1) return;
        const across0 = flat ? y0 : x0;
        const slope = ((flat ? y1 : x1) - across0) / (along1 - along0);
        const stride = flat ? 1 : width;
        const step = flat ? width : 1;
        const extent = flat ? width : height;
        const limit = (flat ? height : width) - 1;
        const from = Math.max(Math.ceil(Math.min(along0, along1) - 0.5), 0);
        const to = Math.min(Math.ceil(Math.max(along0, along1) - 0.5), extent);
        let across = across0 + slope * (from + 0.5 - along0) - 0.5;
        for (let i = from; i < to; i++, across += slope) {
            const near = Math.floor(across);
            if (near < 0 || near >= limit) continue;
            const at = i * stride + near * step;
            if (rough) {
                this.blend(across - near < 0.5 ? at : at + step, colour, opacity);
                continue;
            }
            const share = ((across - near) * opacity) | 0;
            this.blend(at, colour, opacity - share);
            this.blend(at + step, colour, share);
        }
    }

    /** The number of rows whose centres lie above a height, of those that exist. */
    rowsBelow(y: number): number {
        return Math.min(Math.max(Math.ceil(y - 0.5), 0), this.height);
    }

    /** Sets `from` and `to` to the pixels of a row whose centres lie in a triangle. */
    cut(xs: Float64Array, ys: Float64Array, row: number): void {
        let left = Infinity;
        let right = -Infinity;
        for (let side = 0; side < 3; side++) {
            const next = side === 2 ? 0 : side + 1;
            const above = ys[side] - row - 0.5;
            const below = ys[next] - row - 0.5;
            if (above <= 0 === below <= 0) continue;
            const x = xs[side] + ((xs[next] - xs[side]) * above) / (above - below);
            if (x < left) left = x;
            if (x > right) right = x;
        }
        this.from = Math.max(Math.ceil(left - 0.5), 0);
        this.to = Math.min(Math.ceil(right - 0.5), this.width);
    }
}

/** A small shape with a rim, as opacities of the whole and shares of the inside. */
export interface Stamp {
    reach: number;
    whole: Uint16Array;
    inner: Float32Array;
}

/** Makes a stamp of a diameter in pixels out of a distance from the middle; a small one has no rim. */
export function stamp(size: number, distance: (x: number, y: number, radius: number) => number): Stamp {
    const reach = Math.ceil(size / 2);
    const side = 2 * reach + 1;
    const [whole, inner] = [new Uint16Array(side * side), new Float32Array(side * side)];
    const rimmed = size >= RIMMED;
    const radius = rimmed ? 0.5 * size - 0.6 : 0.5 * size;
    for (let i = 0; i < whole.length; i++) {
        const away = distance((i % side) - reach, Math.floor(i / side) - reach, radius);
        whole[i] = Math.round(256 * Math.min(Math.max(radius - away + 0.5, 0), 1));
        inner[i] = rimmed ? Math.min(Math.max(radius - 0.5 - away, 0), 1) : 1;
    }
    return { reach, whole, inner };
}

/** Lays a stamp on the picture, its rim and its inside in two colours. */
export function press(raster: Raster, { reach, whole, inner }: Stamp, x: number, y: number, rim: number, fill: number): void {
    const side = 2 * reach + 1;
    const [left, top] = [Math.round(x) - reach, Math.round(y) - reach];
    if (left < 0 || top < 0 || left + side > raster.width || top + side > raster.height) return;
    for (let i = 0; i < whole.length; i++) {
        if (whole[i] === 0) continue;
        const at = (top + Math.floor(i / side)) * raster.width + left + (i % side);
        if (inner[i] < 1) raster.blend(at, rim, whole[i]);
        if (inner[i] > 0) raster.blend(at, fill, (inner[i] * whole[i]) | 0);
    }
}

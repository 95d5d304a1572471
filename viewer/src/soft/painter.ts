/**
 * Tissue, shafts and cones painted by the processor into one picture, which WebGL then shows: for machines whose WebGL
 * is itself a program on the processor and needs some microseconds for every triangle.
 */
import * as three from "three";
import type { Recording } from "../data/recording.ts";
import { SHAPES, statusLook, type Shape } from "../gl/cones.ts";
import { pulled, rawMaterial } from "../gl/textures.ts";
import type { CueChoice } from "../gl/tissue.ts";
import { type Camera, pixelOf, type Size } from "../numbers/camera.ts";
import { mapColour, type Rgb, tissueColour } from "../numbers/colours.ts";
import type { Moment } from "../numbers/moment.ts";
import type { Range } from "../numbers/scales.ts";
import { packed, press, Raster, type Stamp, stamp } from "./raster.ts";

/** Steps of a colour map, and of a concentration in it. */
const STEPS = 128;
const FINE = 8192;
/** Vertices of shafts above which lines may be rough while time runs. */
const MANY = 200_000;
/** Length of a dash in dots. */
const DASH = 5;

const VERTEX = `out vec2 at;
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
    at = vec2(corner.x, 1.0 - corner.y);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}`;
const FRAGMENT = `uniform sampler2D picture; in vec2 at; out vec4 colour;
void main() { colour = vec4(texture(picture, at).rgb, 1.0); }`;

/** What is painted, and how. */
export interface Paint {
    background: Rgb;
    dark: boolean;
    cues: CueChoice;
    tissue: boolean;
    shafts: boolean;
    cones: boolean;
    /** Opacity of shafts. */
    opacity: number;
    /** Diameter of cones in pixels. */
    size: number;
    /** [axons, 4] colours; no opacity where hidden. */
    colours: Uint8Array;
    /** Colours of directions where shafts are coloured by them, four bytes each. */
    hues: Uint8Array | null;
    byStatus: boolean;
    rim: Rgb;
    ink: Rgb;
}

/** What is seen, and how large. */
interface Sight {
    camera: Camera;
    size: Size;
}

const DISTANCES: Record<Shape, (x: number, y: number, radius: number) => number> = {
    circle: (x, y) => Math.hypot(x, y),
    diamond: (x, y, radius) => 0.75 * (Math.abs(x) + Math.abs(y)) + 0.15 * radius,
    square: (x, y) => Math.max(Math.abs(x), Math.abs(y)) * 1.12,
    triangle: (x, y, radius) => Math.max(Math.abs(x) * 1.2 - y * 0.7 + 0.15 * radius, y * 1.35 + 0.1 * radius),
};

/** The painted layer of one recording. */
export class PaintedLayer {
    readonly mesh: three.Mesh;
    private texture = new three.DataTexture(new Uint8Array(4), 1, 1);
    private raster = new Raster(1, 1, new ArrayBuffer(4));
    private readonly corners: Uint32Array;
    private readonly meshPixels: Float32Array;
    /** Whether lines are drawn roughly: by dots of two pixels, where there are many. */
    private rough = false;
    /** By grain less one, then by shape. */
    private stamps: Stamp[][] = [];
    private palette = new Int32Array(STEPS * STEPS);
    private steps: [Uint8Array, Uint8Array] = [new Uint8Array(FINE + 1), new Uint8Array(FINE + 1)];

    constructor(private readonly recording: Recording) {
        const { shafts, cells } = recording;
        this.corners = new Uint32Array(3 * shafts.cell.length);
        shafts.cell.forEach((cell, i) => { for (let corner = 0; corner < 3; corner++) this.corners[3 * i + corner] = 2 * cells[3 * cell + corner]; });
        this.meshPixels = new Float32Array(2 * recording.vertexCount);
        this.mesh = pulled(rawMaterial(VERTEX, FRAGMENT, { picture: { value: this.texture } }), 0);
        this.mesh.geometry.setDrawRange(0, 3);
    }

    /** Prepares colours. */
    prepare(paint: Paint): void {
        const { attract, repel, map, logarithmic } = paint.cues;
        this.stamps = [1, 2].map((grain) => SHAPES.map((shape) => stamp(Math.max(paint.size / grain, 3.4), DISTANCES[shape])));
        const colours = (effect: "attract" | "repel"): Rgb[] => Array.from({ length: STEPS }, (_, i) => mapColour(map, effect, i / (STEPS - 1), paint.dark));
        const [one, other, base] = [colours("attract"), colours("repel"), tissueColour(paint.dark)];
        for (let i = 0; i < STEPS * STEPS; i++) {
            const [a, b] = [one[i % STEPS], other[Math.floor(i / STEPS)]];
            const both = (channel: number): number => {
                const [x, y, z] = [a, b, base].map((colour) => (colour[channel] / 255) ** 2.2);
                return Math.round(255 * Math.min(Math.max(paint.dark ? x + y - z : (x * y) / z, 0), 1) ** (1 / 2.2));
            };
            const colour = attract && repel ? [both(0), both(1), both(2)] : attract ? a : repel ? b : base;
            this.palette[i] = packed(colour[0], colour[1], colour[2]);
        }
        this.steps = [stepsOf(attract?.range, logarithmic), stepsOf(repel?.range, logarithmic)];
    }

    /** Paints a moment by dots of 1 or 2 pixels (`grain`); `concentrations` are [vertices, 4] with the cues in the last two. */
    paint(paint: Paint, moment: Moment, concentrations: Float32Array, targets: number[][], whole: Sight, grain: 1 | 2): void {
        const camera = { ...whole.camera, scale: whole.camera.scale * grain };
        const size = { width: whole.size.width / grain, height: whole.size.height / grain };
        this.resize(Math.max(1, Math.round(size.width)), Math.max(1, Math.round(size.height)));
        this.rough = grain > 1 && this.recording.shafts.cell.length > MANY;
        this.raster.pixels.fill(packed(...paint.background));
        for (let i = 0; i < moment.mesh.length; i += 2) {
            this.meshPixels[i] = (moment.mesh[i] - camera.x) / camera.scale + size.width / 2;
            this.meshPixels[i + 1] = (camera.y - moment.mesh[i + 1]) / camera.scale + size.height / 2;
        }
        if (paint.tissue) this.paintTissue(paint.cues, concentrations);
        if (paint.shafts) this.paintShafts(paint, moment, { camera, size });
        this.paintTargets(paint, targets, { camera, size });
        if (paint.cones) this.paintCones(paint, moment, { camera, size }, this.stamps[grain - 1]);
        this.texture.needsUpdate = true;
    }

    private resize(width: number, height: number): void {
        if (this.raster.width === width && this.raster.height === height) return;
        const buffer = new ArrayBuffer(4 * width * height);
        this.raster = new Raster(width, height, buffer);
        this.texture.dispose();
        this.texture = new three.DataTexture(new Uint8Array(buffer), width, height, three.RGBAFormat, three.UnsignedByteType);
        this.texture.magFilter = this.texture.minFilter = three.LinearFilter;
        (this.mesh.material as three.RawShaderMaterial).uniforms["picture"].value = this.texture;
    }

    private paintTissue({ attract, repel }: CueChoice, concentrations: Float32Array): void {
        const { raster, meshPixels, palette } = this;
        const { cells } = this.recording;
        const [first, second] = this.steps;
        const scales = [FINE / (attract?.range.high ?? 1), FINE / (repel?.range.high ?? 1)];
        const [xs, ys, ones, others] = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]];
        for (let cell = 0; cell < cells.length; cell += 3) {
            for (let k = 0; k < 3; k++) {
                const vertex = cells[cell + k];
                xs[k] = meshPixels[2 * vertex];
                ys[k] = meshPixels[2 * vertex + 1];
                ones[k] = concentrations[4 * vertex + 2] * scales[0];
                others[k] = concentrations[4 * vertex + 3] * scales[1];
            }
            const area = (xs[1] - xs[0]) * (ys[2] - ys[0]) - (xs[2] - xs[0]) * (ys[1] - ys[0]);
            if (area === 0) continue;
            const slope = (values: number[]): [number, number] => [
                ((values[1] - values[0]) * (ys[2] - ys[0]) - (values[2] - values[0]) * (ys[1] - ys[0])) / area,
                ((values[2] - values[0]) * (xs[1] - xs[0]) - (values[1] - values[0]) * (xs[2] - xs[0])) / area,
            ];
            const [oneX, oneY] = slope(ones);
            const [otherX, otherY] = slope(others);
            raster.triangle(xs, ys, (y, from, to) => {
                let one = ones[0] + oneX * (from + 0.5 - xs[0]) + oneY * (y + 0.5 - ys[0]);
                let other = others[0] + otherX * (from + 0.5 - xs[0]) + otherY * (y + 0.5 - ys[0]);
                for (let at = y * raster.width + from, end = y * raster.width + to; at < end; at++, one += oneX, other += otherX) {
                    const column = first[one > FINE ? FINE : one < 0 ? 0 : one | 0];
                    raster.pixels[at] = palette[STEPS * second[other > FINE ? FINE : other < 0 ? 0 : other | 0] + column];
                }
            });
        }
    }

    private paintShafts(paint: Paint, moment: Moment, { camera, size }: Sight): void {
        const { start } = this.recording.shafts;
        for (let axon = 0; axon < this.recording.axonCount; axon++) {
            if (!moment.visible[axon] || paint.colours[4 * axon + 3] === 0) continue;
            const tip = pixelOf(camera, size, [moment.tips[2 * axon], moment.tips[2 * axon + 1]]);
            this.paintShaft(paint, moment.tick, axon, start[axon], start[axon + 1], tip[0], tip[1]);
        }
    }

    /** One shaft; vertices nearer than a pixel to the last drawn one are passed over. */
    private paintShaft(paint: Paint, tick: number, axon: number, first: number, beyond: number, tipX: number, tipY: number): void {
        const { raster, corners, meshPixels } = this;
        const { weights, time, end } = this.recording.shafts;
        const opacity = Math.round(256 * paint.opacity);
        const unit = 1 / 65535;
        let colour = packed(paint.colours[4 * axon], paint.colours[4 * axon + 1], paint.colours[4 * axon + 2]);
        let fromX = 0;
        let fromY = 0;
        let begun = false;
        for (let i = first; i <= beyond; i++) {
            const isTip = i === beyond || time[i] > tick;
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
            if (begun && dx * dx + dy * dy >= 1) {
                if (paint.hues) colour = hue(paint.hues, Math.atan2(-dy, dx));
                raster.line(fromX, fromY, x, y, colour, opacity, this.rough);
            } else if (begun) {
                x = fromX;
                y = fromY;
            }
            fromX = x;
            fromY = y;
            begun = true;
            if (isTip) return;
        }
    }

    /** Targets: dashes of ink, and the rim's colour between them. */
    private paintTargets(paint: Paint, targets: number[][], { camera, size }: Sight): void {
        const tones = [packed(...paint.ink), packed(...paint.rim)];
        for (const line of targets) {
            let along = 0;
            for (let i = 0; i + 3 < line.length; i += 2) {
                const [from, to] = [pixelOf(camera, size, [line[i], line[i + 1]]), pixelOf(camera, size, [line[i + 2], line[i + 3]])];
                const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
                for (let done = 0; done < length; ) {
                    const next = Math.min(length, done + DASH - (along % DASH));
                    const at = (share: number, axis: 0 | 1): number => from[axis] + ((to[axis] - from[axis]) * share) / length;
                    const tone = tones[Math.floor(along / DASH + 1e-9) % 2];
                    for (const aside of [0, 1]) this.raster.line(at(done, 0) + aside, at(done, 1) + aside, at(next, 0) + aside, at(next, 1) + aside, tone, 256, false);
                    along += Math.max(next - done, 1e-3);
                    done = next;
                }
            }
        }
    }

    private paintCones(paint: Paint, moment: Moment, { camera, size }: Sight, stamps: Stamp[]): void {
        const looks = this.recording.statusWords.map(statusLook);
        const rim = packed(...paint.rim);
        for (let axon = 0; axon < this.recording.axonCount; axon++) {
            const look = looks[moment.status[axon]];
            if (!moment.visible[axon] || paint.colours[4 * axon + 3] === 0 || !look) continue;
            const fill = paint.byStatus ? packed(...look.colour) : packed(paint.colours[4 * axon], paint.colours[4 * axon + 1], paint.colours[4 * axon + 2]);
            const [x, y] = pixelOf(camera, size, [moment.tips[2 * axon], moment.tips[2 * axon + 1]]);
            press(this.raster, stamps[SHAPES.indexOf(look.shape)], x, y, rim, fill);
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

function hue(hues: Uint8Array, angle: number): number {
    const count = hues.length / 4;
    const at = 4 * (((Math.round((angle / (2 * Math.PI)) * count) % count) + count) % count);
    return packed(hues[at], hues[at + 1], hues[at + 2]);
}

/**
 * Tissue, shafts and cones painted by the processor into one picture, which WebGL then shows: for machines whose WebGL
 * is itself a program on the processor and needs some microseconds for every triangle.
 */
import * as three from "three";
import type { Recording } from "../data/recording.ts";
import { coneSize, SHAPES, statusLook, type Shape } from "../gl/cones.ts";
import { pulled, rawMaterial } from "../gl/textures.ts";
import type { CueChoice } from "../gl/tissue.ts";
import { type Camera, pixelOf, type Size } from "../numbers/camera.ts";
import type { Rgb } from "../numbers/colours.ts";
import type { Moment } from "../numbers/moment.ts";
import { packed, press, Raster, type Stamp, stamp } from "./raster.ts";
import { movingStride, PaintedShafts } from "./shafts.ts";
import { PaintedTissue } from "./tissue.ts";

/** Levels of detail: everything; fewer vertices of shafts; and that by dots of two pixels. */
export const PAINTED_LEVELS = 3;
/** Vertices of shafts above which lines may be rough while time runs. */
const MANY = 200_000;
/** Opacity of lines of two pixels' width, as a share of that of one pixel's: they are to look as dark together. */
const FAINTER = 0.6;
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
    private readonly shafts: PaintedShafts;
    private readonly tissue = new PaintedTissue();
    private readonly meshPixels: Float32Array;
    /** By shape, and their diameter in dots. */
    private stamps: Stamp[] = [];
    private stamped = 0;
    /** Vertices of shafts in the last picture. */
    vertices = 0;

    constructor(private readonly recording: Recording) {
        this.shafts = new PaintedShafts(recording);
        this.meshPixels = new Float32Array(2 * recording.vertexCount);
        this.mesh = pulled(rawMaterial(VERTEX, FRAGMENT, { picture: { value: this.texture } }), 0);
        this.mesh.geometry.setDrawRange(0, 3);
    }

    /** Prepares colours. */
    prepare(paint: Paint): void {
        this.tissue.choose(paint.cues, paint.dark);
    }

    /** Paints a moment at a level of detail; `concentrations` are [vertices, 4] with the cues in the last two. */
    paint(paint: Paint, moment: Moment, concentrations: Float32Array, targets: number[][], whole: Sight, level: number): void {
        const grain = level > 1 ? 2 : 1;
        const count = this.recording.shafts.cell.length;
        const camera = { ...whole.camera, scale: whole.camera.scale * grain };
        const size = { width: whole.size.width / grain, height: whole.size.height / grain };
        this.resize(Math.max(1, Math.round(size.width)), Math.max(1, Math.round(size.height)));
        this.raster.pixels.fill(packed(...paint.background));
        for (let i = 0; i < moment.mesh.length; i += 2) {
            this.meshPixels[i] = (moment.mesh[i] - camera.x) / camera.scale + size.width / 2;
            this.meshPixels[i + 1] = (camera.y - moment.mesh[i + 1]) / camera.scale + size.height / 2;
        }
        if (paint.tissue) this.tissue.paint(this.raster, this.recording.cells, this.meshPixels, concentrations);
        const { colours, hues, opacity } = paint;
        const lines = { colours, hues, opacity: opacity * (grain > 1 ? FAINTER : 1), stride: level > 0 ? movingStride(count) : 1, rough: grain > 1 && count > MANY };
        this.vertices = paint.shafts ? this.shafts.paint(this.raster, this.meshPixels, moment, camera, size, lines) : 0;
        this.paintTargets(paint, targets, { camera, size });
        if (paint.cones) this.paintCones(paint, moment, { camera, size }, coneSize(this.recording, whole.camera) / grain);
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

    private paintCones(paint: Paint, moment: Moment, { camera, size }: Sight, diameter: number): void {
        this.cutStamps(diameter);
        const looks = this.recording.statusWords.map(statusLook);
        const rim = packed(...paint.rim);
        for (let axon = 0; axon < this.recording.axonCount; axon++) {
            const look = looks[moment.status[axon]];
            if (!moment.visible[axon] || paint.colours[4 * axon + 3] === 0 || !look) continue;
            const fill = paint.byStatus ? packed(...look.colour) : packed(paint.colours[4 * axon], paint.colours[4 * axon + 1], paint.colours[4 * axon + 2]);
            const [x, y] = pixelOf(camera, size, [moment.tips[2 * axon], moment.tips[2 * axon + 1]]);
            press(this.raster, this.stamps[SHAPES.indexOf(look.shape)], x, y, rim, fill);
        }
    }

    private cutStamps(diameter: number): void {
        if (this.stamped === diameter) return;
        this.stamped = diameter;
        this.stamps = SHAPES.map((shape) => stamp(diameter, DISTANCES[shape]));
    }
}

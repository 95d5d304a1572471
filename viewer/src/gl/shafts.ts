/**
 * Shafts. All their vertices lie in textures; a first pass writes, for each laid vertex, the piece of shaft that begins
 * there at the present time and shape of the tissue; a second draws each piece as a rectangle of some pixels' width. So
 * deformation, growth and striking out cost the processor nothing.
 *
 * Vertices are listed in order of time, so that what is laid is the beginning of the list; and in levels, each with
 * every second vertex of the one before, so that a slow machine can draw fewer while time runs.
 */
import * as three from "three";
import type { Recording } from "../data/recording.ts";
import type { Moment } from "../numbers/moment.ts";
import { PROJECT, pulled, rawMaterial, ROW, rowsFor, type ViewUniforms, wholeTexture } from "./textures.ts";

/** Levels of detail. */
export const LEVELS = 4;

const COVER = `void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

/** Writes pieces as (x, y of the beginning, x, y of the end) quantised in the box; all zero where there is none. */
const PIECES = `uniform usampler2D order, material, laid;
uniform sampler2D vertices, tips;
uniform vec4 box; uniform uint tick; uniform int count, stride, total;
out uvec4 piece;
vec2 point(int i) {
    uvec4 m = texelFetch(material, place(i), 0);
    vec2 w = vec2(m.w & 65535u, m.w >> 16) / 65535.0;
    vec2 a = texelFetch(vertices, place(int(m.x)), 0).xy;
    vec2 b = texelFetch(vertices, place(int(m.y)), 0).xy;
    vec2 c = texelFetch(vertices, place(int(m.z)), 0).xy;
    return (1.0 - w.x - w.y) * a + w.x * b + w.y * c;
}
bool struck(uint times) { uint end = times >> 16; return end != 65535u && end <= tick; }
void main() {
    piece = uvec4(0u);
    int slot = int(gl_FragCoord.y) * ${ROW} + int(gl_FragCoord.x);
    if (slot >= count) return;
    int i = int(texelFetch(order, place(slot), 0).x);
    uvec2 here = texelFetch(laid, place(i), 0).xy;
    vec4 tip = texelFetch(tips, place(int(here.y)), 0);
    if (struck(here.x) || tip.z < 0.5) return;
    vec2 end = tip.xy;
    for (int j = i + stride, tries = 0; j < total && tries < 256; j += stride, tries++) {
        uvec2 next = texelFetch(laid, place(j), 0).xy;
        if (next.y != here.y || (next.x & 65535u) > tick) break;
        if (struck(next.x)) continue;
        end = point(j);
        break;
    }
    vec4 ends = (vec4(point(i), end) - box.xyxy) / (box.zw - box.xy).xyxy;
    piece = uvec4(clamp(ends, 0.0, 1.0) * 65535.0 + 0.5);
}`;

const VERTEX = `${PROJECT}
uniform usampler2D pieces, order, laid; uniform sampler2D colours, hues;
uniform vec4 box; uniform float width; uniform bool byDirection;
out vec4 tone; out float across; out float half_width;
void main() {
    int slot = gl_VertexID / 6, corner = gl_VertexID % 6;
    uvec4 piece = texelFetch(pieces, place(slot), 0);
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    if (piece == uvec4(0u)) return;
    vec4 ends = box.xyxy + vec4(piece) / 65535.0 * (box.zw - box.xy).xyxy;
    int axon = int(texelFetch(laid, place(int(texelFetch(order, place(slot), 0).x)), 0).y);
    tone = texelFetch(colours, place(axon), 0);
    if (tone.a == 0.0) return;
    vec2 along = ends.zw - ends.xy;
    float size = max(length(along), 1e-6);
    along /= size;
    if (byDirection) tone.rgb = texture(hues, vec2(atan(along.y, along.x) / 6.2831853, 0.5)).rgb;
    bool far = corner == 1 || corner == 2 || corner == 4, left = corner == 2 || corner == 4 || corner == 5;
    float pixel = 2.0 * view.z / extent.x;
    half_width = 0.5 * width;
    across = (left ? 1.0 : -1.0) * (half_width + 0.7);
    vec2 side = vec2(-along.y, along.x) * across * pixel;
    gl_Position = project((far ? ends.zw : ends.xy) + side);
}`;

const FRAGMENT = `uniform float opacity;
in vec4 tone; in float across; in float half_width;
out vec4 colour;
void main() {
    float alpha = opacity * tone.a * clamp(half_width + 0.5 - abs(across), 0.0, 1.0);
    colour = vec4(tone.rgb * alpha, alpha);
}`;

interface Level {
    /** Vertices in order of time. */
    order: three.DataTexture;
    /** Their times. */
    times: Uint16Array;
}

/** The layer of the shafts of one recording. */
export class ShaftLayer {
    readonly mesh: three.Mesh;
    private readonly levels: Level[];
    private readonly pieces: three.WebGLRenderTarget;
    private readonly pass: three.Mesh;
    private readonly passScene = new three.Scene();
    private readonly uniforms: Record<string, three.IUniform>;
    private readonly drawing: Record<string, three.IUniform>;

    constructor(recording: Recording, view: ViewUniforms, shared: { vertices: three.DataTexture; tips: three.DataTexture; colours: three.DataTexture; hues: three.DataTexture }) {
        const { shafts, cells, axonCount, box } = recording;
        const total = shafts.cell.length;
        const material = new Uint32Array(4 * total);
        const laid = new Uint32Array(2 * total);
        for (let i = 0; i < total; i++) {
            const corner = 3 * shafts.cell[i];
            const weights = shafts.weights[2 * i] | (shafts.weights[2 * i + 1] << 16);
            material.set([cells[corner], cells[corner + 1], cells[corner + 2], weights], 4 * i);
            laid[2 * i] = shafts.time[i] | ((shafts.end?.[i] ?? 65535) << 16);
        }
        for (let axon = 0; axon < axonCount; axon++) {
            for (let i = shafts.start[axon]; i < shafts.start[axon + 1]; i++) laid[2 * i + 1] = axon;
        }
        this.levels = Array.from({ length: LEVELS }, (_, level) => levelOf(recording, 2 ** level));
        this.pieces = new three.WebGLRenderTarget(ROW, rowsFor(total), {
            format: three.RGBAIntegerFormat,
            type: three.UnsignedShortType,
            internalFormat: "RGBA16UI",
            minFilter: three.NearestFilter,
            magFilter: three.NearestFilter,
            depthBuffer: false,
        });
        const common = { laid: { value: wholeTexture(laid, 2) }, order: { value: this.levels[0].order }, box: { value: new three.Vector4(...box) } };
        this.uniforms = {
            ...common,
            material: { value: wholeTexture(material, 4) },
            vertices: { value: shared.vertices },
            tips: { value: shared.tips },
            tick: { value: 0 },
            count: { value: 0 },
            stride: { value: 1 },
            total: { value: total },
        };
        this.drawing = {
            ...view,
            ...common,
            pieces: { value: this.pieces.texture },
            colours: { value: shared.colours },
            hues: { value: shared.hues },
            width: { value: 1.2 },
            opacity: { value: 0.5 },
            byDirection: { value: false },
        };
        this.pass = pulled(rawMaterial(COVER, PIECES, this.uniforms), 0);
        (this.pass.material as three.RawShaderMaterial).blending = three.NoBlending;
        this.pass.geometry.setDrawRange(0, 3);
        this.passScene.add(this.pass);
        this.mesh = pulled(rawMaterial(VERTEX, FRAGMENT, this.drawing), 2);
    }

    /** How shafts look: width in CSS pixels, opacity, whether coloured by direction. */
    style(width: number, opacity: number, byDirection: boolean): void {
        this.drawing["width"].value = width;
        this.drawing["opacity"].value = opacity;
        this.drawing["byDirection"].value = byDirection;
    }

    /** Vertices that are drawn. */
    get vertices(): number {
        return this.mesh.visible ? this.mesh.geometry.drawRange.count / 6 : 0;
    }

    /** Writes the pieces of a moment at a level of detail (0: every vertex). */
    update(renderer: three.WebGLRenderer, moment: Moment, level: number, camera: three.Camera): void {
        const { order, times } = this.levels[level];
        const count = laidBy(times, moment.tick);
        this.uniforms["order"].value = this.drawing["order"].value = order;
        this.uniforms["tick"].value = moment.tick;
        this.uniforms["count"].value = count;
        this.uniforms["stride"].value = 2 ** level;
        this.mesh.geometry.setDrawRange(0, 6 * count);
        if (count === 0) return;
        this.pieces.viewport.set(0, 0, ROW, rowsFor(count));
        renderer.setRenderTarget(this.pieces);
        renderer.render(this.passScene, camera);
        renderer.setRenderTarget(null);
    }
}

/** Every `stride`-th vertex of each shaft, in order of time. */
function levelOf({ shafts, axonCount }: Recording, stride: number): Level {
    const counts = new Uint32Array(65537);
    const each = (visit: (vertex: number) => void): void => {
        for (let axon = 0; axon < axonCount; axon++) {
            for (let i = shafts.start[axon]; i < shafts.start[axon + 1]; i += stride) visit(i);
        }
    };
    each((vertex) => counts[shafts.time[vertex] + 1]++);
    for (let tick = 1; tick < counts.length; tick++) counts[tick] += counts[tick - 1];
    const vertices = new Uint32Array(counts[65536]);
    const times = new Uint16Array(vertices.length);
    each((vertex) => {
        const slot = counts[shafts.time[vertex]]++;
        vertices[slot] = vertex;
        times[slot] = shafts.time[vertex];
    });
    return { order: wholeTexture(vertices, 1), times };
}

/** How many of the ascending times are at most a tick. */
export function laidBy(times: Uint16Array, tick: number): number {
    let [low, high] = [0, times.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle] <= tick) low = middle + 1;
        else high = middle;
    }
    return low;
}

/** Growth cones: one point each, whose shape tells the status and whose fill is the axon's colour or that of the status. */
import * as three from "three";
import type { Rgb } from "../numbers/colours.ts";
import type { Recording } from "../data/recording.ts";
import type { Camera } from "../numbers/camera.ts";
import { PROJECT, rawMaterial, type ViewUniforms } from "./textures.ts";

/** Shapes by number, as the shader draws them. */
export const SHAPES = ["circle", "diamond", "square", "triangle"] as const;
export type Shape = (typeof SHAPES)[number];

/** How a status looks: the colours of the program's figures. */
export function statusLook(word: string): { shape: Shape; colour: Rgb } {
    switch (word) {
        case "arrived": return { shape: "diamond", colour: [0x00, 0x9e, 0x73] };
        case "stalled": return { shape: "square", colour: [0x55, 0x55, 0x55] };
        case "left": return { shape: "square", colour: [0xf0, 0xd0, 0x30] };
        case "retracting": return { shape: "triangle", colour: [0x00, 0x72, 0xb2] };
        default: return { shape: "circle", colour: [0xd5, 0x5e, 0x00] };
    }
}

/** Diameters of cones in CSS pixels: of few, of many, and the least. */
const FEW = 8;
const MANY = 6.5;
const LEAST = 2.4;
/** The diameter in pixels below which a rim would leave nothing of the inside. */
export const RIMMED = 3.4;

/** Diameter of cones in CSS pixels: at most half of what lies between two if they were spread evenly, so that they hide neither shafts nor tissue. */
export function coneSize({ axonCount, box: [x0, y0, x1, y1] }: Recording, camera: Camera): number {
    const spacing = Math.sqrt(((x1 - x0) * (y1 - y0)) / Math.max(axonCount, 1)) / camera.scale;
    return Math.max(Math.min(0.5 * spacing, axonCount > 800 ? MANY : FEW), LEAST);
}

const VERTEX = `${PROJECT}
uniform sampler2D tips, colours, looks; uniform float size, density; uniform bool byStatus;
out vec3 fill; flat out int shape;
void main() {
    vec4 tip = texelFetch(tips, place(gl_VertexID), 0);
    vec4 tone = texelFetch(colours, place(gl_VertexID), 0);
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
    if (tip.z < 0.5 || tone.a == 0.0) return;
    vec4 look = texelFetch(looks, place(int(tip.w)), 0);
    fill = byStatus ? look.rgb : tone.rgb;
    shape = int(look.a * 255.0 + 0.5);
    gl_PointSize = (size + 1.0) * density;
    gl_Position = project(tip.xy);
}`;

const FRAGMENT = `const float RIMMED = ${RIMMED};
uniform vec3 rim; uniform float size, density;
in vec3 fill; flat in int shape;
out vec4 colour;
void main() {
    vec2 at = (gl_PointCoord - 0.5) * (size + 1.0);
    float radius = size < RIMMED ? 0.5 * size : 0.5 * size - 0.6;
    float distance = length(at);
    if (shape == 1) distance = 0.75 * (abs(at.x) + abs(at.y)) + 0.15 * radius;
    if (shape == 2) distance = max(abs(at.x), abs(at.y)) * 1.12;
    if (shape == 3) distance = max(abs(at.x) * 1.2 - at.y * 0.7 + 0.15 * radius, at.y * 1.35 + 0.1 * radius);
    float whole = clamp((radius - distance) * density + 0.5, 0.0, 1.0);
    float inner = size < RIMMED ? 1.0 : clamp((radius - 1.0 - distance) * density + 0.5, 0.0, 1.0);
    if (whole <= 0.0) discard;
    colour = vec4(mix(rim, fill, inner) * whole, whole);
}`;

/** The layer of the growth cones of one recording. */
export class ConeLayer {
    readonly points: three.Points;
    private readonly uniforms: Record<string, three.IUniform>;

    constructor(axonCount: number, statusWords: string[], view: ViewUniforms, shared: { tips: three.DataTexture; colours: three.DataTexture; looks: three.DataTexture }) {
        const looks = shared.looks.image.data as Uint8Array;
        statusWords.forEach((word, index) => {
            const { shape, colour } = statusLook(word);
            looks.set([...colour, SHAPES.indexOf(shape)], 4 * index);
        });
        shared.looks.needsUpdate = true;
        this.uniforms = {
            ...view,
            tips: { value: shared.tips },
            colours: { value: shared.colours },
            looks: { value: shared.looks },
            size: { value: 8 },
            density: { value: 1 },
            byStatus: { value: true },
            rim: { value: new three.Vector3(1, 1, 1) },
        };
        this.points = new three.Points(new three.BufferGeometry(), rawMaterial(VERTEX, FRAGMENT, this.uniforms));
        this.points.frustumCulled = false;
        this.points.renderOrder = 4;
        this.points.geometry.setDrawRange(0, axonCount);
    }

    /** Diameter in CSS pixels. */
    resize(size: number): void {
        this.uniforms["size"].value = size;
    }

    /** Device pixels a CSS pixel, colours. */
    style(density: number, byStatus: boolean, rim: Rgb): void {
        this.uniforms["density"].value = density;
        this.uniforms["byStatus"].value = byStatus;
        this.uniforms["rim"].value.set(...rim.map((channel) => channel / 255));
    }
}

/** Ribbons: a few lines of some pixels' width (outlines, targets, the chosen axon), built anew where they change. */
import * as three from "three";
import type { Rgb } from "../numbers/colours.ts";
import { PROJECT, pulled, rawMaterial, type ViewUniforms } from "./textures.ts";

const VERTEX = `${PROJECT}
in vec4 ends; in vec3 corner; uniform float width;
out float across; out float along; out float half_width;
void main() {
    vec2 direction = ends.zw - ends.xy;
    float size = max(length(direction), 1e-6);
    direction /= size;
    float pixel = 2.0 * view.z / extent.x;
    half_width = 0.5 * width;
    across = corner.y * (half_width + 0.7);
    along = (corner.z + corner.x * size) / pixel;
    vec2 cap = direction * (corner.x - 0.5) * half_width * pixel;
    gl_Position = project((corner.x > 0.5 ? ends.zw : ends.xy) + cap + vec2(-direction.y, direction.x) * across * pixel);
}`;

const FRAGMENT = `uniform vec4 ink; uniform vec2 dash;
in float across; in float along; in float half_width;
out vec4 colour;
void main() {
    if (dash.y > 0.0 && mod(along, dash.x + dash.y) > dash.x) discard;
    float alpha = ink.a * clamp(half_width + 0.5 - abs(across), 0.0, 1.0);
    colour = vec4(ink.rgb * alpha, alpha);
}`;

/** Lines of one look. */
export class Ribbons {
    readonly mesh: three.Mesh;
    private readonly uniforms: Record<string, three.IUniform>;

    constructor(view: ViewUniforms, order: number) {
        this.uniforms = { ...view, width: { value: 1 }, ink: { value: new three.Vector4() }, dash: { value: new three.Vector2() } };
        const material = rawMaterial(VERTEX, FRAGMENT, this.uniforms);
        this.mesh = pulled(material, order);
    }

    /** Width in CSS pixels, colour with opacity, lengths of dash and gap in CSS pixels (gap 0: a whole line). */
    style(width: number, colour: Rgb, opacity: number, dash: [number, number] = [1, 0]): void {
        this.uniforms["width"].value = width;
        this.uniforms["ink"].value.set(...colour.map((channel) => channel / 255), opacity);
        this.uniforms["dash"].value.set(...dash);
    }

    /** Sets the lines: each a list of x and y by turns in µm. */
    draw(lines: ArrayLike<number>[]): void {
        const pieces = lines.reduce((sum, line) => sum + Math.max(line.length / 2 - 1, 0), 0);
        const ends = new Float32Array(pieces * 6 * 4);
        const corner = new Float32Array(pieces * 6 * 3);
        let vertex = 0;
        for (const line of lines) {
            let along = 0;
            for (let i = 0; i + 3 < line.length; i += 2) {
                for (const [end, side] of CORNERS) {
                    ends.set([line[i], line[i + 1], line[i + 2], line[i + 3]], 4 * vertex);
                    corner.set([end, side, along], 3 * vertex++);
                }
                along += Math.hypot(line[i + 2] - line[i], line[i + 3] - line[i + 1]);
            }
        }
        const geometry = new three.BufferGeometry();
        geometry.setAttribute("ends", new three.BufferAttribute(ends, 4));
        geometry.setAttribute("corner", new three.BufferAttribute(corner, 3));
        geometry.setDrawRange(0, vertex);
        this.mesh.geometry.dispose();
        this.mesh.geometry = geometry;
    }
}

const CORNERS = [[0, -1], [1, -1], [1, 1], [0, -1], [1, 1], [0, 1]];

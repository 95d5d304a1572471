/** The tissue: its mesh, coloured by the concentration of one cue or of all. */
import * as three from "three";
import type { Recording } from "../data/recording.ts";
import { mapTable, type MapName, tissueColour } from "../numbers/colours.ts";
import { fieldAt, type Moment } from "../numbers/moment.ts";
import type { Range } from "../numbers/scales.ts";
import { floatTexture, PROJECT, pulled, rawMaterial, type ViewUniforms } from "./textures.ts";

const VERTEX = `${PROJECT}
uniform sampler2D vertices;
out vec2 concentration;
void main() {
    vec4 vertex = texelFetch(vertices, place(gl_VertexID), 0);
    concentration = vertex.zw;
    gl_Position = project(vertex.xy);
}`;

const FRAGMENT = `uniform sampler2D attractMap, repelMap;
uniform vec4 range; uniform vec3 bare; uniform bool logarithmic, dark;
uniform ivec2 shown;
in vec2 concentration;
out vec4 colour;
vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
float share(float c, vec2 ends) {
    return logarithmic ? log(max(c, ends.x) / ends.x) / log(ends.y / ends.x) : c / ends.y;
}
vec3 look(sampler2D map, float c, vec2 ends) {
    float at = clamp(share(c, ends), 0.0, 1.0);
    return linear(texture(map, vec2((at * 255.0 + 0.5) / 256.0, 0.5)).rgb);
}
void main() {
    vec3 base = linear(bare);
    vec3 one = shown.x > 0 ? look(attractMap, concentration.x, range.xy) : base;
    vec3 other = shown.y > 0 ? look(repelMap, concentration.y, range.zw) : base;
    vec3 both = dark ? one + other - base : one * other / base;
    vec3 light = shown.x > 0 && shown.y > 0 ? both : (shown.x > 0 ? one : other);
    colour = vec4(pow(clamp(light, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
}`;

/** One side of what is shown: cues of one effect, summed. */
export interface Shown {
    /** Names; a recording may lack some of them. */
    cues: string[];
    range: Range;
}

/** What is shown of the cues. */
export interface CueChoice {
    attract: Shown | null;
    repel: Shown | null;
    map: MapName;
    logarithmic: boolean;
}

/** The layer of the tissue of one recording. */
export class TissueLayer {
    readonly mesh: three.Mesh;
    /** [vertices]: x, y, and the two concentrations; shared with what rides the tissue. */
    readonly vertices: three.DataTexture;
    private choice: CueChoice | null = null;
    private readonly uniforms: Record<string, three.IUniform>;

    constructor(private readonly recording: Recording, view: ViewUniforms) {
        this.vertices = floatTexture(recording.vertexCount);
        this.uniforms = {
            ...view,
            vertices: { value: this.vertices },
            attractMap: { value: tableTexture() },
            repelMap: { value: tableTexture() },
            range: { value: new three.Vector4(0.1, 1, 0.1, 1) },
            bare: { value: new three.Vector3() },
            logarithmic: { value: true },
            dark: { value: false },
            shown: { value: [0, 0] },
        };
        this.mesh = pulled(rawMaterial(VERTEX, FRAGMENT, this.uniforms), 0);
        this.mesh.geometry.setIndex(new three.BufferAttribute(recording.cells, 1));
        this.mesh.geometry.setDrawRange(0, recording.cells.length);
    }

    /** Chooses cues and colours. */
    choose(choice: CueChoice, dark: boolean): void {
        this.choice = choice;
        const { attract, repel } = choice;
        const bare = tissueColour(dark);
        this.uniforms["bare"].value.set(bare[0] / 255, bare[1] / 255, bare[2] / 255);
        this.uniforms["dark"].value = dark;
        this.uniforms["logarithmic"].value = choice.logarithmic;
        this.uniforms["shown"].value = [attract ? 1 : 0, repel ? 1 : 0];
        const ends = (shown: Shown | null): [number, number] => (shown ? [shown.range.low, shown.range.high] : [0.1, 1]);
        this.uniforms["range"].value.set(...ends(attract), ...ends(repel));
        fill(this.uniforms["attractMap"].value, mapTable(choice.map, "attract", dark));
        fill(this.uniforms["repelMap"].value, mapTable(choice.map, "repel", dark));
    }

    /** Takes positions and concentrations of a moment. */
    update(moment: Moment): void {
        const data = this.vertices.image.data as Float32Array;
        for (let i = 0; i < this.recording.vertexCount; i++) {
            data[4 * i] = moment.mesh[2 * i];
            data[4 * i + 1] = moment.mesh[2 * i + 1];
        }
        this.fillConcentration(data, 2, this.choice?.attract ?? null, moment.time);
        this.fillConcentration(data, 3, this.choice?.repel ?? null, moment.time);
        this.vertices.needsUpdate = true;
    }

    private fillConcentration(data: Float32Array, channel: number, shown: Shown | null, time: number): void {
        const { vertexCount, cues, frames } = this.recording;
        for (let i = 0; i < vertexCount; i++) data[4 * i + channel] = 0;
        for (const cue of cues.filter(({ name }) => shown?.cues.includes(name))) {
            const offset = fieldAt(cue, frames, time) * vertexCount;
            const unit = cue.maximum / 65535;
            for (let i = 0; i < vertexCount; i++) data[4 * i + channel] += unit * cue.field[offset + i];
        }
    }
}

function tableTexture(): three.DataTexture {
    const texture = new three.DataTexture(new Uint8Array(256 * 4), 256, 1, three.RGBAFormat, three.UnsignedByteType);
    texture.magFilter = texture.minFilter = three.LinearFilter;
    return texture;
}

function fill(texture: three.DataTexture, table: Uint8Array): void {
    (texture.image.data as Uint8Array).set(table);
    texture.needsUpdate = true;
}

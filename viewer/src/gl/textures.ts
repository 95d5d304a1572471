/** Data textures: lists of numbers that shaders fetch by index, laid in rows of {@link ROW} texels. */
import * as three from "three";

/** Texels a row. */
export const ROW = 1024;

/** What a shader needs to fetch texel `i`. */
export const FETCH = `ivec2 place(int i) { return ivec2(i & ${ROW - 1}, i >> 10); }\n`;

/** Rows for a count of texels, at least one. */
export const rowsFor = (texels: number): number => Math.max(1, Math.ceil(texels / ROW));

/** A texture of floats, four a texel. */
export function floatTexture(texels: number): three.DataTexture {
    const data = new Float32Array(4 * ROW * rowsFor(texels));
    return new three.DataTexture(data, ROW, rowsFor(texels), three.RGBAFormat, three.FloatType);
}

/** A texture of bytes, four a texel. */
export function byteTexture(texels: number): three.DataTexture {
    const data = new Uint8Array(4 * ROW * rowsFor(texels));
    return new three.DataTexture(data, ROW, rowsFor(texels), three.RGBAFormat, three.UnsignedByteType);
}

/** A texture of whole numbers, `channels` (1, 2 or 4) a texel. */
export function wholeTexture(data: Uint32Array<ArrayBuffer>, channels: 1 | 2 | 4): three.DataTexture {
    const texels = data.length / channels;
    const padded = new Uint32Array(channels * ROW * rowsFor(texels));
    padded.set(data);
    const format = { 1: three.RedIntegerFormat, 2: three.RGIntegerFormat, 4: three.RGBAIntegerFormat }[channels];
    const texture = new three.DataTexture(padded, ROW, rowsFor(texels), format, three.UnsignedIntType);
    texture.internalFormat = ({ 1: "R32UI", 2: "RG32UI", 4: "RGBA32UI" } as const)[channels];
    texture.needsUpdate = true;
    return texture;
}

/** A mesh whose vertices are made from `gl_VertexID` alone; nothing is drawn until its range is set. */
export function pulled(material: three.RawShaderMaterial, order: number): three.Mesh {
    const mesh = new three.Mesh(new three.BufferGeometry(), material);
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    mesh.geometry.setDrawRange(0, 0);
    return mesh;
}

/** A material of GLSL 3 with premultiplied blending and no depth. */
export function rawMaterial(vertexShader: string, fragmentShader: string, uniforms: Record<string, three.IUniform>): three.RawShaderMaterial {
    return new three.RawShaderMaterial({
        glslVersion: three.GLSL3,
        vertexShader: `precision highp float;\nprecision highp int;\nprecision highp usampler2D;\nprecision highp sampler2D;\n${FETCH}${vertexShader}`,
        fragmentShader: `precision highp float;\nprecision highp int;\nprecision highp usampler2D;\nprecision highp sampler2D;\n${FETCH}${fragmentShader}`,
        uniforms,
        depthTest: false,
        depthWrite: false,
        transparent: true,
        blending: three.CustomBlending,
        blendSrc: three.OneFactor,
        blendDst: three.OneMinusSrcAlphaFactor,
    });
}

/** Uniforms that all layers of a pane share: the view. */
export interface ViewUniforms extends Record<string, three.IUniform> {
    /** Centre (µm) and half extents (µm) of the view. */
    view: three.IUniform<three.Vector4>;
    /** Extent of the pane in CSS pixels. */
    extent: three.IUniform<three.Vector2>;
}

/** The projection of µm by {@link ViewUniforms}. */
export const PROJECT = `uniform vec4 view; uniform vec2 extent;
vec4 project(vec2 point) { return vec4((point - view.xy) / view.zw, 0.0, 1.0); }
`;

/** Makes synthetic recordings by the container's layout: a rectangle that stretches, and axons that converge on a disc. */
import { deflateSync } from "node:zlib";
import type { Items } from "../src/data/container.ts";

/** What a sample is made of. */
export interface SampleOptions {
    axons: number;
    /** Vertices of a full-grown shaft. */
    vertices: number;
    frames: number;
    /** Columns of the mesh; it has 3/4 as many rows. */
    columns: number;
    /** Share of shafts of which the second half is struck out in the end. */
    struck: number;
}

const DURATION = 72;
const [WIDTH, HEIGHT] = [800, 600];
const BOX: [number, number, number, number] = [-10, -80, 810, 680];

/** Differences of rows, low bytes first, then high bytes. */
export function splitDeltaPlanes(items: Uint16Array, row: number): Uint8Array {
    const planes = new Uint8Array(2 * items.length);
    items.forEach((item, i) => {
        const difference = (item - (i < row ? 0 : items[i - row])) & 0xffff;
        planes[i] = difference & 0xff;
        planes[items.length + i] = difference >> 8;
    });
    return planes;
}

/** Packs a header and arrays of given shapes into a container. */
export function packContainer(header: Record<string, unknown>, arrays: Record<string, { items: Items; shape: number[] }>): Uint8Array {
    const entries: Record<string, unknown> = {};
    const parts: Uint8Array[] = [];
    let offset = 0;
    for (const [name, { items, shape }] of Object.entries(arrays)) {
        const delta = items instanceof Uint16Array;
        const row = shape.slice(1).reduce((product, extent) => product * extent, 1);
        const bytes = delta ? splitDeltaPlanes(items, row) : new Uint8Array(items.buffer, items.byteOffset, items.byteLength);
        const type = { Uint8Array: "u8", Uint16Array: "u16", Int16Array: "i16", Uint32Array: "u32", Float32Array: "f32" }[items.constructor.name];
        entries[name] = { offset, length: items.length, type, shape, coding: delta ? "delta-planes" : "plain" };
        const padded = new Uint8Array(Math.ceil(bytes.length / 8) * 8);
        padded.set(bytes);
        parts.push(padded);
        offset += padded.length;
    }
    const text = new TextEncoder().encode(JSON.stringify({ ...header, arrays: entries }));
    const begin = Math.ceil((12 + text.length) / 8) * 8;
    const payload = deflateSync(Buffer.concat(parts));
    const whole = new Uint8Array(begin + payload.length);
    whole.set(new TextEncoder().encode("TROPREC1"));
    new DataView(whole.buffer).setUint32(8, text.length, true);
    whole.set(text, 12);
    whole.set(payload, begin);
    return whole;
}

/** A small generator of numbers in 0…1, the same in every run. */
export function randomNumbers(seed: number): () => number {
    let state = seed >>> 0;
    return () => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return state / 4294967296;
    };
}

/** Where a material point (µm at time 0) is at a share of the run: stretched upwards, pinched in the middle. */
export function carried([x, y]: [number, number], share: number): [number, number] {
    const height = y / HEIGHT - 0.5;
    const pinch = 1 - 0.16 * share * (1 - 4 * height * height);
    return [WIDTH / 2 + (x - WIDTH / 2) * pinch, HEIGHT / 2 + (y - HEIGHT / 2) * (1 + 0.22 * share)];
}

const quantised = (value: number, low: number, high: number): number => Math.round((65535 * (value - low)) / (high - low));
const quantisedPoint = ([x, y]: [number, number]): [number, number] => [quantised(x, BOX[0], BOX[2]), quantised(y, BOX[1], BOX[3])];

/** A whole recording in its container. */
export function sampleRecording(options: SampleOptions, seed = 1): Uint8Array {
    const frames = Array.from({ length: options.frames }, (_, frame) => (DURATION * frame) / (options.frames - 1));
    const mesh = sampleMesh(options.columns, frames);
    const axons = sampleAxons(options, mesh, frames, randomNumbers(seed));
    const header = {
        version: 1,
        scene: "sample",
        description: "A synthetic run: a tissue that stretches, axons that converge",
        seed,
        program: "0.0.0",
        box: BOX,
        frames,
        axon_count: options.axons,
        populations: ["dorsal", "ventral"],
        status_words: ["unborn", "growing", "stalled", "arrived", "left", "retracting", "withdrawn"],
        cues: [
            { name: "attractant", effect: "attract", maximum: 20, frames: [0, Math.floor(options.frames / 2)] },
            { name: "repellent", effect: "repel", maximum: 8, frames: [0] },
        ],
        targets: [{ name: "bulb", closed: true, points: Array.from({ length: 48 }, (_, i) => [400 + 50 * Math.cos((i * Math.PI) / 24), 540 + 50 * Math.sin((i * Math.PI) / 24)]) }],
        measures: axons.measures,
    };
    return packContainer(header, { ...mesh.arrays, ...axons.arrays });
}

type Arrays = Record<string, { items: Items; shape: number[] }>;
interface Mesh { columns: number; rows: number; arrays: Arrays }

function sampleMesh(columns: number, frames: number[]): Mesh {
    const rows = Math.round((columns * HEIGHT) / WIDTH);
    const points: [number, number][] = [];
    for (let j = 0; j <= rows; j++) for (let i = 0; i <= columns; i++) points.push([(WIDTH * i) / columns, (HEIGHT * j) / rows]);
    const cells: number[] = [];
    for (let j = 0; j < rows; j++) {
        for (let i = 0; i < columns; i++) {
            const corner = j * (columns + 1) + i;
            cells.push(corner, corner + 1, corner + columns + 1, corner + columns + 2, corner + columns + 1, corner + 1);
        }
    }
    const positions = new Uint16Array(frames.length * points.length * 2);
    frames.forEach((time, frame) => points.forEach((point, i) => positions.set(quantisedPoint(carried(point, time / DURATION)), 2 * (frame * points.length + i))));
    const near = ([x, y]: [number, number], [a, b]: [number, number], decay: number): number => Math.exp(-Math.hypot(x - a, y - b) / decay);
    const corners: [number, number][] = [[60, 60], [740, 60], [60, 540], [740, 540]];
    const attract = [0.6, 1].flatMap((share) => points.map((point) => Math.round(65535 * share * near(point, [400, 540], 170))));
    const repel = points.map((point) => Math.round(65535 * Math.max(...corners.map((corner) => near(point, corner, 55)))));
    return {
        columns,
        rows,
        arrays: {
            cells: { items: new Uint32Array(cells), shape: [cells.length / 3, 3] },
            vertices: { items: positions, shape: [frames.length, points.length, 2] },
            cue_0: { items: new Uint16Array(attract), shape: [2, points.length] },
            cue_1: { items: new Uint16Array(repel), shape: [1, points.length] },
        },
    };
}

function sampleAxons(options: SampleOptions, mesh: Mesh, frames: number[], random: () => number): { arrays: Arrays; measures: Record<string, number[]> } {
    const { axons, vertices } = options;
    const birth = new Float32Array(axons);
    const start = new Uint32Array(axons + 1);
    const [cell, weights, time, end]: [number[], number[], number[], number[]] = [[], [], [], []];
    const tips = new Uint16Array(frames.length * axons * 2);
    const heading = new Uint8Array(frames.length * axons);
    const status = new Uint8Array(frames.length * axons);
    const counts = { born: frames.map(() => 0), growing: frames.map(() => 0), arrived: frames.map(() => 0) };
    for (let axon = 0; axon < axons; axon++) {
        birth[axon] = 18 * random();
        const step = 48 / vertices;
        const struck = random() < options.struck;
        const path = samplePath(vertices, random);
        path.forEach((point, i) => {
            const [where, one, two] = locate(point, mesh);
            cell.push(where);
            weights.push(one, two);
            time.push(Math.round((65535 * (birth[axon] + i * step)) / DURATION));
            end.push(struck && i > vertices / 2 ? 65000 : 65535);
        });
        start[axon + 1] = cell.length;
        frames.forEach((now, frame) => {
            const at = frame * axons + axon;
            const progress = (now - birth[axon]) / step;
            if (progress < 0) return;
            const i = Math.min(Math.floor(progress), vertices - 1);
            const part = Math.min(progress - i, 1);
            const [here, next] = [path[i], path[Math.min(i + 1, vertices - 1)]];
            tips.set(quantisedPoint(carried([here[0] + part * (next[0] - here[0]), here[1] + part * (next[1] - here[1])], now / DURATION)), 2 * at);
            heading[at] = Math.round((256 * Math.atan2(next[1] - here[1], next[0] - here[0])) / (2 * Math.PI)) & 255;
            status[at] = i < vertices - 1 ? 1 : 3;
            counts.born[frame]++;
            counts[i < vertices - 1 ? "growing" : "arrived"][frame]++;
        });
    }
    return {
        measures: { time: frames, ...counts },
        arrays: {
            tip_position: { items: tips, shape: [frames.length, axons, 2] },
            tip_heading: { items: heading, shape: [frames.length, axons] },
            tip_status: { items: status, shape: [frames.length, axons] },
            axon_population: { items: Uint8Array.from({ length: axons }, (_, axon) => axon % 2), shape: [axons] },
            axon_birth: { items: birth, shape: [axons] },
            axon_parent: { items: new Uint32Array(axons).fill(4294967295), shape: [axons] },
            shaft_start: { items: start, shape: [axons + 1] },
            shaft_cell: { items: new Uint32Array(cell), shape: [cell.length] },
            shaft_weights: { items: new Uint16Array(weights), shape: [cell.length, 2] },
            shaft_time: { items: new Uint16Array(time), shape: [cell.length] },
            ...(options.struck > 0 ? { shaft_end: { items: new Uint16Array(end), shape: [cell.length] } } : {}),
        },
    };
}

/** A path from the lower edge to the disc, in material coordinates: drawn to one of five bundles on the way. */
function samplePath(vertices: number, random: () => number): [number, number][] {
    let x = 20 + 760 * random();
    const bundle = 160 * Math.round((x - 400) / 160) + 400 + 8 * (random() - 0.5);
    return Array.from({ length: vertices }, (_, i) => {
        const share = i / (vertices - 1);
        const goal = share < 0.6 ? bundle : 400 + 60 * (random() - 0.5);
        x += 0.06 * (goal - x) * (100 / vertices) + 3 * (random() - 0.5);
        return [Math.min(Math.max(x, 0), WIDTH), 500 * share];
    });
}

function locate([x, y]: [number, number], { columns, rows }: Mesh): [number, number, number] {
    const [u, v] = [(x * columns) / WIDTH, (y * rows) / HEIGHT];
    const [i, j] = [Math.min(Math.floor(u), columns - 1), Math.min(Math.floor(v), rows - 1)];
    const [p, q] = [u - i, v - j];
    const square = 2 * (j * columns + i);
    const share = (value: number): number => Math.round(65535 * Math.min(Math.max(value, 0), 1));
    return p + q <= 1 ? [square, share(p), share(q)] : [square + 1, share(1 - p), share(1 - q)];
}

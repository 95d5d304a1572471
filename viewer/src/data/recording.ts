/** A recording as the viewer uses it: typed arrays with their lengths checked, coordinates still quantised. */
import { type Container, DamagedRecording, type Items } from "./container.ts";

/** A cue that was recorded. */
export interface Cue {
    name: string;
    effect: "attract" | "repel" | null;
    /** Largest concentration over all frames in nM. */
    maximum: number;
    /** Frames at which a field is stored; it holds until the next. */
    frames: number[];
    /** [stored fields, vertices], share of the maximum times 65535. */
    field: Uint16Array;
}

/** A place that axons arrive at. */
export interface Target {
    name: string;
    closed: boolean;
    /** Points in µm at the first frame. */
    points: [number, number][];
    /** Material points, where known: mesh cells and the weights of their vertices 1 and 2 times 65535. */
    cells?: number[];
    weights?: number[] | [number, number][];
}

/** Laid shafts: vertices of all axons one after another, origin to tip. */
export interface Shafts {
    /** [axons + 1] first vertex of each axon. */
    start: Uint32Array;
    /** Mesh cell of each vertex. */
    cell: Uint32Array;
    /** [vertices, 2] weights of the cell's vertices 1 and 2 times 65535. */
    weights: Uint16Array;
    /** When a vertex was laid, share of the last frame's time times 65535. */
    time: Uint16Array;
    /** When it was struck out; null where nothing ever was. */
    end: Uint16Array | null;
}

/** A whole run. Times are hours, lengths µm. */
export interface Recording {
    scene: string;
    description: string;
    seed: number | null;
    box: [number, number, number, number];
    frames: number[];
    axonCount: number;
    populations: string[];
    statusWords: string[];
    cues: Cue[];
    targets: Target[];
    measures: Record<string, number[]>;
    cells: Uint32Array;
    vertexCount: number;
    /** [frames or 1, vertices, 2] quantised positions of the mesh. */
    mesh: Uint16Array;
    /** Whether the tissue moves. */
    moves: boolean;
    tipPosition: Uint16Array;
    tipHeading: Uint8Array;
    tipStatus: Uint8Array;
    population: Uint8Array | Uint16Array;
    birth: Float32Array;
    /** Axon that it branched from; 4294967295 for none. */
    parent: Uint32Array;
    shafts: Shafts;
}

/** `parent` of an axon that is no branch. */
export const NO_PARENT = 4294967295;

/** Checks a container and gives its recording. */
export function readRecording(container: Container): Recording {
    const { header } = container;
    const frames = numbers(header["frames"], "frames");
    if (frames.length === 0) throw new DamagedRecording("the recording has no frames");
    const axonCount = Number(header["axon_count"] ?? 0);
    const box = numbers(header["box"], "box");
    if (box.length !== 4 || !(box[2] > box[0] && box[3] > box[1])) {
        throw new DamagedRecording(`the box of the recording is [${box.join(", ")}]: x_min, y_min, x_max, y_max expected`);
    }
    const need = demand(container);
    const mesh = need("vertices", Uint16Array);
    const meshFrames = container.shape("vertices")[0] ?? 1;
    const vertexCount = mesh.length / (2 * meshFrames);
    if (meshFrames !== 1 && meshFrames !== frames.length) {
        throw new DamagedRecording(`the mesh has ${meshFrames} frames, the recording ${frames.length}`);
    }
    const start = need("shaft_start", Uint32Array, axonCount + 1);
    const shaftVertices = start[axonCount];
    const population = container.array("axon_population");
    const scale = { frames: frames.length, vertexCount };
    return {
        scene: String(header["scene"] ?? ""),
        description: String(header["description"] ?? ""),
        seed: typeof header["seed"] === "number" ? header["seed"] : null,
        box: box as Recording["box"],
        frames,
        axonCount,
        populations: texts(header["populations"]),
        statusWords: texts(header["status_words"]),
        cues: list(header["cues"]).map((cue, index) => readCue(cue, index, need, scale)),
        targets: list(header["targets"]) as unknown as Target[],
        measures: (header["measures"] ?? {}) as Record<string, number[]>,
        cells: checkedCells(need("cells", Uint32Array), vertexCount),
        vertexCount,
        mesh,
        moves: meshFrames > 1,
        tipPosition: need("tip_position", Uint16Array, frames.length * axonCount * 2),
        tipHeading: need("tip_heading", Uint8Array, frames.length * axonCount),
        tipStatus: need("tip_status", Uint8Array, frames.length * axonCount),
        population: population instanceof Uint16Array ? population : need("axon_population", Uint8Array, axonCount),
        birth: need("axon_birth", Float32Array, axonCount),
        parent: need("axon_parent", Uint32Array, axonCount),
        shafts: {
            start,
            cell: need("shaft_cell", Uint32Array, shaftVertices),
            weights: need("shaft_weights", Uint16Array, shaftVertices * 2),
            time: need("shaft_time", Uint16Array, shaftVertices),
            end: container.array("shaft_end") ? need("shaft_end", Uint16Array, shaftVertices) : null,
        },
    };
}

type Demand = <T extends Items>(name: string, type: new (length: number) => T, length?: number) => T;

function demand(container: Container): Demand {
    return (name, type, length) => {
        const items = container.array(name);
        if (!items) throw new DamagedRecording(`the recording has no array ${name}`);
        if (!(items instanceof type)) throw new DamagedRecording(`array ${name} has another type than ${type.name}`);
        if (length !== undefined && items.length !== length) {
            throw new DamagedRecording(`array ${name} has ${items.length} items where ${length} are expected`);
        }
        return items;
    };
}

function readCue(cue: Record<string, unknown>, index: number, need: Demand, scale: { frames: number; vertexCount: number }): Cue {
    const frames = numbers(cue["frames"], `cue ${index}: frames`);
    if (frames.length === 0 || frames.some((frame) => frame < 0 || frame >= scale.frames)) {
        throw new DamagedRecording(`cue ${index}: its frames [${frames.join(", ")}] are not frames of the recording`);
    }
    const effect = cue["effect"] === "attract" || cue["effect"] === "repel" ? cue["effect"] : null;
    const field = need(`cue_${index}`, Uint16Array, frames.length * scale.vertexCount);
    return { name: String(cue["name"] ?? index), effect, maximum: Number(cue["maximum"] ?? 0), frames, field };
}

function checkedCells(cells: Uint32Array, vertexCount: number): Uint32Array {
    const beyond = cells.find((vertex) => vertex >= vertexCount);
    if (beyond !== undefined) throw new DamagedRecording(`a cell names vertex ${beyond} of ${vertexCount}`);
    return cells;
}

function list(value: unknown): Record<string, unknown>[] {
    return Array.isArray(value) ? (value as Record<string, unknown>[]) : [];
}

function texts(value: unknown): string[] {
    return Array.isArray(value) ? value.map(String) : [];
}

function numbers(value: unknown, name: string): number[] {
    if (!Array.isArray(value) || value.some((item) => typeof item !== "number")) {
        throw new DamagedRecording(`${name} of the recording is not a list of numbers`);
    }
    return value as number[];
}

/** A recording at one time: where the tissue, its fields and the growth cones are, between the stored frames. */
import type { Cue, Recording } from "../data/recording.ts";

/** A time between two frames. */
export interface FramePair {
    /** The frame at or before the time. */
    before: number;
    /** The next frame, or the same at the end. */
    after: number;
    /** How far the time lies from `before` (0) to `after` (1). */
    share: number;
}

/** The frames around a time in hours; times outside are clamped. */
export function framesAround(frames: number[], time: number): FramePair {
    let [low, high] = [0, frames.length - 1];
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (frames[middle] <= time) low = middle;
        else high = middle;
    }
    if (time >= frames[high]) return { before: high, after: high, share: 0 };
    const share = (time - frames[low]) / (frames[high] - frames[low]);
    return { before: low, after: high, share: Math.min(Math.max(share, 0), 1) };
}

/** What is where at one time; made once a recording and moved by {@link Moment.moveTo}. Lengths µm. */
export class Moment {
    /** Hours. */
    time = Number.NaN;
    /** The time on the scale of `shafts.time`. */
    tick = 0;
    /** [vertices, 2] of the mesh. */
    readonly mesh: Float32Array;
    /** [axons, 2] of the growth cones; only where `visible`. */
    readonly tips: Float32Array;
    /** Status of each axon, index of `statusWords`. */
    readonly status: Uint8Array;
    /** 1 where the axon is born and not withdrawn. */
    readonly visible: Uint8Array;
    /** Direction of each cone, 256 to the turn. */
    readonly heading: Uint8Array;
    private readonly unborn: number;
    private readonly withdrawn: number;

    constructor(readonly recording: Recording) {
        this.mesh = new Float32Array(2 * recording.vertexCount);
        this.tips = new Float32Array(2 * recording.axonCount);
        this.status = new Uint8Array(recording.axonCount);
        this.visible = new Uint8Array(recording.axonCount);
        this.heading = new Uint8Array(recording.axonCount);
        this.unborn = recording.statusWords.indexOf("unborn");
        this.withdrawn = recording.statusWords.indexOf("withdrawn");
        this.moveTo(recording.frames[0]);
    }

    /** Moves to a time in hours. */
    moveTo(time: number): void {
        if (time === this.time) return;
        const { recording } = this;
        this.time = time;
        this.tick = tickOf(recording, time);
        const pair = framesAround(recording.frames, time);
        if (recording.moves) this.blend(recording.mesh, pair, this.mesh);
        else this.blend(recording.mesh, { before: 0, after: 0, share: 0 }, this.mesh);
        this.blend(recording.tipPosition, pair, this.tips);
        for (let axon = 0; axon < recording.axonCount; axon++) this.settle(axon, pair);
    }

    /** Position in µm of a shaft vertex. */
    shaftPoint(vertex: number): [number, number] {
        const { cells, shafts } = this.recording;
        const [one, two] = [shafts.weights[2 * vertex] / 65535, shafts.weights[2 * vertex + 1] / 65535];
        return this.materialPoint(cells.subarray(3 * shafts.cell[vertex], 3 * shafts.cell[vertex] + 3), one, two);
    }

    /** Position of a material point by the weights of its cell's vertices 1 and 2. */
    materialPoint(corners: ArrayLike<number>, one: number, two: number): [number, number] {
        const at = (axis: number): number => {
            const zero = 1 - one - two;
            return zero * this.mesh[2 * corners[0] + axis] + one * this.mesh[2 * corners[1] + axis] + two * this.mesh[2 * corners[2] + axis];
        };
        return [at(0), at(1)];
    }

    /** Whether a shaft vertex is laid and not struck out. */
    isLaid(vertex: number): boolean {
        const { shafts } = this.recording;
        return shafts.time[vertex] <= this.tick && (shafts.end === null || shafts.end[vertex] === 65535 || this.tick < shafts.end[vertex]);
    }

    /** The drawn shaft of an axon, origin to tip, x and y by turns; empty where there is none. */
    shaft(axon: number): number[] {
        if (!this.visible[axon]) return [];
        const { start } = this.recording.shafts;
        const points: number[] = [];
        for (let vertex = start[axon]; vertex < start[axon + 1]; vertex++) {
            if (this.isLaid(vertex)) points.push(...this.shaftPoint(vertex));
        }
        points.push(this.tips[2 * axon], this.tips[2 * axon + 1]);
        return points;
    }

    private blend(rows: Uint16Array, { before, after, share }: FramePair, into: Float32Array): void {
        const [x0, y0, x1, y1] = this.recording.box;
        const scale = [(x1 - x0) / 65535, (y1 - y0) / 65535];
        const [a, b] = [before * into.length, after * into.length];
        for (let i = 0; i < into.length; i += 2) {
            into[i] = x0 + scale[0] * (rows[a + i] + share * (rows[b + i] - rows[a + i]));
            into[i + 1] = y0 + scale[1] * (rows[a + i + 1] + share * (rows[b + i + 1] - rows[a + i + 1]));
        }
    }

    private settle(axon: number, { before, after, share }: FramePair): void {
        const { recording, unborn, withdrawn } = this;
        const [a, b] = [before * recording.axonCount + axon, after * recording.axonCount + axon];
        const [was, will] = [recording.tipStatus[a], recording.tipStatus[b]];
        const bornBetween = was === unborn && will !== unborn && this.time >= recording.birth[axon];
        this.status[axon] = bornBetween ? will : was;
        this.visible[axon] = (was !== unborn || bornBetween) && was !== withdrawn ? 1 : 0;
        this.heading[axon] = recording.tipHeading[was === unborn || share > 0.5 ? b : a];
        if (bornBetween) this.startFromOrigin(axon, after);
    }

    /** Between birth and the first frame the cone moves on the line from its origin. */
    private startFromOrigin(axon: number, after: number): void {
        const { recording } = this;
        const { start } = recording.shafts;
        const [x0, y0, x1, y1] = recording.box;
        const q = 2 * (after * recording.axonCount + axon);
        const tip = [x0 + ((x1 - x0) * recording.tipPosition[q]) / 65535, y0 + ((y1 - y0) * recording.tipPosition[q + 1]) / 65535];
        const origin = start[axon + 1] > start[axon] ? this.shaftPoint(start[axon]) : tip;
        const span = recording.frames[after] - recording.birth[axon];
        const part = span > 0 ? (this.time - recording.birth[axon]) / span : 1;
        this.tips[2 * axon] = origin[0] + part * (tip[0] - origin[0]);
        this.tips[2 * axon + 1] = origin[1] + part * (tip[1] - origin[1]);
    }
}

/** A time in hours on the scale of `shafts.time`. */
export function tickOf(recording: Recording, time: number): number {
    const last = recording.frames[recording.frames.length - 1];
    return last > 0 ? Math.floor((65535 * Math.min(Math.max(time, 0), last)) / last + 1e-6) : 65535;
}

/** The field of a cue that holds at a time: index of its stored fields. */
export function fieldAt(cue: Cue, frames: number[], time: number): number {
    const { before } = framesAround(frames, time);
    let index = 0;
    while (index + 1 < cue.frames.length && cue.frames[index + 1] <= before) index++;
    return index;
}

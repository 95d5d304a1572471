/** The numbers of one axon at one moment, and which axon is near a point. */
import { NO_PARENT } from "../data/recording.ts";
import type { Moment } from "./moment.ts";

/** What is told of an axon. */
export interface AxonNumbers {
    axon: number;
    population: string;
    status: string;
    /** Hours. */
    birth: number;
    /** The axon it branched from, or null. */
    parent: number | null;
    /** Length of the shaft in µm. */
    length: number;
    /** Distance from origin to tip over length; null without a length. */
    straightness: number | null;
    /** Direction of the cone in degrees, counter-clockwise from the right. */
    heading: number;
    /** Position of the cone in µm. */
    tip: [number, number];
    /** Hours of the first frame at which it has arrived; null if it never does. */
    arrival: number | null;
}

/** The numbers of an axon. */
export function axonNumbers(moment: Moment, axon: number): AxonNumbers {
    const { recording } = moment;
    const points = moment.shaft(axon);
    let length = 0;
    for (let i = 2; i < points.length; i += 2) length += Math.hypot(points[i] - points[i - 2], points[i + 1] - points[i - 1]);
    const count = points.length;
    const reach = count > 0 ? Math.hypot(points[count - 2] - points[0], points[count - 1] - points[1]) : 0;
    const parent = recording.parent[axon];
    return {
        axon,
        population: recording.populations[recording.population[axon]] ?? "",
        status: recording.statusWords[moment.status[axon]] ?? "",
        birth: recording.birth[axon],
        parent: parent === NO_PARENT ? null : parent,
        length,
        straightness: length > 0 ? reach / length : null,
        heading: (((moment.heading[axon] * 360) / 256 + 180) % 360) - 180,
        tip: [moment.tips[2 * axon], moment.tips[2 * axon + 1]],
        arrival: arrivalTime(moment, axon),
    };
}

function arrivalTime({ recording }: Moment, axon: number): number | null {
    const arrived = recording.statusWords.indexOf("arrived");
    const frame = recording.frames.findIndex((_, f) => recording.tipStatus[f * recording.axonCount + axon] === arrived);
    return frame < 0 || arrived < 0 ? null : recording.frames[frame];
}

/**
 * Finds axons near a point. Shaft vertices are listed by mesh cell, which ride the tissue, so that the lists never
 * change: only the cells near the point are looked into.
 */
export class Finder {
    private readonly first: Uint32Array;
    private readonly vertices: Uint32Array;
    private readonly axonOf: Uint32Array;

    constructor(private readonly moment: Moment) {
        const { cells, shafts, axonCount } = moment.recording;
        this.first = new Uint32Array(cells.length / 3 + 1);
        this.vertices = new Uint32Array(shafts.cell.length);
        this.axonOf = new Uint32Array(shafts.cell.length);
        shafts.cell.forEach((cell) => this.first[cell + 1]++);
        for (let cell = 1; cell < this.first.length; cell++) this.first[cell] += this.first[cell - 1];
        const next = this.first.slice();
        shafts.cell.forEach((cell, vertex) => (this.vertices[next[cell]++] = vertex));
        for (let axon = 0; axon < axonCount; axon++) this.axonOf.fill(axon, shafts.start[axon], shafts.start[axon + 1]);
    }

    /** The axon whose cone, or else whose shaft, is nearest to a point within a reach (µm); null for none. */
    near(point: [number, number], reach: number, shown: (axon: number) => boolean): number | null {
        return this.nearestTip(point, reach, shown) ?? this.nearestShaft(point, reach, shown);
    }

    private nearestTip([x, y]: [number, number], reach: number, shown: (axon: number) => boolean): number | null {
        const { tips, visible } = this.moment;
        let [best, least]: [number | null, number] = [null, reach];
        for (let axon = 0; axon < visible.length; axon++) {
            const distance = visible[axon] ? Math.hypot(tips[2 * axon] - x, tips[2 * axon + 1] - y) : Infinity;
            if (distance < least && shown(axon)) [best, least] = [axon, distance];
        }
        return best;
    }

    private nearestShaft(point: [number, number], reach: number, shown: (axon: number) => boolean): number | null {
        const { moment } = this;
        let [best, least]: [number | null, number] = [null, reach];
        for (let cell = 0; cell + 1 < this.first.length; cell++) {
            if (this.first[cell] === this.first[cell + 1] || !this.isCellNear(cell, point, 2 * reach)) continue;
            for (let k = this.first[cell]; k < this.first[cell + 1]; k++) {
                const vertex = this.vertices[k];
                const axon = this.axonOf[vertex];
                if (!moment.visible[axon] || !moment.isLaid(vertex) || !shown(axon)) continue;
                const distance = this.distanceAround(vertex, axon, point);
                if (distance < least) [best, least] = [axon, distance];
            }
        }
        return best;
    }

    private isCellNear(cell: number, point: [number, number], reach: number): boolean {
        const { cells } = this.moment.recording;
        const { mesh } = this.moment;
        return [0, 1].every((axis) => {
            const corners = [0, 1, 2].map((corner) => mesh[2 * cells[3 * cell + corner] + axis]);
            const margin = reach + (Math.max(...corners) - Math.min(...corners));
            return point[axis] > Math.min(...corners) - margin && point[axis] < Math.max(...corners) + margin;
        });
    }

    /** Distance to the segments before and after a vertex. */
    private distanceAround(vertex: number, axon: number, point: [number, number]): number {
        const { moment } = this;
        const { start } = moment.recording.shafts;
        const here = moment.shaftPoint(vertex);
        const hasNext = vertex + 1 < start[axon + 1] && moment.isLaid(vertex + 1);
        const after: [number, number] = hasNext ? moment.shaftPoint(vertex + 1) : [moment.tips[2 * axon], moment.tips[2 * axon + 1]];
        const before = vertex > start[axon] && moment.isLaid(vertex - 1) ? moment.shaftPoint(vertex - 1) : here;
        return Math.min(distanceToSegment(point, here, after), distanceToSegment(point, before, here));
    }
}

/** Distance of a point from a segment. */
export function distanceToSegment([x, y]: [number, number], [ax, ay]: [number, number], [bx, by]: [number, number]): number {
    const [dx, dy] = [bx - ax, by - ay];
    const square = dx * dx + dy * dy;
    const share = square > 0 ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / square, 0), 1) : 0;
    return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

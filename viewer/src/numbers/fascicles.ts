/**
 * Fascicles as the program measures them: axons whose first crossings of a horizontal line lie no further than the
 * linkage distance from the next one belong together (single linkage on a line).
 */
import type { Moment } from "./moment.ts";

/** The fascicles on one line. */
export interface Fascicles {
    /** Height of the line in µm. */
    height: number;
    /** For each axon its fascicle, the largest first; -1 for an axon alone, -2 for one that does not cross. */
    of: Int32Array;
    /** Axons of each fascicle, falling. */
    sizes: number[];
}

/** Where a polyline (x and y by turns) first crosses a height; null where it does not. */
export function firstCrossing(points: number[], height: number): number | null {
    for (let i = 0; i + 3 < points.length; i += 2) {
        const [below, above] = [points[i + 1] - height, points[i + 3] - height];
        if (below === 0) return points[i];
        if (below * above < 0 || above === 0) return points[i] + ((points[i + 2] - points[i]) * below) / (below - above);
    }
    return null;
}

/** The fascicles at half the present extent of the tissue. */
export function fasciclesAtHalfHeight(moment: Moment, linkage: number): Fascicles {
    const { axonCount } = moment.recording;
    let [low, high] = [Infinity, -Infinity];
    for (let i = 1; i < moment.mesh.length; i += 2) {
        low = Math.min(low, moment.mesh[i]);
        high = Math.max(high, moment.mesh[i]);
    }
    const height = (low + high) / 2;
    const crossings: { axon: number; x: number }[] = [];
    for (let axon = 0; axon < axonCount; axon++) {
        const x = firstCrossing(moment.shaft(axon), height);
        if (x !== null) crossings.push({ axon, x });
    }
    return { height, ...linked(crossings, linkage, axonCount) };
}

/** Cuts sorted crossings wherever the gap is wider than the linkage distance. */
export function linked(crossings: { axon: number; x: number }[], linkage: number, axonCount: number): { of: Int32Array; sizes: number[] } {
    const sorted = [...crossings].sort((a, b) => a.x - b.x || a.axon - b.axon);
    const clusters: number[][] = [];
    sorted.forEach(({ axon, x }, i) => {
        if (i === 0 || x - sorted[i - 1].x > linkage) clusters.push([]);
        clusters[clusters.length - 1].push(axon);
    });
    const fascicles = clusters.filter((cluster) => cluster.length > 1).sort((a, b) => b.length - a.length);
    const of = new Int32Array(axonCount).fill(-2);
    clusters.filter((cluster) => cluster.length === 1).forEach(([axon]) => (of[axon] = -1));
    fascicles.forEach((cluster, index) => cluster.forEach((axon) => (of[axon] = index)));
    return { of, sizes: fascicles.map((cluster) => cluster.length) };
}

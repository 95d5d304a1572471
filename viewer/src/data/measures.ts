/** The measures of a recording over its frames: those of its header, or else how many axons are in each state. */
import type { Recording } from "./recording.ts";

/** Columns over `time`. */
export function measuresOf(recording: Recording): Record<string, number[]> {
    if (Object.keys(recording.measures).length > 1) return recording.measures;
    const { frames, axonCount, statusWords, tipStatus } = recording;
    const counted = (status: number): number[] =>
        frames.map((_, frame) => tipStatus.subarray(frame * axonCount, (frame + 1) * axonCount).reduce((sum, word) => sum + (word === status ? 1 : 0), 0));
    const columns = Object.fromEntries(statusWords.map((word, status) => [word, counted(status)]));
    const { unborn = frames.map(() => 0), ...states } = columns;
    return { time: frames, born: unborn.map((count) => axonCount - count), ...states };
}

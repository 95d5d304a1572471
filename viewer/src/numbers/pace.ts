/** How much detail the machine can draw while something moves, judged by how fast frames come. */

/** Milliseconds a frame above which less detail is drawn while things move, and below which more. */
const SLOW = 37;
const FAST = 22;
/** Share of the latest frame in the mean that is judged, and the most that one frame counts for. */
const WEIGHT = 0.15;
const LONGEST = 80;

/** Chooses among levels of detail; a higher one draws less. */
export class Pace {
    private level: number;
    private last = Number.NaN;
    private mean = FAST;
    /** Fast frames in a row, and how many make it try more detail. */
    private calm = 0;
    private needed = 40;

    constructor(private readonly least: number, private readonly most: number) {
        this.level = least;
    }

    /** The level of a frame that is drawn at a time in milliseconds. */
    levelAt(now: number): number {
        const interval = now - this.last;
        this.last = now;
        if (Number.isNaN(interval)) return this.level;
        this.mean += WEIGHT * (Math.min(interval, LONGEST) - this.mean);
        this.calm = this.mean < FAST ? this.calm + 1 : 0;
        if (this.mean > SLOW && this.level < this.most) this.go(1);
        if (this.calm >= this.needed && this.level > this.least) this.go(-1);
        return this.level;
    }

    /** Tells it that nothing moves any more, so that the pause counts as no slow frame. */
    rest(): void {
        this.last = Number.NaN;
    }

    /** Each return to less detail makes the next trial of more wait longer, or levels would alternate for ever. */
    private go(by: 1 | -1): void {
        this.level += by;
        if (by > 0) this.needed = Math.min(2 * this.needed, 1000);
        this.mean = FAST;
        this.calm = 0;
    }
}

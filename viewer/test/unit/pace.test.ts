import assert from "node:assert/strict";
import { test } from "node:test";
import { Pace } from "../../src/numbers/pace.ts";

/** Lets frames pass at an interval and gives the levels they are drawn at. */
function pass(pace: Pace, clock: { now: number }, interval: number, frames: number): number[] {
    return Array.from({ length: frames }, () => pace.levelAt((clock.now += interval)));
}

test("slow frames take detail away, fast ones give it back, and a single slow one does neither", () => {
    const [pace, clock] = [new Pace(0, 2), { now: 0 }];
    assert.deepEqual(new Set(pass(pace, clock, 17, 50)), new Set([0]));
    assert.equal(pass(pace, clock, 200, 1)[0], 0);
    assert.deepEqual(new Set(pass(pace, clock, 30, 50)), new Set([0]));
    assert.equal(pass(pace, clock, 60, 40).at(-1), 2);
    assert.equal(pass(pace, clock, 30, 500).at(-1), 2);
    assert.equal(pass(pace, clock, 10, 1000).at(-1), 0);
});

test("a pause is no slow frame, and each vain trial of more detail makes the next one rarer", () => {
    const [pace, clock] = [new Pace(1, 2), { now: 0 }];
    for (let turn = 0; turn < 20; turn++) {
        pace.rest();
        assert.deepEqual(pass(pace, clock, turn === 0 ? 0 : 900, 1), [1]);
    }
    let changes = 0;
    let level = 1;
    for (let frame = 0; frame < 5000; frame++) {
        const next = pass(pace, clock, level === 2 ? 15 : 50, 1)[0];
        if (next !== level) changes++;
        level = next;
    }
    assert.ok(changes > 4 && changes < 24, `${changes} changes`);
});

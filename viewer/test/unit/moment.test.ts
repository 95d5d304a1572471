import assert from "node:assert/strict";
import { test } from "node:test";
import { openContainer } from "../../src/data/container.ts";
import { readRecording, type Recording } from "../../src/data/recording.ts";
import { axonNumbers, distanceToSegment, Finder } from "../../src/numbers/axon.ts";
import { firstCrossing, linked } from "../../src/numbers/fascicles.ts";
import { fieldAt, framesAround, Moment } from "../../src/numbers/moment.ts";
import { outlineOf } from "../../src/numbers/outline.ts";
import { carried, sampleRecording } from "../sample.ts";

const DURATION = 72;

async function sample(struck = 0): Promise<Recording> {
    const bytes = sampleRecording({ axons: 20, vertices: 24, frames: 13, columns: 16, struck });
    return readRecording(await openContainer(new Uint8Array(bytes)));
}

test("a time lies between its frames, and is clamped to them", () => {
    assert.deepEqual(framesAround([0, 1, 3], 2), { before: 1, after: 2, share: 0.5 });
    assert.deepEqual(framesAround([0, 1, 3], 1), { before: 1, after: 2, share: 0 });
    assert.deepEqual(framesAround([0, 1, 3], 9), { before: 2, after: 2, share: 0 });
    assert.deepEqual(framesAround([0, 1, 3], -1), { before: 0, after: 1, share: 0 });
    assert.deepEqual(framesAround([5], 5), { before: 0, after: 0, share: 0 });
});

test("the mesh is carried as the map says, linearly between frames, to the quantum", async () => {
    const moment = new Moment(await sample());
    moment.moveTo(27);
    const corner = (17 * 13 - 1) * 2;
    const [x, y] = carried([800, 600], 27 / DURATION);
    assert.ok(Math.abs(moment.mesh[corner] - x) < 0.02 && Math.abs(moment.mesh[corner + 1] - y) < 0.02, `${moment.mesh[corner]} ${moment.mesh[corner + 1]}`);
});

test("shaft vertices ride the tissue", async () => {
    const recording = await sample();
    const moment = new Moment(recording);
    moment.moveTo(0);
    const start = moment.shaftPoint(recording.shafts.start[3] + 10);
    moment.moveTo(DURATION);
    const [x, y] = moment.shaftPoint(recording.shafts.start[3] + 10);
    const expected = carried(start, 1);
    assert.ok(Math.hypot(x - expected[0], y - expected[1]) < 1, `${x} ${y} ${expected}`);
});

test("a shaft ends at its cone, grows, and loses what is struck out", async () => {
    const recording = await sample(1);
    const moment = new Moment(recording);
    const lengths = [20, 40, 60].map((time) => { moment.moveTo(time); return moment.shaft(5).length; });
    assert.ok(lengths[0] < lengths[1] && lengths[1] < lengths[2], String(lengths));
    const points = moment.shaft(5);
    assert.deepEqual(points.slice(-2), [moment.tips[10], moment.tips[11]]);
    moment.moveTo(DURATION);
    assert.equal(moment.shaft(5).length, 2 * 14, "13 of 24 vertices and the tip");
});

test("an axon is nowhere before its birth and begins at its origin", async () => {
    const recording = await sample();
    const moment = new Moment(recording);
    const late = recording.birth.indexOf(recording.birth.reduce((a, b) => Math.max(a, b)));
    moment.moveTo(recording.birth[late] - 0.01);
    assert.equal(moment.visible[late], 0);
    assert.deepEqual(moment.shaft(late), []);
    moment.moveTo(recording.birth[late] + 1e-4);
    assert.equal(moment.visible[late], 1);
    const origin = moment.shaftPoint(recording.shafts.start[late]);
    assert.ok(Math.hypot(moment.tips[2 * late] - origin[0], moment.tips[2 * late + 1] - origin[1]) < 0.1);
});

test("a field holds from its frame until the next", async () => {
    const { cues, frames } = await sample();
    assert.deepEqual(cues[0].frames, [0, 6]);
    assert.deepEqual([0, 35.9, 36, 72].map((time) => fieldAt(cues[0], frames, time)), [0, 0, 1, 1]);
});

test("the finder finds the axon under a point, cones first, and none far away", async () => {
    const recording = await sample();
    const moment = new Moment(recording);
    moment.moveTo(40);
    const finder = new Finder(moment);
    const all = (): boolean => true;
    assert.equal(finder.near([moment.tips[14], moment.tips[15]], 0.5, all), 7);
    const vertex = recording.shafts.start[7] + 3;
    const [x, y] = moment.shaftPoint(vertex);
    assert.equal(finder.near([x, y], 0.01, all), 7);
    assert.equal(finder.near([x, y], 0.01, (axon) => axon !== 7), null);
    assert.equal(finder.near([-500, -500], 12, all), null);
    assert.equal(distanceToSegment([0, 3], [-1, 0], [1, 0]), 3);
    assert.equal(distanceToSegment([4, 4], [0, 0], [1, 0]), 5);
});

test("the numbers of an axon are those of its path", async () => {
    const recording = await sample();
    const moment = new Moment(recording);
    moment.moveTo(0.5 * DURATION);
    const numbers = axonNumbers(moment, 2);
    assert.equal(numbers.population, "dorsal");
    assert.equal(numbers.status, "growing");
    assert.ok(numbers.length > 100 && numbers.length < 700);
    assert.ok(numbers.straightness !== null && numbers.straightness > 0.3 && numbers.straightness <= 1);
    assert.ok(numbers.arrival !== null && numbers.arrival >= recording.birth[2] + 46 && numbers.arrival <= DURATION);
    assert.equal(numbers.parent, null);
});

test("single linkage cuts at gaps wider than the distance", () => {
    const xs = [0, 5, 14, 40, 45, 100];
    const { of, sizes } = linked(xs.map((x, axon) => ({ axon, x })), 10, 7);
    assert.deepEqual([...of], [0, 0, 0, 1, 1, -1, -2]);
    assert.deepEqual(sizes, [3, 2]);
    assert.equal(firstCrossing([0, 0, 10, 10, 20, 0], 5), 5);
    assert.equal(firstCrossing([0, 0, 10, 10], 11), null);
});

test("the outline is one closed line around a rectangle", async () => {
    const lines = outlineOf((await sample()).cells);
    assert.equal(lines.length, 1);
    assert.equal(lines[0].length, 2 * (16 + 12) + 1);
    assert.equal(lines[0][0], lines[0].at(-1));
});

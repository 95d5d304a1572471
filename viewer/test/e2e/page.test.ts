import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { PNG } from "pngjs";
import { openContainer } from "../../src/data/container.ts";
import { readRecording } from "../../src/data/recording.ts";
import { fitting, pixelOf } from "../../src/numbers/camera.ts";
import { Moment } from "../../src/numbers/moment.ts";
import { HERE, page as report, SAMPLE_CHART, SAMPLE_REPORT, smallSample, writePage } from "../pages.ts";
import { difference, drawn, launch, open, picture, setTime, thumbnail } from "./browser.ts";

let browser: Browser;
const bytes = smallSample();
const url = writePage("small.html", report(SAMPLE_REPORT, [{ label: "", bytes }]));

before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

/** The pixel of a cone of the sample on the page, at a time, with everything in view. */
async function coneOnPage(page: Page, axon: number, hours: number): Promise<[number, number]> {
    const recording = readRecording(await openContainer(new Uint8Array(bytes)));
    const moment = new Moment(recording);
    moment.moveTo(hours);
    const box = await page.locator(".pane").boundingBox();
    assert.ok(box);
    const [x, y] = pixelOf(fitting(recording.box, box), box, [moment.tips[2 * axon], moment.tips[2 * axon + 1]]);
    return [box.x + x, box.y + y];
}

/** The same recording, whose header names no cues. */
function withoutCues(whole: Uint8Array): Uint8Array {
    const length = new DataView(whole.buffer, whole.byteOffset).getUint32(8, true);
    const header = new TextDecoder().decode(whole.subarray(12, 12 + length)).replace(/"cues":\[.*?\}\]/, (cues) => '"cues":[]'.padEnd(cues.length));
    const changed = whole.slice();
    changed.set(new TextEncoder().encode(header), 12);
    return changed;
}

const cardText = (page: Page): Promise<string> => page.locator(".card").innerText();

test("loads from a file, without complaint and without network", async () => {
    const { page, complaints } = await open(browser, url);
    assert.equal(await page.locator("h1").innerText(), "sample");
    assert.match(await page.locator(".notes").innerText(), /decay length/);
    assert.match(await page.locator(".documents").innerText(), /tropism scenarios\/sample\.json/);
    assert.deepEqual(complaints, []);
    await page.context().close();
});

test("the slider moves cones, and the measures follow", async () => {
    const { page } = await open(browser, url);
    await setTime(page, 20);
    const early = await picture(page);
    assert.match(await page.locator(".clock").innerText(), /20\.0 h/);
    const counts = await page.locator(".plots .marks").first().innerText();
    await setTime(page, 50);
    const late = await picture(page);
    assert.ok(difference(early, late) > 0.02, `only ${difference(early, late)} of the picture changed`);
    assert.notEqual(await page.locator(".plots .marks").first().innerText(), counts);
    await page.context().close();
});

test("hovering over a cone shows its numbers, a click follows it, Escape lets go", async () => {
    const { page } = await open(browser, url);
    await setTime(page, 40);
    const [x, y] = await coneOnPage(page, 12, 40);
    assert.equal(await page.locator(".card").isHidden(), true);
    await page.mouse.move(x, y);
    await page.locator(".card").waitFor({ state: "visible" });
    assert.match(await cardText(page), /length\s+\d+ µm/);
    await page.mouse.move(5, 5);
    await page.locator(".card").waitFor({ state: "hidden" });
    await page.mouse.click(x, y);
    await page.locator(".card .tag").waitFor();
    await page.mouse.move(5, 5);
    assert.match(await cardText(page), /followed/);
    await page.keyboard.press("Escape");
    await page.locator(".card").waitFor({ state: "hidden" });
    await page.context().close();
});

test("dragging moves the view and the wheel zooms it", async () => {
    const { page } = await open(browser, url);
    const first = await picture(page);
    const scale = await page.locator(".scale-bar").innerText();
    await page.mouse.move(500, 400);
    await page.mouse.down();
    await page.mouse.move(420, 340, { steps: 3 });
    await page.mouse.up();
    const moved = await picture(page);
    assert.ok(difference(first, moved) > 0.1);
    for (let turn = 0; turn < 8; turn++) await page.mouse.wheel(0, -240);
    await drawn(page);
    assert.notEqual(await page.locator(".scale-bar").innerText(), scale);
    await page.context().close();
});

test("everything can be done by keyboard", async () => {
    const { page } = await open(browser, url);
    const clock = page.locator(".clock");
    await page.keyboard.press("Home");
    assert.match(await clock.innerText(), /= 0\.0 h/);
    await page.keyboard.press("ArrowRight");
    assert.match(await clock.innerText(), /= 2\.0 h/);
    await page.keyboard.press("End");
    await page.keyboard.press("ArrowLeft");
    assert.match(await clock.innerText(), /= 70\.0 h/);
    await page.keyboard.press(".");
    await page.locator(".card .tag").waitFor();
    assert.match(await cardText(page), /Axon 0/);
    const scale = await page.locator(".scale-bar").innerText();
    for (let press = 0; press < 6; press++) await page.keyboard.press("+");
    await drawn(page);
    assert.notEqual(await page.locator(".scale-bar").innerText(), scale);
    await page.keyboard.press("0");
    await drawn(page);
    assert.equal(await page.locator(".scale-bar").innerText(), scale);
    await page.keyboard.press("Home");
    await page.keyboard.press(" ");
    await page.waitForFunction(() => Number((document.getElementById("time") as HTMLInputElement).value) > 0.5);
    await page.keyboard.press(" ");
    assert.equal(await page.locator("#play").getAttribute("aria-label"), "Play");
    const focused = new Set<string>();
    for (let press = 0; press < 14; press++) {
        await page.keyboard.press("Tab");
        focused.add(await page.evaluate(() => document.activeElement?.id ?? ""));
    }
    for (const id of ["theme", "surface", "play", "time", "speed", "colour", "cue"]) assert.ok(focused.has(id), `${id} is not reached: ${[...focused].join(" ")}`);
    await page.context().close();
});

test("colours and layers change the picture, and the legend says what they mean", async () => {
    const { page } = await open(browser, url);
    await setTime(page, 40);
    let last = await picture(page);
    const words: Record<string, RegExp> = { birth: /time of birth \(h\)/, fascicle: /no further than 10 µm/, heading: /90° up/, ink: /growing/ };
    for (const [colour, legend] of Object.entries(words)) {
        await page.selectOption("#colour", colour);
        const now = await picture(page);
        assert.ok(difference(last, now) > 0.005, `${colour} looks like the one before`);
        assert.match(await page.locator(".legend").innerText(), legend);
        last = now;
    }
    for (const act of [() => page.selectOption("#cue", "1"), () => page.selectOption("#map", "cividis"), () => page.selectOption("#scale", "linear"), () => page.uncheck("#layer-shafts"), () => page.uncheck("#layer-tissue")]) {
        await act();
        const now = await picture(page);
        assert.ok(difference(last, now) > 0.005, "the picture stays");
        last = now;
    }
    await page.context().close();
});

test("dark follows the system and the button", async () => {
    const { page, complaints } = await open(browser, url, { dark: true });
    const background = (): Promise<string> => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    assert.equal(await background(), "rgb(20, 19, 23)");
    const dark = await picture(page);
    assert.deepEqual([...dark.data.subarray(4 * (3 * dark.width + 3), 4 * (3 * dark.width + 3) + 3)], [20, 19, 23]);
    await page.click("#theme");
    assert.equal(await background(), "rgb(255, 255, 255)");
    assert.ok(difference(dark, await picture(page)) > 0.5);
    assert.deepEqual(complaints, []);
    await page.context().close();
});

test("a phone shows all without scrolling sideways, and a touch follows an axon", async () => {
    const { page, complaints } = await open(browser, url, { width: 390, height: 844, touch: true });
    await setTime(page, 40);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), "it scrolls sideways");
    const [scene, slider] = [await page.locator("#surface").boundingBox(), await page.locator("#time").boundingBox()];
    assert.ok(scene && slider && slider.y > scene.y + scene.height && slider.y + slider.height < 844);
    await page.touchscreen.tap(...(await coneOnPage(page, 12, 40)));
    await page.locator(".card .tag").waitFor();
    assert.deepEqual(complaints, []);
    await page.context().close();
});

test("an ablation shows its runs side by side with one slider", async () => {
    const labels = ["full", "without chemotaxis", "without fasciculation"];
    const runs = labels.map((label, seed) => ({ label, bytes: smallSample(seed + 1) }));
    runs[1] = { label: labels[1], bytes: withoutCues(runs[1].bytes) };
    const { page, complaints } = await open(browser, writePage("ablation.html", report({ ...SAMPLE_REPORT, kind: "ablation" }, runs)));
    assert.deepEqual(await page.locator(".pane-label").allInnerTexts(), labels);
    assert.equal(await page.locator("#time").count(), 1);
    const late = await picture(page);
    await setTime(page, 15);
    assert.ok(difference(late, await picture(page)) > 0.02);
    assert.deepEqual(complaints, []);
    await page.context().close();
});

test("a chart tells the setting of a mark, by mouse and by keyboard", async () => {
    const { page, complaints } = await open(browser, writePage("chart.html", report({ ...SAMPLE_REPORT, kind: "chart", chart: SAMPLE_CHART! }, [])));
    assert.equal(await page.locator(".setting").count(), 8);
    await page.locator(".setting").nth(1).hover();
    assert.match(await page.locator(".told").innerText(), /euler, step = 30 min: 0\.2 s, error 1\.5/);
    await page.locator(".setting").nth(5).focus();
    assert.match(await page.locator(".told").innerText(), /midpoint, step = 30 min.*the default/);
    assert.deepEqual(complaints, []);
    await page.context().close();
});

test("damaged and missing data are told in the page", async () => {
    const cases: [string, string, RegExp][] = [
        ["cut", report(SAMPLE_REPORT, [{ label: "", bytes: bytes.subarray(0, bytes.length - 5000) }]), /cannot be inflated/],
        ["other", report(SAMPLE_REPORT, [{ label: "", bytes: new Uint8Array(40) }]), /begins with/],
        ["empty", report({}, []), /neither a recording nor a chart/],
        ["json", report("{", []), /JSON/],
    ];
    for (const [name, html, words] of cases) {
        const { page } = await open(browser, writePage(`damaged-${name}.html`, html));
        assert.match(await page.locator(".failure").innerText(), words, name);
        await page.context().close();
    }
});

test("where WebGL is a program, the processor paints, and paints the same", async () => {
    const { page, complaints } = await open(browser, url, { drawing: "" });
    assert.equal(await page.locator("#canvas").getAttribute("data-drawing"), "processor");
    const { page: other } = await open(browser, url);
    assert.equal(await other.locator("#canvas").getAttribute("data-drawing"), "graphics");
    for (const colour of ["type", "heading"]) {
        for (const each of [page, other]) { await each.selectOption("#colour", colour); await setTime(each, 40); await each.waitForTimeout(1500); }
        const share = difference(thumbnail(await picture(page)), thumbnail(await picture(other)));
        assert.ok(share < 0.04, `${colour}: ${(100 * share).toFixed(1)} % differ`);
    }
    assert.deepEqual(complaints, []);
    await page.context().close();
    await other.context().close();
});

test("the picture is the stored one", async () => {
    const { page } = await open(browser, url, { width: 900, height: 640 });
    await page.selectOption("#colour", "ink");
    await setTime(page, 36);
    const now = thumbnail(await picture(page));
    const stored = resolve(HERE, "test/e2e/stored/ink.png");
    if (!existsSync(stored) || process.env["STORE"]) {
        mkdirSync(resolve(HERE, "test/e2e/stored"), { recursive: true });
        writeFileSync(stored, PNG.sync.write(now));
    }
    writeFileSync(resolve(HERE, "out/ink.png"), PNG.sync.write(now));
    const share = difference(now, PNG.sync.read(readFileSync(stored)));
    assert.ok(share < 0.01, `${(100 * share).toFixed(1)} % of the picture differ from ${stored}; the new one is out/ink.png`);
    await page.context().close();
});

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { openContainer } from "../../src/data/container.ts";
import { readRecording } from "../../src/data/recording.ts";
import { tickOf } from "../../src/numbers/moment.ts";
import { BUDGET } from "../../src/soft/shafts.ts";
import { page as report, SAMPLE_REPORT, writePage } from "../pages.ts";
import { sampleRecording } from "../sample.ts";
import { difference, launch, open, picture, setTime } from "./browser.ts";

const AXONS = 2500;
const bytes = sampleRecording({ axons: AXONS, vertices: 60, frames: 25, columns: 32, struck: 0 });
const url = writePage("many.html", report(SAMPLE_REPORT, [{ label: "", bytes }]));
let browser: Browser;

before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

/** Vertices of shafts that are laid at a time. */
async function laidAt(hours: number): Promise<number> {
    const recording = readRecording(await openContainer(new Uint8Array(bytes)));
    const tick = tickOf(recording, hours);
    return recording.shafts.time.reduce((sum, time) => sum + (time <= tick ? 1 : 0), 0);
}

/** Vertices that each of some pictures took, while time or view move from one to the next. */
function whileMoving(page: Page, what: "time" | "view"): Promise<number[]> {
    return page.evaluate((moving) => new Promise<number[]>((done) => {
        const [canvas, slider, surface] = ["canvas", "time", "surface"].map((id) => document.getElementById(id) as HTMLElement);
        const counts: number[] = [];
        const next = (): void => {
            if (counts.length === 20) return done(counts.slice(1));
            counts.push(Number(canvas.dataset["vertices"]));
            if (moving === "time") {
                (slider as HTMLInputElement).value = String(60 + counts.length / 10);
                slider.dispatchEvent(new Event("input"));
            } else surface.dispatchEvent(new WheelEvent("wheel", { deltaY: -1, clientX: 400, clientY: 300, cancelable: true }));
            requestAnimationFrame(() => setTimeout(next));
        };
        next();
    }), what);
}

const atRest = (page: Page, vertices: number): Promise<unknown> =>
    page.waitForFunction((all) => document.getElementById("canvas")?.dataset["vertices"] === String(all), vertices);

test("while something moves, no more vertices are painted than the budget says, and all of them at rest", async () => {
    const { page, complaints } = await open(browser, url, { drawing: "processor" });
    await atRest(page, AXONS * 60);
    const still = await picture(page);
    for (const what of ["time", "view"] as const) {
        const counts = await whileMoving(page, what);
        // One vertex of each shaft is painted in any case.
        assert.ok(counts.every((count) => count > 0 && count <= BUDGET + AXONS), `${what}: ${counts.join(" ")}`);
        await atRest(page, await laidAt(62));
    }
    await page.mouse.move(500, 400);
    await page.mouse.move(510, 400);
    assert.equal(await page.locator("#canvas").getAttribute("data-vertices"), String(await laidAt(62)));
    await page.locator("#surface").press("0");
    await setTime(page, 72);
    await page.mouse.move(5, 5);
    await atRest(page, AXONS * 60);
    await page.waitForTimeout(500);
    assert.equal(difference(still, await picture(page)), 0);
    assert.deepEqual(complaints, []);
    await page.context().close();
});

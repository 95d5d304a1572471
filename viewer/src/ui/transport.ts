/** Time: slider, play, steps and speed. */
import { written } from "../numbers/scales.ts";
import { h } from "./dom.ts";

/** Seconds that a whole run plays at speed 1. */
const PLAYING = 20;

/** The time of the page and its controls. */
export class Transport {
    readonly element: HTMLElement;
    private readonly slider: HTMLInputElement;
    private readonly button: HTMLButtonElement;
    private readonly clock = h("output", { class: "clock", for: "time" });
    private speed = 1;
    private last = 0;
    /** When slider and clock were last brought up to date. */
    private told = 0;
    playing = false;
    time: number;

    /** While time runs, slider and clock follow every `telling` milliseconds. */
    constructor(private readonly frames: number[], private readonly telling: number, private readonly changed: (time: number) => void) {
        const [first, end] = [frames[0], frames[frames.length - 1]];
        this.time = end;
        this.slider = h("input", {
            type: "range", id: "time", min: first, max: end, step: "any", value: end, "aria-label": "Time in hours",
            input: () => this.jump(Number(this.slider.value)),
            keydown: (event: KeyboardEvent) => this.key(event) && event.preventDefault(),
        });
        this.button = h("button", { type: "button", class: "play", id: "play", click: () => this.toggle() });
        const step = (label: string, text: string, by: number): HTMLElement =>
            h("button", { type: "button", class: "step", "aria-label": label, title: label, click: () => this.step(by) }, text);
        const speeds = h("select", { id: "speed", "aria-label": "Speed", title: "Speed", change: () => (this.speed = Number(speeds.value)) },
            ...[0.25, 0.5, 1, 2, 4].map((speed) => h("option", { value: speed, selected: speed === 1 }, `${speed}×`)));
        this.element = h("div", { class: "transport", role: "group", "aria-label": "Time" },
            this.button, step("One frame back", "‹", -1), this.slider, step("One frame on", "›", 1), this.clock, speeds);
        this.show();
    }

    /** Goes to a time in hours. */
    goTo(time: number): void {
        this.time = Math.min(Math.max(time, this.frames[0]), this.frames[this.frames.length - 1]);
        const now = performance.now();
        if (!this.playing || now - this.told >= this.telling) {
            this.told = now;
            this.show();
        }
        this.changed(this.time);
    }

    /** Goes some stored frames on or back. */
    step(by: number): void {
        this.pause();
        const later = this.frames.findIndex((frame) => frame > this.time + 1e-9);
        const earlier = this.frames.findLastIndex((frame) => frame < this.time - 1e-9);
        const from = by > 0 ? (later < 0 ? this.frames.length - 1 : later) : Math.max(earlier, 0);
        this.goTo(this.frames[Math.min(Math.max(from + by - Math.sign(by), 0), this.frames.length - 1)]);
    }

    /** Plays or pauses; at the end it begins again. */
    toggle(): void {
        if (this.playing) return this.pause();
        if (this.time >= this.frames[this.frames.length - 1]) this.goTo(this.frames[0]);
        this.playing = true;
        this.last = performance.now();
        this.show();
        requestAnimationFrame((now) => this.tick(now));
    }

    /** Stops playing; what lagged behind while time ran comes up to it. */
    pause(): void {
        if (!this.playing) return;
        this.playing = false;
        this.goTo(this.time);
    }

    /** Keys of the slider and of the page; whether the key meant anything. */
    key(event: KeyboardEvent): boolean {
        const steps: Record<string, number> = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 };
        if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return false;
        if (event.key in steps) this.step(steps[event.key]);
        else if (event.key === "Home") this.jump(this.frames[0]);
        else if (event.key === "End") this.jump(this.frames[this.frames.length - 1]);
        else return false;
        return true;
    }

    /** Stops and goes to a time in hours. */
    jump(time: number): void {
        this.playing = false;
        this.goTo(time);
    }

    private tick(now: number): void {
        if (!this.playing) return;
        const end = this.frames[this.frames.length - 1];
        const rate = ((end - this.frames[0]) / PLAYING) * this.speed;
        const time = this.time + (rate * Math.max(now - this.last, 0)) / 1000;
        this.last = now;
        if (time >= end) this.playing = false;
        this.goTo(time);
        requestAnimationFrame((next) => this.tick(next));
    }

    private show(): void {
        const text = `t = ${this.time.toFixed(1)} h`;
        this.slider.value = String(this.time);
        this.slider.setAttribute("aria-valuetext", `${written(this.time)} hours`);
        if (this.clock.value !== text) this.clock.value = text;
        const label = this.playing ? "Pause" : "Play";
        if (this.button.getAttribute("aria-label") === label) return;
        this.button.setAttribute("aria-label", label);
        this.button.title = `${label} (space)`;
        this.button.textContent = this.playing ? "❚❚" : "▶";
    }
}
